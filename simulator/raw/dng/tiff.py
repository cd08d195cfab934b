"""Writer for the subset of TIFF 6.0 that a DNG needs: directories of typed fields, then data, little-endian."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from simulator.errors import PhotositeError
from simulator.raw.dng.tags import FieldType, Tag

LARGEST_LONG = 2**32 - 1
LARGEST_FILE_BYTES = LARGEST_LONG  # TIFF offsets are 32 bits wide
LEAST_RATIONAL = 1 / LARGEST_FILE_BYTES  # above 0, since a denominator has 32 bits
INFINITE_RATIONAL = (2**32 - 1, 1)  # Exif 2.3, SubjectDistance: numerator FFFFFFFF means infinity
UNKNOWN_RATIONAL = (0, 0)  # Exif 2.3, LensSpecification
_HEADER_BYTES = 8
_DATA_ALIGNMENT = 16
_SIGNED_DENOMINATOR = 1_000_000


@dataclass(frozen=True)
class Field:
    """Content of a tag: type, count and bytes of its values."""

    type: FieldType
    count: int
    payload: bytes


@dataclass(frozen=True)
class Pointer:
    """LONG field with the offset of a directory or of data, which is known once the file is laid out."""

    part: str


Directory = Mapping[Tag, Field | Pointer]


def byte(*values: int) -> Field:
    """BYTE: 0 to 255."""
    return Field(FieldType.BYTE, len(values), bytes(values))


def packet(payload: bytes) -> Field:
    """BYTE: encoded text, such as XMP."""
    return Field(FieldType.BYTE, len(payload), payload)


def text(value: str) -> Field:
    """ASCII, ending in NUL. Letters beyond ASCII are written as UTF-8, as most readers expect."""
    if "\0" in value:
        raise PhotositeError(f"{value!r}: text in a TIFF file cannot hold a NUL character; remove it")
    try:
        payload = value.encode("utf-8") + b"\0"
    except UnicodeEncodeError as error:
        raise PhotositeError(f"{value!r}: text holds half a character ({error.reason}); write it anew") from None
    return Field(FieldType.ASCII, len(payload), payload)


def short(*values: int) -> Field:
    """SHORT: 0 to 65535."""
    return Field(FieldType.SHORT, len(values), struct.pack(f"<{len(values)}H", *values))


def long(*values: int) -> Field:
    """LONG: 0 to 2^32 - 1."""
    return Field(FieldType.LONG, len(values), struct.pack(f"<{len(values)}I", *values))


def rational(*values: float | tuple[int, int]) -> Field:
    """RATIONAL: numbers >= 0, or (numerator, denominator), which are not reduced."""
    pairs = [value if isinstance(value, tuple) else nearest_fraction(value) for value in values]
    return Field(FieldType.RATIONAL, len(pairs), b"".join(struct.pack("<2I", *pair) for pair in pairs))


def undefined(payload: bytes) -> Field:
    """UNDEFINED."""
    return Field(FieldType.UNDEFINED, len(payload), payload)


def signed_rational(*values: float) -> Field:
    """SRATIONAL, in millionths."""
    pairs = [struct.pack("<2i", round(float(value) * _SIGNED_DENOMINATOR), _SIGNED_DENOMINATOR) for value in values]
    return Field(FieldType.SRATIONAL, len(pairs), b"".join(pairs))


def double(*values: float) -> Field:
    """DOUBLE: IEEE 754, 64 bits."""
    return Field(FieldType.DOUBLE, len(values), struct.pack(f"<{len(values)}d", *values))


def nearest_fraction(value: float) -> tuple[int, int]:
    """Return the simplest fraction within about 1e-6 of value >= 0, both parts below 2^32: 0.008 gives (1, 125).

    A value between 0 and LEAST_RATIONAL becomes the nearer of the two.
    """
    value = float(value)
    if 0 < value < LEAST_RATIONAL:
        return (1, LARGEST_FILE_BYTES) if value >= LEAST_RATIONAL / 2 else (0, 1)
    if 0 < value < 1:
        denominator, numerator = nearest_fraction(1.0 / value)
        return numerator, denominator
    fraction = Fraction(value).limit_denominator(max(1, int(min(1e6, LARGEST_FILE_BYTES / max(value, 1.0)))))
    return fraction.numerator, fraction.denominator


def view_bytes(buffer: bytes | np.ndarray) -> memoryview:
    """Return a view of the bytes of a C-contiguous buffer, without a copy."""
    return memoryview(buffer) if isinstance(buffer, bytes) else buffer.data


def assemble(directories: Mapping[str, Directory], data: Mapping[str, bytes | np.ndarray]) -> list[bytes | memoryview]:
    """Lay out a TIFF file and return its pieces in file order, data without a copy.

    directories: by name; the first is IFD 0. No directory has a link to a next one.
    data: by name, C-contiguous, little-endian.
    """
    offsets, position = {}, _HEADER_BYTES
    for name, directory in directories.items():
        offsets[name] = position
        position += _directory_bytes(directory)
    for name, buffer in data.items():
        position += -position % _DATA_ALIGNMENT
        offsets[name] = position
        position += view_bytes(buffer).nbytes
    pieces: list[bytes | memoryview] = [b"II*\0" + struct.pack("<I", _HEADER_BYTES)]
    pieces += [_pack_directory(directory, offsets[name], offsets) for name, directory in directories.items()]
    written = sum(map(len, pieces))
    for name, buffer in data.items():
        view = view_bytes(buffer)
        pieces += [bytes(offsets[name] - written), view]
        written = offsets[name] + view.nbytes
    return pieces


def _directory_bytes(directory: Directory) -> int:
    """Size of a directory, including the values that do not fit into its entries."""
    return 6 + 12 * len(directory) + sum(_outside_bytes(field) for field in directory.values())


def _outside_bytes(field: Field | Pointer) -> int:
    """Bytes of a value after the directory: 0 for values of up to 4 bytes, else an even number."""
    size = 0 if isinstance(field, Pointer) else len(field.payload)
    return size + size % 2 if size > 4 else 0


def _pack_directory(directory: Directory, offset: int, offsets: Mapping[str, int]) -> bytes:
    """Encode one directory that starts at `offset`: entries in ascending order of the tags, then the long values."""
    entries, values = struct.pack("<H", len(directory)), b""
    values_offset = offset + 6 + 12 * len(directory)
    for code, field in sorted(directory.items()):
        field = long(offsets[field.part]) if isinstance(field, Pointer) else field
        entries += struct.pack("<HHI", code, field.type, field.count)
        if outside := _outside_bytes(field):
            entries += struct.pack("<I", values_offset + len(values))
            values += field.payload.ljust(outside, b"\0")
        else:
            entries += field.payload.ljust(4, b"\0")
    return entries + struct.pack("<I", 0) + values
