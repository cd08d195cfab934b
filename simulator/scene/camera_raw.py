"""Raw files of cameras, of which a reader of pictures finds the preview."""

import shlex
import struct
from pathlib import Path
from typing import BinaryIO

from simulator.errors import reading, require

SUFFIXES = frozenset(
    (
        ".3fr .arw .cr2 .cr3 .crw .dcr .dng .erf .fff .gpr .iiq .k25 .kdc .mef .mos .mrw .nef .nrw .orf .pef .raf .rw2 .rwl"
        " .sr2 .srf .srw .x3f"
    ).split()
)
TO_LINEAR_LIGHT = "--output linear_srgb --out {name}.exr"
_PHOTOMETRIC, _SUB_IFDS, _DNG_VERSION = 262, 330, 50706  # tags
_MOSAICS = 32803, 34892  # colour filter array (TIFF/EP) and linear raw (DNG 1.4, chapter 4) in the tag _PHOTOMETRIC
_MOST_IFDS = 16  # that are looked at; cameras write up to four


def refuse_raw(path: Path, key: str, options: str = TO_LINEAR_LIGHT) -> None:
    """Raise PhotositeError, which names `key`, for a raw file: by its suffix, or a TIFF that says so.

    options: of the `photosite develop` that the message tells, with {name} for the path without suffix.
    """
    with reading(path, "make the file readable", key=key), open(path, "rb") as file:
        is_raw = path.suffix.lower() in SUFFIXES or _is_raw_tiff(file)
    told = options.format(name=shlex.quote(str(path.with_suffix(""))))
    rule = "is a raw file of a camera, of which a preview would be read; for its light run"
    require(not is_raw, key, path, f"{rule} photosite develop {shlex.quote(str(path))} {told}".rstrip())


def _is_raw_tiff(file: BinaryIO) -> bool:
    """Whether an open file is a DNG, a CR2, or another TIFF that holds a mosaic, such as NEF and ARW do."""
    start = file.read(10)
    order = {b"II*\0": "<", b"MM\0*": ">"}.get(start[:4])
    if order is None:
        return False
    try:
        main = _directory(file, order, start[4:8])
        _, count, field = main.get(_SUB_IFDS, (0, 0, b""))
        if count > 1:
            file.seek(*struct.unpack(f"{order}I", field))
            field = file.read(4 * min(count, _MOST_IFDS))
        below = [_directory(file, order, field[first : first + 4]) for first in range(0, len(field), 4)]
    except struct.error:  # cut short: the reader of pictures tells
        return False
    kinds = [one[_PHOTOMETRIC][2][:2] for one in (main, *below) if _PHOTOMETRIC in one]
    is_mosaic = any(struct.unpack(f"{order}H", kind)[0] in _MOSAICS for kind in kinds)
    return is_mosaic or _DNG_VERSION in main or start[8:] == b"CR"


def _directory(file: BinaryIO, order: str, offset: bytes) -> dict[int, tuple[int, int, bytes]]:
    """Read the type, count and value, or its place, of each tag of a directory. Raises struct.error for a file cut short."""
    file.seek(*struct.unpack(f"{order}I", offset))
    (entries,) = struct.unpack(f"{order}H", file.read(2))
    found = (struct.unpack(f"{order}HHI4s", file.read(12)) for _ in range(entries))
    return {tag: (kind, count, value) for tag, kind, count, value in found}
