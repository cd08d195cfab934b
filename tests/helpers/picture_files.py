"""Picture files for the tests of sources, written with OpenImageIO or NumPy."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio

from simulator.raw.image_files import write_picture


def put(path: Path, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes: Any) -> Path:
    """Write (height, width[, channels]) in its own type, making folders; .npy through NumPy. attributes: of OpenImageIO."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, pixels)
    else:
        write_picture(path, pixels if pixels.ndim == 3 else pixels[..., None], channels, **attributes)
    return path


def random_codes(
    height: int = 24, width: int = 31, dtype: type[np.unsignedinteger[Any]] = np.uint8, seed: int = 1, channels: int = 3
) -> np.ndarray:
    """Codes of an integer type, even over its range."""
    return np.random.default_rng(seed).integers(0, np.iinfo(dtype).max, (height, width, channels), dtype, endpoint=True)


def write(
    path: Path,
    pixels: np.ndarray,
    names: Sequence[str] | None = None,
    window: tuple[int, int, int, int] | None = None,
    **attributes: Any,
) -> Path:
    """Write (height, width, channels) with OpenImageIO alone, in its own type, which may be float16; attributes of any type.

    window: x and y of the first pixel in the display window, and width and height of that; None: the pixels fill it.
    """
    pixels = np.asarray(pixels)
    kinds = {"uint8": oiio.UINT8, "uint16": oiio.UINT16, "float16": oiio.HALF, "float32": oiio.FLOAT}
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kinds[str(pixels.dtype)])
    if names:
        spec.channelnames = names
    if window is not None:
        spec.x, spec.y, spec.full_width, spec.full_height = window
    for name, value in attributes.items():
        spec.attribute(name, *value) if isinstance(value, tuple) else spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec) and output.write_image(pixels) and output.close(), output.geterror()
    return Path(path)


def write_exr(path: Path, pixels: np.ndarray) -> Path:
    """Write (height, width, channels) as float32, whatever it is."""
    return write(path, np.asarray(pixels, np.float32))
