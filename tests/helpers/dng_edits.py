"""DNG files as other programs write them: tags of a file of ours changed, added or taken out."""

import struct
from collections.abc import Iterable
from typing import Any

import numpy as np

from simulator.raw.dng import tiff
from simulator.raw.dng.tags import Tag

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


def linear_dng(samples: np.ndarray, black: tuple[int, int, int], white: int) -> bytes:
    """A DNG of three samples a pixel (LinearRaw), as converters write it: (height, width, 3) uint16, levels of each colour."""
    height, width, _ = samples.shape
    matrix = np.array([[0.7, -0.2, -0.1], [-0.4, 1.2, 0.2], [-0.05, 0.2, 0.6]])
    main = {
        Tag.NEW_SUBFILE_TYPE: tiff.long(0),
        Tag.IMAGE_WIDTH: tiff.long(width),
        Tag.IMAGE_LENGTH: tiff.long(height),
        Tag.BITS_PER_SAMPLE: tiff.short(16, 16, 16),
        Tag.COMPRESSION: tiff.short(1),
        Tag.PHOTOMETRIC_INTERPRETATION: tiff.short(34892),
        Tag.MAKE: tiff.text("Foo"),
        Tag.MODEL: tiff.text("Bar"),
        Tag.STRIP_OFFSETS: tiff.Pointer("samples"),
        Tag.SAMPLES_PER_PIXEL: tiff.short(3),
        Tag.ROWS_PER_STRIP: tiff.long(height),
        Tag.STRIP_BYTE_COUNTS: tiff.long(samples.nbytes),
        Tag.PLANAR_CONFIGURATION: tiff.short(1),
        Tag.DNG_VERSION: tiff.byte(1, 4, 0, 0),
        Tag.DNG_BACKWARD_VERSION: tiff.byte(1, 1, 0, 0),
        Tag.UNIQUE_CAMERA_MODEL: tiff.text("Foo Bar"),
        Tag.BLACK_LEVEL: tiff.short(*black),
        Tag.WHITE_LEVEL: tiff.short(white, white, white),
        Tag.COLOR_MATRIX_1: tiff.signed_rational(*matrix.ravel()),
        Tag.CALIBRATION_ILLUMINANT_1: tiff.short(21),
        Tag.AS_SHOT_NEUTRAL: tiff.rational(0.5, 1.0, 0.66),
    }
    return b"".join(tiff.assemble({"main": main}, {"samples": samples}))


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
