"""Writing and reading of picture files with OpenImageIO; every failure raises an error."""

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simulator.atomic_files import atomic_write, reserve, write_buffers
from simulator.errors import PhotositeError, check_file, first_line, reading
from simulator.raw.disk_arrays import in_blocks
from simulator.raw.plain_exr import exr_pieces, is_plain
from simulator.raw.software import software

if TYPE_CHECKING:
    import OpenImageIO

# OpenImageIO replaces an unknown name such as "float32" by its own default, which loses bits silently.
_FORMATS = {"uint8": "uint8", "uint16": "uint16", "float32": "float"}

# OpenImageIO 3.2.2 reports this after every TIFF without Exif data, whether the file is complete or not.
_HARMLESS = "failed TIFFWriteCustomDirectory() of the Exif data"


@dataclass(frozen=True)
class PicturePart:
    """One picture of a multi-part file.

    name: of the part. pixels, channels, attributes: as `write_picture` takes them.
    tile_rows: height of tiles that are as wide as the picture, in formats that have tiles; 0: single rows.
    """

    name: str
    pixels: np.ndarray
    channels: tuple[str, ...]
    attributes: dict[str, object] = field(default_factory=dict)
    tile_rows: int = 0


def write_picture(path: str | os.PathLike, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes: object) -> None:
    """Write an array; the file appears complete or not at all, and its bytes depend on the arguments alone.

    path: its suffix chooses the format. pixels: (height, width, channel) uint8, uint16 or float32, stored as such.
    channels: names, where the format has them. attributes: OpenImageIO metadata, for example compression="none".
    Raises PhotositeError when the file cannot be written.
    """
    with atomic_write(path) as temporary:
        put_picture(temporary, pixels, channels, **attributes)


def put_picture(path: Path, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes: object) -> None:
    """Write an array as `write_picture` does, directly to a path from `atomic_write`.

    Raises OSError, without the path, when the file cannot be written.
    """
    put_parts(path, [PicturePart("", pixels, channels, attributes)])


def put_parts(path: Path, parts: Sequence[PicturePart]) -> None:
    """Write pictures into one file, directly to a path from `atomic_write`.

    Several pictures make a multi-part file, which EXR and TIFF support.
    Raises OSError, without the path, when the file cannot be written.
    """
    if path.suffix == ".exr" and is_plain(parts):
        return write_buffers(path, exr_pieces(parts, {"Software": software()}))
    import OpenImageIO

    size_bytes = sum(part.pixels.nbytes for part in parts)
    reserve(path, size_bytes + size_bytes // 8 + 2**16)
    output = OpenImageIO.ImageOutput.create(str(path))
    if output is None:
        raise OSError(f"OpenImageIO cannot write {path.suffix or 'a file without suffix'}")
    specs = [_image_spec(part) for part in parts]
    done = output.open(str(path), specs[0]) if len(specs) == 1 else output.open(str(path), tuple(specs))
    for index, (spec, part) in enumerate(zip(specs, parts, strict=True)):
        done = done and (index == 0 or output.open(str(path), spec, "AppendSubimage"))
        done = done and _write_rows(output, spec, part.pixels)
    message = output.geterror()  # the PNG writer reports success and leaves its failure here
    done = output.close() and done
    message = (message or output.geterror()).strip().split("\n")[0]
    if not done or message not in ("", _HARMLESS):
        raise OSError(message.replace(str(path), "the file") or "OpenImageIO gives no reason")


def _write_rows(output: "OpenImageIO.ImageOutput", spec: "OpenImageIO.ImageSpec", pixels: np.ndarray) -> bool:
    """Write a picture block by block; returns whether all blocks were written."""
    first = 0
    for block in in_blocks(pixels, max(spec.tile_height, 1)):
        last, rows = first + len(block), np.ascontiguousarray(block)
        if spec.tile_width:
            done = output.write_tiles(0, spec.width, first, last, 0, 1, rows)
        else:
            done = output.write_scanlines(first, last, 0, rows)
        if not done:
            return False
        first = last
    return True


def _image_spec(part: PicturePart) -> "OpenImageIO.ImageSpec":
    """Make OpenImageIO's description of a part."""
    import OpenImageIO

    height, width, count = part.pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, count, _FORMATS[str(part.pixels.dtype)])
    if part.tile_rows:
        spec.tile_width, spec.tile_height = width, min(part.tile_rows, height)
    if part.channels:
        spec.channelnames = part.channels
    named = {"oiio:subimagename": part.name} if part.name else {}
    for name, value in {"Software": software(), "DateTime": "", **named, **part.attributes}.items():  # "": else the clock's
        spec.attribute(name, value)
    return spec


def read_parts(path: str | os.PathLike) -> Iterator[PicturePart]:
    """Yield the parts of a picture file as float32 (height, width, channel), without attributes.

    Raises PhotositeError when the file is missing, is not a picture, or ends early.
    """
    import OpenImageIO

    check_file(path)
    with reading(path, "the file is damaged or no picture: write or copy it again"):
        source = OpenImageIO.ImageInput.open(str(path))
        if source is None:
            raise PhotositeError(f"not a picture file: {first_line(OpenImageIO.geterror())}; check the path", file=path)
    index = 0
    try:
        while (part := _read_part(source, index, path)) is not None:
            yield part
            index += 1
    finally:
        source.close()


def _read_part(source: "OpenImageIO.ImageInput", index: int, path: str | os.PathLike) -> PicturePart | None:
    """Read one part of an open file; None behind the last one."""
    with reading(path, "the file is damaged: write or copy it again"):
        if not source.seek_subimage(index, 0):
            return None
        spec = source.spec()
        pixels = source.read_image(index, 0, 0, spec.nchannels, "float")
        message = source.geterror().strip()
        if pixels is None or message:
            raise PhotositeError(f"damaged or cut short: {first_line(message)}; write or copy it again", file=path)
        return PicturePart(spec.getattribute("oiio:subimagename") or "", pixels, tuple(spec.channelnames))
