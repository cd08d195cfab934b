"""OpenEXR files whose pixels lie in the file as they are in memory: float32, one channel a part, tiles as wide as the picture.

OpenImageIO writes the same bytes, but copies the pixels several times: a frame of 12 megapixels takes four times as long.
Layout: "OpenEXR File Layout" (openexr.com), multi-part files: magic number and version, the parts' attributes in the order of
their names, a table of the places of all chunks, the chunks.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Protocol

import numpy as np

from simulator.raw.disk_arrays import give_back

LARGEST_INT = 2**31 - 1  # of an attribute that is a whole number
LONGEST_NAME = 31  # bytes of a name, unless a flag of the version says that there are longer ones
_MAGIC, _VERSION, _MULTI_PART = 20000630, 2, 1 << 12
_FLOAT = 2  # type of a channel
_CHUNK = struct.Struct("<6i")  # part, column and row of the tile, two levels, bytes of its pixels


class Plane(Protocol):
    """One picture of a file, such as a `PicturePart`."""

    @property
    def name(self) -> str:
        """Name of the part."""
        ...

    @property
    def pixels(self) -> np.ndarray:
        """(height, width, 1) float32."""
        ...

    @property
    def channels(self) -> tuple[str, ...]:
        """Name of the channel."""
        ...

    @property
    def attributes(self) -> dict[str, object]:
        """Metadata, and the compression."""
        ...

    @property
    def tile_rows(self) -> int:
        """Height of a tile."""
        ...


def is_plain(parts: Sequence[Plane]) -> bool:
    """Whether parts have the form that this module writes: several, not compressed, tiled, of one channel of float32 each."""
    return len(parts) > 1 and all(
        part.pixels.dtype == np.float32
        and part.pixels.shape[2] == len(part.channels) == 1
        and part.tile_rows > 0
        and part.attributes.get("compression") == "none"
        and all(0 < len(name.encode()) <= LONGEST_NAME for name in (part.name, *part.channels, *part.attributes))
        and all(isinstance(value, str | int | float) for value in part.attributes.values())
        for part in parts
    )


def exr_pieces(parts: Sequence[Plane], common: Mapping[str, str]) -> Iterator[bytes | memoryview]:
    """Yield the bytes of a file with these parts, in order; the pixels are not copied.

    parts: as `is_plain` asks. common: attributes of every part.
    """
    header = struct.pack("<2i", _MAGIC, _VERSION | _MULTI_PART)
    header += b"".join(_part_header(part, common) for part in parts) + b"\0"
    tiles = [(number, row, tile) for number, part in enumerate(parts) for row, tile in enumerate(_tiles(part))]
    places, place = [], len(header) + 8 * len(tiles)
    for _, _, tile in tiles:
        places.append(place)
        place += _CHUNK.size + tile.nbytes
    yield header
    yield struct.pack(f"<{len(places)}Q", *places)
    for number, row, tile in tiles:
        yield _CHUNK.pack(number, 0, row, 0, 0, tile.nbytes)
        yield tile.data.cast("B")
        give_back(tile)


def _tiles(part: Plane) -> list[np.ndarray]:
    """Return the rows of each tile, little-endian."""
    rows = np.ascontiguousarray(part.pixels[..., 0]).astype("<f4", copy=False)
    return [rows[first : first + part.tile_rows] for first in range(0, len(rows), part.tile_rows)]


def _part_header(part: Plane, common: Mapping[str, str]) -> bytes:
    """Return the attributes of a part in the order of their names, and the zero byte that ends them."""
    height, width, _ = part.pixels.shape
    window = "box2i", struct.pack("<4i", 0, 0, width - 1, height - 1)
    channel = _text(part.channels[0]) + struct.pack("<iB3x2i", _FLOAT, 0, 1, 1) + b"\0"
    found = {
        "channels": ("chlist", channel),
        "chunkCount": _attribute(-(-height // part.tile_rows)),
        "compression": ("compression", b"\0"),
        "dataWindow": window,
        "displayWindow": window,
        "lineOrder": ("lineOrder", b"\0"),
        "name": _attribute(part.name),
        "pixelAspectRatio": _attribute(1.0),
        "screenWindowCenter": ("v2f", struct.pack("<2f", 0.0, 0.0)),
        "screenWindowWidth": _attribute(1.0),
        "tiles": ("tiledesc", struct.pack("<2IB", width, min(part.tile_rows, height), 0)),
        "type": _attribute("tiledimage"),
    }
    own = {**common, **part.attributes}
    found |= {name: _attribute(value) for name, value in own.items() if name != "compression"}
    lines = (_text(name) + _text(kind) + struct.pack("<i", len(value)) + value for name, (kind, value) in sorted(found.items()))
    return b"".join(lines) + b"\0"


def _attribute(value: object) -> tuple[str, bytes]:
    """Return type and bytes of an attribute: text, whole number or number."""
    if isinstance(value, str):
        return "string", value.encode()
    return ("int", struct.pack("<i", value)) if isinstance(value, int) else ("float", struct.pack("<f", value))


def _text(name: str) -> bytes:
    return name.encode() + b"\0"
