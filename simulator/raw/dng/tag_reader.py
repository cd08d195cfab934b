"""Reading of a single tag from any TIFF or DNG file (TIFF 6.0, section 2)."""

import os
import struct
from typing import BinaryIO

from simulator.errors import PhotositeError, check_file, reading
from simulator.raw.dng.tags import FieldType

_TYPE_BYTES = {
    FieldType.BYTE: 1,
    FieldType.ASCII: 1,
    FieldType.SHORT: 2,
    FieldType.LONG: 4,
    FieldType.RATIONAL: 8,
    FieldType.SBYTE: 1,
    FieldType.UNDEFINED: 1,
    FieldType.SSHORT: 2,
    FieldType.SLONG: 4,
    FieldType.SRATIONAL: 8,
    FieldType.FLOAT: 4,
    FieldType.DOUBLE: 8,
    FieldType.IFD: 4,
}


def read_tag(path: str | os.PathLike[str], code: int) -> bytes | None:
    """Return the bytes of a tag's value in IFD 0, in the file's byte order; None when the tag is missing.

    Raises PhotositeError for a file that cannot be read, is not a TIFF or DNG, or is truncated.
    """
    check_file(path)
    with reading(path, "give a DNG file"):
        try:
            with open(path, "rb") as file:
                return _value(file, code)
        except struct.error:
            raise PhotositeError("not a DNG, or cut short; give a DNG file", file=path) from None


def _value(file: BinaryIO, code: int) -> bytes | None:
    """Read a tag's value from an open file. Raises struct.error for a truncated file."""
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(file.read(4))
    if order is None:
        raise struct.error
    file.seek(*struct.unpack(f"{order}I", file.read(4)))
    (entries,) = struct.unpack(f"{order}H", file.read(2))
    for _ in range(entries):
        found, kind, count, field = struct.unpack(f"{order}HHI4s", file.read(12))
        if found == code:
            size = count * _TYPE_BYTES.get(kind, 1)
            if size <= 4:
                return field[:size]
            (offset,) = struct.unpack(f"{order}I", field)
            if offset + size > os.fstat(file.fileno()).st_size:
                raise struct.error  # reading would first allocate memory of that size
            file.seek(offset)
            return file.read(size)
    return None
