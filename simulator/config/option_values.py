"""Read cameras, responses and lengths that an option of a command names, outside any shot file."""

from pathlib import Path
from typing import Any

from simulator.color.color_tables import CONFIGS
from simulator.config.camera_file import inline_camera
from simulator.config.document import Document, Place
from simulator.config.document_merge import find_config
from simulator.config.quantity import parse_quantity
from simulator.errors import PhotositeError
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
    try:
        return parse_quantity(text, Unit("micrometre", "_um"))
    except ValueError as error:
        raise PhotositeError(f"{error}", key=label, value=text) from None


def _name_response(response: Path) -> str:
    return response.stem if response.parent == CONFIGS / "responses" else str(response)
