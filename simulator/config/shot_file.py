"""Read a shot from YAML: scene, lens, exposure, camera, seeds."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from functools import cache, partial, reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, get_type_hints

from pydantic import Discriminator, Field, Tag, create_model

from simulator.config.build import build, locate_error, validate
from simulator.config.camera_file import inline_camera, inline_response, make_camera_section, settle_typical, with_sources
from simulator.config.dataclass_sections import make_section, to_annotation, to_section
from simulator.config.document import Document, Place, read_document
from simulator.config.document_merge import named_file, parse_override, replace_section, replace_value, select_section
from simulator.config.lens_section import make_lens_field
from simulator.config.lensfun_section import resolve_lensfun
from simulator.config.messages import suggest_nearest
from simulator.config.prescription_section import resolve_prescription
from simulator.config.section_types import Section
from simulator.config.shot_text import describe_changed, is_same
from simulator.config.sweep_section import SweepSection
from simulator.errors import PhotositeError
from simulator.pipeline.shot import Shot
from simulator.scene.charts import ChartScene
from simulator.scene.deep import DeepScene
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene
from simulator.scene.spectral_cube import SpectralCubeScene
from simulator.units import key_of

Setting = tuple[str, object, Place]  # dotted key of a shot, value, and where it was written
CAMERA_KEYS = ("camera", "camera.base")  # keys that choose a camera, which replaces the whole section
# The key that decides which scene it is.
SCENES: dict[str, type] = {
    "image": ImageScene,
    "spectral_cube": SpectralCubeScene,
    "chart": ChartScene,
    "layers": LayeredScene,
    "deep": DeepScene,
}


@cache
def make_shot_section() -> type[Section]:
    """Return the model of a shot file: the fields of Shot, with the scene chosen by its key."""
    scenes: tuple[Any, ...] = tuple(Annotated[make_section(cls), Tag(f"<{cls.__name__}>")] for cls in SCENES.values())
    scene = (
        Annotated[reduce(or_, scenes), Discriminator(_find_scene_branch)],
        Field(description=f"what stands before the lens, told apart by its key: {', '.join(SCENES)}"),
    )
    members: dict[str, Any] = {
        "scene": scene,
        "lens": make_lens_field(),
        "camera": (make_camera_section(), Field(description="the camera body")),
    }
    hints = get_type_hints(Shot, include_extras=True)
    for field in fields(Shot):
        if field.name in ("scene", "lens", "camera") or not field.compare:
            continue
        default: dict[str, Any] = {} if field.default is MISSING else {"default_factory": partial(to_section, field.default)}
        text = (hints[field.name].__doc__ or "").partition("\n")[0] if is_dataclass(hints[field.name]) else None
        key = key_of(field.name, hints[field.name])
        members[field.name] = (to_annotation(hints[field.name]), Field(alias=key, description=text, **default))
    members["sweep"] = (SweepSection | None, Field(default=None, description="what to vary from point to point"))
    ordered = {name: members[name] for name in ("name", "scene", "lens", "exposure", "camera")}
    model = create_model("Shot", __base__=Section, __doc__="One photograph to take, or a sweep of them.", **ordered | members)
    model.assemble = lambda sweep, **values: Shot(**values)
    return model


def _find_scene_branch(value: object) -> str:
    if isinstance(value, Section):
        return f"<{type(value).__name__}>"
    key = next((key for key in SCENES if isinstance(value, dict) and key in value), "image")
    return f"<{SCENES[key].__name__}>"


def load_shot(path: str | Path, overrides: Iterable[str] | Mapping[str, object] = ()) -> Shot:
    """Read a shot file.

    path: of the file, or the name of one in configs/shots.
    overrides: `dotted.path=value` texts as the command line's --set takes them, or a mapping of dotted path to
        plain value; relative paths in them start from the current folder.
    Raises PhotositeError with file, line, key, value and fix. A `sweep:` section is checked, not run.
    """
    return build_shot(load_document(path, overrides))


def build_shot_from_data(data: Mapping[str, object], name: str, overrides: Mapping[str, object]) -> Shot:
    """Return the shot of a resolved configuration that another file holds.

    name: that file, for messages. overrides: plain values by dotted path. Raises PhotositeError.
    """
    return build_shot(apply_overrides(Document(data, {(): Place(name, Path.cwd())}), overrides))


@contextmanager
def locate_errors(path: str | Path, overrides: Iterable[str] | Mapping[str, object] = ()) -> Iterator[None]:
    """Add file and line to errors raised in the block that are about the value of a key of the shot file."""
    try:
        yield
    except PhotositeError as error:
        raise locate_error(error, load_document(path, overrides)) from error


def load_document(path: str | Path, overrides: Iterable[str] | Mapping[str, object] = ()) -> Document:
    """Return a shot file with its camera read in and the overrides applied, not yet validated; `path` as of `load_shot`."""
    path = named_file("shots", path)
    document = read_document(path)
    if {"shot", "versions"} <= document.data.keys():  # the sidecar of a frame: its shot can be taken again
        document = select_section(document, "shot")
        if not document.data:
            raise document.problem((), "the shot was made of objects in Python and stands in no file; run that program again")
    if "name" not in document.data:
        stem = re.sub(r"[^\w.+-]", "_", Path(path).stem)
        document = replace_section(document, "name", Document(stem, {(): document.place(())}))
    return apply_overrides(document, overrides)


def apply_overrides(document: Document, overrides: Iterable[str] | Mapping[str, object]) -> Document:
    """Return the document with its camera replaced by the full section, and values set by dotted path."""
    return apply_settings(document, parse_overrides(overrides))


def parse_overrides(overrides: Iterable[str] | Mapping[str, object]) -> list[Setting]:
    """Return the settings of overrides as `load_shot` takes them. Raises PhotositeError for a text that is none."""
    if isinstance(overrides, Mapping):
        return [(path, value, Place(f"--set {path}={value}", Path.cwd())) for path, value in overrides.items()]
    return [parse_override(text) for text in overrides]


def apply_settings(document: Document, items: Sequence[Setting]) -> Document:
    """Return the document with values set, each by its dotted path and with the place where it was written.

    Its camera is replaced by the full section. Another camera is chosen before single values of it are set.
    """
    for dotted, value, place in items:
        if dotted in CAMERA_KEYS:
            document = replace_value(document, "camera", value, place)
    if document.data.get("camera") is not None:
        document = replace_section(document, "camera", inline_camera(select_section(document, "camera")))
    for dotted, value, place in items:
        if dotted not in CAMERA_KEYS:
            document = replace_value(document, dotted, value, place)
    return document


def build_shot(document: Document) -> Shot:
    """Return the shot that a document states. Raises PhotositeError with file and line."""
    if isinstance(document.data.get("camera"), dict):
        document = replace_section(document, "camera", settle_typical(inline_response(select_section(document, "camera"))))
    _check_scene_keys(document)
    values: Any = validate(make_shot_section(), document)  # its fields are made at run time
    _check_name(values.name, document)
    resolve_lensfun(values, document)
    resolve_prescription(values, document)
    built: Shot = build(values, (), document)
    shot = replace(built, camera=with_sources(built.camera, document.data["camera"]))
    return replace(shot, origin=LoadedShot(shot, dump_resolved(values)))


@dataclass(frozen=True)
class LoadedShot:
    """A shot as it was read, and its full configuration, plain data."""

    shot: Shot
    text: dict[str, Any]

    def describe(self, shot: Shot) -> dict[str, Any]:
        """Return the full configuration of a shot made of this one by replacing parts; {} where no file can hold it."""
        names = [field.name for field in fields(Shot) if field.compare]
        if all(getattr(shot, name) is getattr(self.shot, name) for name in names):
            return self.text
        try:
            text = describe_changed(shot, self.shot, self.text, make_shot_section())
            again = build_shot(Document(text, {(): Place(shot.name, Path.cwd())}))
        except (TypeError, PhotositeError):
            return {}
        return again.resolved if is_same(again, shot) else {}


def dump_resolved(values: Section) -> dict[str, Any]:
    """Return the full configuration as plain data: defaults filled in, camera inlined, paths absolute; loads again."""
    return _plain(values.model_dump(by_alias=True, exclude_none=True, exclude={"sweep"}))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    return str(value) if isinstance(value, Path) else value


def _check_scene_keys(document: Document) -> None:
    scene = document.data.get("scene")
    if not isinstance(scene, dict):
        return
    given = [key for key in scene if key in SCENES]
    if len(given) > 1:
        raise document.problem(
            ("scene", given[1]), f"holds {' and '.join(given)}; keep one of {', '.join(SCENES)}", key="scene"
        )
    if not given:
        unknown = [key for key in scene if key not in ("illuminant", "luminance", "depth", "field_of_view")]
        hint = suggest_nearest(str(unknown[0]), list(SCENES)) if unknown else f"give one of {', '.join(SCENES)}"
        raise document.problem(("scene", *unknown[:1]), f"none of {', '.join(SCENES)} is there; {hint}", key="scene")


def _check_name(name: str, document: Document) -> None:
    if not re.fullmatch(r"[\w+-][\w.+ -]{0,199}", name):
        raise document.problem(("name",), "it names the files; use up to 200 letters, digits, _ + - .", name)
