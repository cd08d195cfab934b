"""Arrays to and from picture files through OpenImageIO, with every failure told."""

import os
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.raw import software
from simulator.raw.files import atomic_write, reserve

# OpenImageIO takes an unknown name such as "float32" for its own default, which loses bits without a word.
_FORMATS = {"uint8": "uint8", "uint16": "uint16", "float32": "float"}

# OpenImageIO 3.2.2 says this behind every TIFF that carries no Exif data, well written or not.
_HARMLESS = "failed TIFFWriteCustomDirectory() of the Exif data"


def write_picture(path: str | os.PathLike, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes) -> None:
    """Write an array; the file appears complete or not at all, and its bytes depend on the arguments alone.

    path: its suffix chooses the format. pixels: (height, width, channel) uint8, uint16 or float32, stored as such.
    channels: names, where the format has them. attributes: OpenImageIO metadata, for example compression="none".
    Raises PhotositeError when the file cannot be written.
    """
    with atomic_write(path) as temporary:
        put_picture(temporary, pixels, channels, **attributes)


def put_picture(path: Path, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes) -> None:
    """Write an array as `write_picture` does, straight to a path that `atomic_write` gave.

    Raises OSError, without the path, when the file cannot be written.
    """
    import OpenImageIO

    height, width, count = pixels.shape
    spec = OpenImageIO.ImageSpec(width, height, count, _FORMATS[str(pixels.dtype)])
    if channels:
        spec.channelnames = channels
    for name, value in {"Software": software(), "DateTime": "", **attributes}.items():  # "": else the clock's time
        spec.attribute(name, value)
    reserve(path, pixels.nbytes + pixels.nbytes // 8 + 2**16)
    output = OpenImageIO.ImageOutput.create(str(path))
    if output is None:
        raise OSError(f"OpenImageIO cannot write {path.suffix or 'a file without suffix'}")
    done = output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels))
    message = output.geterror()  # the PNG writer reports success and leaves its failure here
    done = output.close() and done
    message = (message or output.geterror()).strip().split("\n")[0]
    if not done or message not in ("", _HARMLESS):
        raise OSError(message.replace(str(path), "the file") or "OpenImageIO gives no reason")


def read_picture(path: str | os.PathLike) -> tuple[np.ndarray, tuple[str, ...]]:
    """Read a file as float32: (height, width, channel) and the channel names.

    Raises PhotositeError when the file is missing, is no picture, or ends early.
    """
    import OpenImageIO

    if not os.path.isfile(path):
        raise PhotositeError(f"{path}: no such file; check the path")
    source = OpenImageIO.ImageInput.open(str(path))
    if source is None:
        raise PhotositeError(f"{path}: not a picture file: {OpenImageIO.geterror().strip()}; check the path")
    channels = tuple(source.spec().channelnames)
    pixels = source.read_image("float")
    message = source.geterror().strip()
    source.close()
    if pixels is None or message:
        raise PhotositeError(f"{path}: damaged or cut short: {message}; write or copy it again")
    return pixels, channels
