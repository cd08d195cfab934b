"""A camera: a name, the path of YAML or of a data sheet, or a mapping with `base:`; sections may state their `source:`."""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, create_model

from simulator.config.build import build, validate
from simulator.config.dataclass_sections import CUSTOM_SECTIONS, make_custom_section
from simulator.config.document import Document, Place, read_document
from simulator.config.document_merge import (
    MERGE,
    find_config,
    is_table,
    merge,
    parse_override,
    remove_key,
    replace_section,
    replace_value,
    select_section,
)
from simulator.config.emva_sheet import SUFFIXES, read_emva_sheet
from simulator.config.response_curves import ResponseCurves, spectral_response
from simulator.config.response_table import read_response_table
from simulator.config.section_types import Section
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage, fields_from_shot

SourceText = Annotated[
    Annotated[str, Tag("<text>")] | Annotated[dict[str, str], Tag("<by key>")],
    Discriminator(lambda value: "<by key>" if isinstance(value, dict) else "<text>"),
]
Source = Annotated[SourceText | None, Field(description="where the numbers come from; text, or text by key")]


def _build_camera(source: object = None, typical: None = None, typical_stages: None = None, **values: Any) -> Camera:
    return Camera(**values)


def _collect_stages(source: object = None, **values: Stage | None) -> dict[str, Stage]:
    return {stem: stage for stem, stage in values.items() if stage is not None}


def _drop_source(cls: type[Stage]) -> Callable[..., Stage]:
    return lambda source=None, **values: cls(**values)


@cache
def make_camera_section() -> type[Section]:
    """Return the model of a camera file. Its stages are the sensor stages whose class sets `in_camera_stages`."""
    source: dict[str, Any] = {"source": (Source, None)}
    stages: dict[str, Any] = {}
    classes: dict[str, Any] = dict(STAGES)  # Any: mypy takes the class of a dataclass for an instance, which has no hash
    for stem, cls in sorted(classes.items()):
        if cls.in_camera_stages:
            leave_out = frozenset(fields_from_shot(cls))
            stages[stem] = (make_custom_section(cls, _drop_source(cls), extra=source, leave_out=leave_out), None)
    stage_model = create_model(
        "Stages", __base__=Section, __doc__="Sensor stages; one that is absent is off.", **(source | stages)
    )
    stage_model.assemble = _collect_stages
    curves = make_custom_section(
        ResponseCurves,
        spectral_response,
        extra=source | {"license": (Annotated[str | None, Field(description="licence of the curves")], None)},
    )
    text = "stages typical of a class of sensors like this one; off unless `typical: true`"
    typical: dict[str, Any] = {  # `settle_typical` turns both into `stages`
        "typical": (bool | None, Field(default=None, description="whether the camera has its typical_stages")),
        "typical_stages": (stage_model | None, Field(default=None, description=text)),
    }
    replaced = {"response": curves, "stages": stage_model}
    return make_custom_section(Camera, _build_camera, replaced, source | typical, leave_out=frozenset({"sources"}))


CUSTOM_SECTIONS[Camera] = make_camera_section


def load_camera(name: str, overrides: Iterable[str] = ()) -> Camera:
    """Return the camera of a name in configs/cameras or of a file.

    overrides: `camera.dotted.path=value` texts as the command line's --set takes them.
    Raises PhotositeError with file and line.
    """
    document = read_camera_document(name, overrides)
    document = replace_section(document, "camera", settle_typical(select_section(document, "camera")))
    section: Any = validate(_make_camera_file_section(), document)  # its fields are made at run time
    return with_sources(build(section.camera, ("camera",), document), document.data["camera"])


def with_sources(camera: Camera, section: dict[str, Any]) -> Camera:
    """Return a camera with the sources that its section of the configuration states."""
    return replace(camera, sources=tuple(list_sources(section)))


def list_sources(section: dict[str, Any], path: str = "") -> list[tuple[str, str]]:
    """Return keys and text of every `source:` in a section and the sections in it; "" stands for all of its keys.

    path: dotted key of the section.
    """
    found = []
    given = section.get("source") or {}
    for keys, text in given.items() if isinstance(given, dict) else [("", given)]:
        named = [f"{path}.{key}".strip(".") for key in keys.split(", ")]
        found.append((", ".join(named), text))
    for key, value in section.items():
        if isinstance(value, dict) and key != "source":
            found += list_sources(value, f"{path}.{key}".strip("."))
    return found


@cache
def _make_camera_file_section() -> type[Section]:
    return create_model("CameraFile", __base__=Section, camera=(make_camera_section(), ...))


def read_camera_document(name: str, overrides: Iterable[str] = ()) -> Document:
    """Return `{camera: ...}` as written, base and response included, so that every number stands beside its `source:`."""
    place = Place(name, Path.cwd())
    document = replace_section(Document({}, {(): place}), "camera", inline_camera(Document(name, {(): place})))
    for text in overrides:
        document = replace_value(document, *parse_override(text))
    return replace_section(document, "camera", inline_response(select_section(document, "camera")))


def inline_camera(document: Document) -> Document:
    """Replace `camera: name` and `camera: {base: name, ...}` by a full mapping: the base, overlaid by the other keys.

    Raises PhotositeError for a table that is to be merged with none.
    """
    document = _drop_covered_response(_inline_base(document, "camera", ()))
    for key, table in document.data.items() if isinstance(document.data, dict) else ():
        if is_table(table) and MERGE in table:
            rule = f"there is no {key} below to merge it with; leave it out, or name a base that has one"
            raise document.problem((key, MERGE), rule, key=f"camera.{key}.{MERGE}")
    return document


def _inline_base(document: Document, key: str, seen: tuple[Path, ...]) -> Document:
    if isinstance(document.data, str):
        document = Document({"base": document.data}, {(): document.place(()), ("base",): document.place(())})
        key_of_base = key
    else:
        key_of_base = f"{key}.base"
    if not isinstance(document.data, dict) or "base" not in document.data:
        return document
    base = document.data["base"]
    if not isinstance(base, str):
        raise document.problem(("base",), "give the name of a camera, such as sony_a7s2", f"{base}", key=key_of_base)
    path = find_config("cameras", base, document.place(("base",)), key_of_base)
    if path in seen:
        raise document.problem(("base",), "the camera is its own base; name another", base, key=key_of_base)
    over = remove_key(document, ("base",))
    if path.suffix.lower() in SUFFIXES:
        return _lay_over(read_emva_sheet(path, over.data), over)
    return _lay_over(_inline_base(read_document(path), key, (*seen, path)), over)


def _lay_over(base: Document, over: Document) -> Document:
    """Lay a camera on its base; the sources of the base's tables go with those that `over` replaces or removes."""
    base = _mark_response(base)
    sources = base.data.get("source")
    for key, table in over.data.items():
        is_gone = table is None or (is_table(table) and table.get(MERGE) is not True)
        if is_gone and isinstance(sources, dict):
            for names in sources:
                kept = [name for name in str(names).split(", ") if name.partition(".")[0] != key]
                if not kept:
                    base = remove_key(base, ("source", names))
    return merge(base, over)


def _mark_response(base: Document) -> Document:
    """Return a base whose places say of its response that one camera more is laid over it."""
    if "response" not in base.data:
        return base
    places = base.places | {("response",): base.place(("response",))}
    marked = {keys: replace(place, below=place.below + 1) for keys, place in places.items() if keys[:1] == ("response",)}
    return Document(base.data, places | marked)


def _drop_covered_response(camera: Document) -> Document:
    """Return a camera in which a file of curves replaces the base's response as a whole: scale and curves belong together."""
    response = camera.data.get("response") if isinstance(camera.data, dict) else None
    if not isinstance(response, dict) or response.get("file") is None:
        return camera
    own = camera.place(("response", "file")).below
    for key in response:
        if camera.place(("response", key)).below > own:
            camera = remove_key(camera, ("response", key))
    return camera


def settle_typical(camera: Document) -> Document:
    """Lay the stages of a camera over its typical ones where it says `typical: true`, and take both keys away.

    Raises PhotositeError for a camera that states none.
    """
    if not isinstance(camera.data, dict):
        return camera
    wanted = camera.data.get("typical")
    if wanted not in (None, False, True):
        raise camera.problem(("typical",), "give true or false", f"{wanted}", key="camera.typical")
    if wanted:
        if not isinstance(camera.data.get("typical_stages"), dict):
            rule = "this camera states no typical_stages; leave it out, or state them"
            raise camera.problem(("typical",), rule, "true", key="camera.typical")
        stages = select_section(camera, "typical_stages")
        own = select_section(camera, "stages") if isinstance(camera.data.get("stages"), dict) else None
        if own is not None:
            for stem in own.data.keys() & stages.data.keys() - {"source"}:
                stages = remove_key(stages, (stem,))
            stages = merge(stages, own)
        camera = replace_section(camera, "stages", stages)
    for key in ("typical", "typical_stages"):
        camera = remove_key(camera, (key,)) if key in camera.data else camera
    return camera


def inline_response(camera: Document) -> Document:
    """Replace `response: {file: name}` by the curves in that file, with the other keys laid over them.

    A file that was set since the camera was read, by an override or a sweep, replaces the base's response, too.
    Raises PhotositeError with file and line.
    """
    if not isinstance(camera.data, dict):
        return camera
    camera = _drop_covered_response(camera)
    if isinstance(camera.data.get("response"), str):
        rule = f"write `response: {{file: {camera.data['response']}}}`"
        raise camera.problem(("response",), rule, key="camera.response")
    response = select_section(camera, "response") if isinstance(camera.data.get("response"), dict) else None
    if response is None or "file" not in response.data:
        return camera
    file = response.data["file"]
    if not isinstance(file, str):
        raise response.problem(
            ("file",),
            "give a name in configs/responses, or the path of a YAML or CSV file",
            f"{file}",
            key="camera.response.file",
        )
    path = find_config("responses", file, response.place(("file",)), "camera.response.file")
    for key in ("wavelengths", "relative"):
        if key in response.data:
            rule = f"stands in {path.name}, too; leave one of them out (null removes what a base has)"
            raise response.problem((key,), rule, key=f"camera.response.{key}")
    curves = read_response_table(path) if path.suffix.lower() == ".csv" else read_document(path)
    return replace_section(camera, "response", merge(curves, remove_key(response, ("file",))))
