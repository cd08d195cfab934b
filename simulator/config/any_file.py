"""Read a YAML file that is no shot into any frozen dataclass; cameras named in it are replaced by their full sections."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from simulator.config.build import build, validate
from simulator.config.camera_file import inline_camera, inline_response, settle_typical
from simulator.config.dataclass_sections import make_custom_section
from simulator.config.document import Document, read_document
from simulator.config.document_merge import parse_override, replace_section, replace_value, select_section
from simulator.config.shot_file import dump_resolved

Root = TypeVar("Root")


def load_file(cls: type[Root], path: str | Path, overrides: Iterable[str] = ()) -> Root:
    """Read a file whose keys are the fields of a frozen dataclass.

    cls: the dataclass; its field `resolved` is set to the full configuration, plain data, which loads again.
    overrides: `dotted.path=value` texts as the command line's --set takes them.
    A key `camera`, at any depth, takes what a shot's does. A section `cameras` holds one section by name for each
    camera; `camera` inside it may be left out where that name is one of configs/cameras.
    Raises PhotositeError with file, line, key, value and fix.
    """
    document, items = read_document(path), [parse_override(text) for text in overrides]
    # Another camera is chosen before single values of it are set.
    chosen = [item for item in items if item[0].rpartition(".")[2] in ("camera", "base")]
    for group in (chosen, [item for item in items if item not in chosen]):
        for dotted, value, place in group:
            document = replace_value(document, dotted, value, place)
        document = _inline_cameras(document)
    document = _settle_cameras(document)
    values = validate(make_custom_section(cls, leave_out=frozenset(["resolved"])), document)
    return replace(build(values, (), document), resolved=dump_resolved(values))


def _inline_cameras(document: Document) -> Document:
    """Replace every camera of a document, at any depth, by its full section."""
    if not isinstance(document.data, dict):
        return document
    for key, value in document.data.items():
        inner = select_section(document, key)
        if key == "camera" and value is not None:
            inner = inline_response(inline_camera(inner))
        elif key == "cameras" and isinstance(value, dict):
            for name in value:
                inner = replace_section(inner, name, _inline_cameras(_state_camera(select_section(inner, name), name)))
        else:
            inner = _inline_cameras(inner)
        document = replace_section(document, key, inner)
    return document


def _settle_cameras(document: Document) -> Document:
    """Give every camera of a document, at any depth, the stages that it asks for with `typical`."""
    if not isinstance(document.data, dict):
        return document
    for key in document.data:
        inner = select_section(document, key)
        document = replace_section(document, key, settle_typical(inner) if key == "camera" else _settle_cameras(inner))
    return document


def _state_camera(choice: Document, name: object) -> Document:
    """Add the key `camera` with the section's own name to a section of `cameras` that lacks it."""
    if choice.data is None:
        choice = Document({}, {(): choice.place(())})
    if not isinstance(choice.data, dict) or "camera" in choice.data:
        return choice
    return replace_section(choice, "camera", Document(str(name), {(): choice.place(())}))
