"""DNG files as other programs write them: tags of a file of ours changed, added or taken out."""

import struct
from collections.abc import Iterable
from typing import Any

from simulator.raw.dng import tiff

SUB_IFDS = 330
ENTRY_BYTES = 12
STRIPES = {33422: tiff.byte(0, 1, 2, 1)}  # CFAPattern: R G above B G, no Bayer pattern


def with_tags(content: bytes, changes: dict[Any, Any], without: Iterable[Any] = (), *, raw_directory: bool = True) -> bytes:
    """A little-endian DNG with a new directory at its end: of the mosaic, or IFD 0.

    changes: tag -> `simulator.raw.dng.tiff.Field`. without: tags to leave out. The old directory stays, unreferenced.
    """
    place = _pointer(content, 4, SUB_IFDS) if raw_directory else 4
    entries = {code: entry for code, entry in _entries(content, place).items() if code not in without}
    data = b"" if len(content) % 2 == 0 else b"\0"
    for code, field in changes.items():
        value = field.payload.ljust(4, b"\0")
        if len(value) > 4:
            value, data = struct.pack("<I", len(content) + len(data)), data + value + b"\0" * (len(value) % 2)
        entries[code] = struct.pack("<HHI", code, field.type, field.count) + value
    start = len(content) + len(data)
    directory = struct.pack("<H", len(entries)) + b"".join(entries[code] for code in sorted(entries)) + bytes(4)
    return content[:place] + struct.pack("<I", start) + content[place + 4 :] + data + directory


def _entries(content: bytes, place: int) -> dict[int, bytes]:
    """The entries of the directory whose offset stands at a place, by tag."""
    (start,) = struct.unpack_from("<I", content, place)
    (count,) = struct.unpack_from("<H", content, start)
    entries = (content[start + 2 + ENTRY_BYTES * n :][:ENTRY_BYTES] for n in range(count))
    return {struct.unpack_from("<H", entry)[0]: entry for entry in entries}


def _pointer(content: bytes, place: int, code: int) -> int:
    """Place of the offset that the tag `code` of a directory holds."""
    (start,) = struct.unpack_from("<I", content, place)
    return start + 2 + ENTRY_BYTES * list(_entries(content, place)).index(code) + 8
