"""A YAML file of another kind than a shot: any frozen dataclass, cameras inside it read in."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from simulator.config.build import build, validate
from simulator.config.camera_file import inline_camera, inline_response
from simulator.config.document import Document, read_document
from simulator.config.document_merge import parse_override, subdocument, with_section, with_value
from simulator.config.sections_of_dataclasses import section_with
from simulator.config.shot_file import resolved

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
            document = with_value(document, dotted, value, place)
        document = _with_cameras(document)
    values = validate(section_with(cls, leave_out=frozenset(["resolved"])), document)
    return replace(build(values, (), document), resolved=resolved(values))


def _with_cameras(document: Document) -> Document:
    """Read in every camera of a document."""
    if not isinstance(document.data, dict):
        return document
    for key, value in document.data.items():
        inner = subdocument(document, key)
        if key == "camera" and value is not None:
            inner = inline_response(inline_camera(inner))
        elif key == "cameras" and isinstance(value, dict):
            for name in value:
                inner = with_section(inner, name, _with_cameras(_named(subdocument(inner, name), name)))
        else:
            inner = _with_cameras(inner)
        document = with_section(document, key, inner)
    return document


def _named(choice: Document, name: object) -> Document:
    """Return a section of `cameras` that says which camera it is."""
    if choice.data is None:
        choice = Document({}, {(): choice.place(())})
    if not isinstance(choice.data, dict) or "camera" in choice.data:
        return choice
    return with_section(choice, "camera", Document(str(name), {(): choice.place(())}))
