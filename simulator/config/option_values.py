"""Read cameras, lenses, responses, shutters, lengths and times that an option of a command names, outside any shot file."""

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import create_model

from simulator.color.color_tables import CONFIGS
from simulator.config.build import build, validate
from simulator.config.camera_file import inline_camera
from simulator.config.dataclass_sections import make_section
from simulator.config.document import Document, Place, parse_document
from simulator.config.document_merge import find_config, parse_override, replace_section, replace_value
from simulator.config.lens_section import make_lens_field
from simulator.config.quantity import parse_quantity
from simulator.config.section_types import Section
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import AnyShutter
from simulator.optics.lens.lens import Lens
from simulator.units import Unit


def camera_data(name: str, label: str) -> dict[str, Any]:
    """Return a camera file as plain data, merged with its `base:`.

    name: as `camera: name` takes it; a path is relative to the current folder. label: the option, for messages.
    Where the response is another file, its name is made absolute, unless it is one of configs/responses.
    Raises PhotositeError with the nearest name for one that is not there.
    """
    camera = inline_camera(Document(name, {(): Place(f"{label} {name}", Path.cwd())}))
    response = camera.data.get("response")
    if isinstance(response, dict) and "file" in response:
        path = find_config("responses", response["file"], camera.place(("response", "file")), "camera.response.file")
        return camera.data | {"response": response | {"file": _name_response(path)}}
    return camera.data


def response_name(name: str, label: str) -> str:
    """Return how a camera file in any folder may name a response: a shipped name, or an absolute path.

    Raises PhotositeError with the nearest name for one that is not there.
    """
    return _name_response(find_config("responses", name, Place(label, Path.cwd()), "response.file"))


def length_um(text: str, label: str) -> float:
    """Return a length with its unit in micrometres. Raises PhotositeError, which names the option `label`."""
    return _number(text, Unit("micrometre", "_um"), label)


def time_s(text: str, label: str) -> float:
    """Return a time with its unit in seconds. Raises PhotositeError, which names the option `label`."""
    return _number(text, Unit("second", "_s"), label)


def distance_m(text: str, label: str) -> float:
    """Return a distance with its unit in metres; `infinity` is one. Raises PhotositeError, which names the option `label`."""
    return _number(text, Unit("metre", "_m"), label)


def irradiance_w_m2(text: str, label: str) -> float:
    """Return an irradiance with its unit in W/m^2. Raises PhotositeError, which names the option `label`."""
    return _number(text, Unit("watt / metre**2", "_w_m2"), label)


def lens_option(values: Mapping[str, str], overrides: Iterable[str] = ()) -> Lens:
    """Return the lens of options, with the keys of the section `lens` of a shot.

    values: text by option, such as {"--focal-length": "50 mm"}; the option's words are the key.
    overrides: `lens.dotted.path=value` texts as the command line's --set takes them.
    Raises PhotositeError, which names the option, for what that section refuses.
    """
    document = replace_section(Document({}, {(): Place("the lens", Path.cwd())}), "lens", Document({}, {}))
    for option, value in values.items():
        key = f"lens.{option.lstrip('-').replace('-', '_')}"
        place = Place(f"{option} {value}", Path.cwd())
        document = replace_value(document, key, parse_document(value, place.file, place.folder, lines=False).data, place)
    for text in overrides:
        document = replace_value(document, *parse_override(text))
    section: Any = validate(_make_lens_file_section(), document)  # its fields are made at run time
    return build(section.lens, ("lens",), document)


def shutter_option(text: str, label: str) -> AnyShutter:
    """Return the shutter of a text such as `{opening: 1 ms, closing: 2 ms}`, with the keys of `exposure.shutter` of a shot.

    Raises PhotositeError, which names the option `label`, for what that section refuses.
    """
    place = Place(label, Path.cwd())
    shutter = parse_document(text, label, Path.cwd(), lines=False)
    exposure = replace_section(Document({"time": "1 s"}, {(): place, ("time",): place}), "shutter", shutter)
    document = replace_section(Document({}, {(): place}), "exposure", exposure)
    section: Any = validate(_make_shutter_file_section(), document)  # its fields are made at run time
    found: Exposure = build(section.exposure, ("exposure",), document)
    if found.shutter is None:
        raise PhotositeError("give its keys, such as {opening: 1 ms, closing: 2 ms}", key=label, value=text)
    return found.shutter


@cache
def _make_lens_file_section() -> type[Section]:
    return create_model("LensOption", __base__=Section, lens=make_lens_field())


@cache
def _make_shutter_file_section() -> type[Section]:
    return create_model("ShutterOption", __base__=Section, exposure=(make_section(Exposure), ...))


def _name_response(response: Path) -> str:
    return response.stem if response.parent == CONFIGS / "responses" else str(response)


def _number(text: str, unit: Unit, label: str) -> float:
    """Return the number of a unit that an option states. Raises PhotositeError, which names the option `label`."""
    try:
        return parse_quantity(text, unit)
    except ValueError as error:
        raise PhotositeError(f"{error}", key=label, value=text) from None
