"""Files that a camera or a shot is read from."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from simulator.config.camera_file import inline_response, read_camera_document
from simulator.config.document import Document
from simulator.config.document_merge import select_section
from simulator.config.shot_file import build_shot, load_document
from simulator.pipeline.input_files import files_of_parts


def camera_files(name: str, overrides: Iterable[str] = ()) -> Iterator[Path]:
    """Yield the files of a camera as of `load_camera`: its own, its bases and its response. Raises PhotositeError."""
    yield from _written_in(read_camera_document(name, overrides))


def shot_files(path: str | Path, overrides: Iterable[str] = ()) -> Iterator[Path]:
    """Yield the files of a shot as of `load_shot`: its own, those of its camera, and those that its sections lead to.

    Raises PhotositeError.
    """
    document = load_document(path, overrides)
    shot = build_shot(document)
    yield from _written_in(document)
    yield from _written_in(inline_response(select_section(document, "camera")))
    yield from (file for _, file in files_of_parts(shot.scene, shot.lens, shot.motion))


def _written_in(document: Document) -> Iterator[Path]:
    """Yield the files in which the values of a document were written."""
    yield from map(Path, dict.fromkeys(place.file for place in document.places.values() if not place.file.startswith("--")))
