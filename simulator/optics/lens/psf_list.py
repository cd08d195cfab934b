"""Lists of files of point spread functions: the lines of a CSV file, and the files that they name."""

import csv
import io
import os
from pathlib import Path

from simulator.errors import PhotositeError, reading

DAMAGED = "it is damaged or no PSF: write it again"


def read_lines(path: Path) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """Return the names of a list's columns, and number and cells by column of each line that is not empty.

    Raises PhotositeError for a file that cannot be read.
    """
    with reading(path, DAMAGED):
        rows = list(csv.reader(io.StringIO(decode_text(path.read_bytes()))))
    header = [name.strip() for name in rows[0]] if rows else []
    filled = [(number, row) for number, row in enumerate(rows[1:], 2) if any(word.strip() for word in row)]
    return header, [(number, dict(zip(header, map(str.strip, row), strict=False))) for number, row in filled]


def listed_file(path: Path, line: dict[str, str]) -> Path:
    """Return the file that a line of a list names, relative to the list."""
    return path.parent / line.get("file", "")


def listed_files(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Return the files that a list names, each once; none where the path is no list or cannot be read."""
    path = Path(path)
    if path.suffix.lower() != ".csv":
        return ()
    try:
        _, lines = read_lines(path)
    except PhotositeError:
        return ()
    named = [line for _, line in lines if line.get("file") and "\0" not in line["file"]]
    return tuple(dict.fromkeys(listed_file(path, line) for line in named))


def decode_text(data: bytes) -> str:
    """Return the text of a file in UTF-8 or, with a byte order mark, UTF-16; invalid bytes are replaced."""
    return data.decode("utf-16") if data[:2] in (b"\xff\xfe", b"\xfe\xff") else data.decode("utf-8", "replace")
