"""For each pixel of a picture, the nearest one of some of its pixels."""

import math

import numpy as np

MOST_STEPS = 32  # pixels of reach up to which searching takes less time than SciPy's transform, without its import
_STRIP_PX = 2**14  # pixels that are searched at once, so that they stay in the cache


def nearest_pixels(places: np.ndarray, reach_px: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return row and column of the nearest of some pixels to each pixel, and its squared distance [px^2], all int32.

    Of those that are as near, it is the one with the least column, and of these that with the least row. Where the nearest one
    is farther than `reach_px`, it may be another one that is farther than that.
    places: (height, width) bool, of which one or more are set.
    """
    if reach_px > MOST_STEPS:
        return _by_transform(places)
    height, width = places.shape
    row_in_column, row = _nearest_in_column(places), np.arange(height)[:, None]
    rows, columns, squared = (np.empty(places.shape, np.int32) for _ in range(3))
    strip = max(_STRIP_PX // width, 1)
    for top in range(0, height, strip):
        own = slice(top, min(top + strip, height))
        columns[own], squared[own] = _nearest_in_rows(row_in_column[own] - row[own], math.floor(reach_px))
        rows[own] = np.take_along_axis(row_in_column[own], columns[own], axis=1)
    return np.clip(rows, 0, height - 1, out=rows), columns, squared


def _by_transform(places: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from scipy.ndimage import distance_transform_edt

    nearest = np.empty((2, *places.shape), np.int32)
    distance_transform_edt(~places, return_distances=False, return_indices=True, indices=nearest)
    height, width = places.shape
    down, right = nearest[0] - np.arange(height, dtype=np.int32)[:, None], nearest[1] - np.arange(width, dtype=np.int32)
    return nearest[0], nearest[1], down**2 + right**2


def _nearest_in_column(places: np.ndarray) -> np.ndarray:
    """Return the row of the nearest place in each pixel's column, (height, width) int32; far outside where it has none."""
    rows, outside = np.arange(len(places), dtype=np.int32)[:, None], np.int32(2 * sum(places.shape))
    above, below = np.where(places, rows, -outside), np.where(places, rows, outside)
    np.maximum.accumulate(above, axis=0, out=above)
    np.minimum.accumulate(below[::-1], axis=0, out=below[::-1])
    return np.where(rows - above <= below - rows, above, below)


def _nearest_in_rows(down_px: np.ndarray, reach_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the column in which the nearest place lies, and its squared distance, (rows, width) each.

    down_px: to the nearest place in the own column, (rows, width) int64.
    Numbers that hold the squared distance in their upper and the column in their lower bits are compared with those beside
    them in steps of one pixel: the n-th step adds 2 n - 1, and the squares up to n^2 are sums of these.
    """
    width = down_px.shape[1]
    bits = width.bit_length()
    found = (down_px**2 << bits) | np.arange(width)
    beside = np.empty_like(found)
    for step in range(1, min(reach_px, width - 1) + 1):
        np.add(found, (2 * step - 1) << bits, out=beside)
        np.minimum(found[:, 1:], beside[:, :-1], out=found[:, 1:])
        np.minimum(found[:, :-1], beside[:, 1:], out=found[:, :-1])
    return found & ((1 << bits) - 1), found >> bits
