"""Picture files for the tests of sources, written with OpenImageIO or NumPy."""

from pathlib import Path

import numpy as np

from simulator.raw.picture import write_picture


def put(path: Path, pixels: np.ndarray, channels: tuple[str, ...] = (), **attributes) -> Path:
    """Write (height, width[, channels]) in its own type, making folders; .npy through NumPy. attributes: of OpenImageIO."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".npy":
        np.save(path, pixels)
    else:
        write_picture(path, pixels if pixels.ndim == 3 else pixels[..., None], channels, **attributes)
    return path


def random_codes(height=24, width=31, dtype=np.uint8, seed=1, channels=3) -> np.ndarray:
    """Codes of an integer type, even over its range."""
    return np.random.default_rng(seed).integers(0, np.iinfo(dtype).max, (height, width, channels), dtype, endpoint=True)
