"""A small picture of a frame, for contact sheets."""

from pathlib import Path

import numpy as np

from simulator.raw.development import develop, srgb_encoded, write_image
from simulator.raw.dng.writer import SMALLEST_SIDE_PX
from simulator.raw.raw_image import Raw

LONG_SIDE_PX = 320


def write_preview(raw: Raw, path: Path) -> bool:
    """Develop a frame and write it with a long side of LONG_SIDE_PX at most; False: it is too small to be developed.

    Pixels are means of linear light. Raises PhotositeError for a path that cannot be written.
    """
    if min(raw.dn.shape) < SMALLEST_SIDE_PX:
        return False
    linear = develop(raw, output="linear_srgb", half_size=max(raw.dn.shape) >= 2 * LONG_SIDE_PX).astype(np.float32) / 65535.0
    height, width = linear.shape[:2]
    scale = min(1.0, LONG_SIDE_PX / max(height, width))
    small = resized(resized(linear, max(1, round(height * scale)), 0), max(1, round(width * scale)), 1)
    write_image(path, np.rint(255.0 * srgb_encoded(small)).astype(np.uint8))
    return True


def resized(pixels: np.ndarray, length: int, axis: int) -> np.ndarray:
    """Return an array with `length` pixels along an axis, each the mean over the part of the old ones that it covers."""
    old = pixels.shape[axis]
    if length == old:
        return pixels
    moved = np.moveaxis(pixels, axis, 0)
    sums = np.concatenate([np.zeros_like(moved[:1], np.float64), np.cumsum(moved, axis=0, dtype=np.float64)])
    ends = np.linspace(0.0, old, length + 1)
    whole = np.minimum(ends.astype(int), old - 1)
    share = (ends - whole).reshape(-1, *[1] * (moved.ndim - 1))
    until = sums[whole] * (1.0 - share) + sums[whole + 1] * share
    return np.moveaxis(np.diff(until, axis=0) * (length / old), 0, axis)
