"""Mean, minimum and maximum of the values in a window around each, as `scipy.ndimage` has them, bit for bit.

Importing that package takes a fifth of a second, as long as a small frame; these need NumPy alone.
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np

Beyond = Literal["reflect", "nearest"]  # values beyond the ends: d c b a | a b c d | d c b a, or a a a a | a b c d | d d d d
_PADDING: dict[Beyond, Literal["symmetric", "edge"]] = {"reflect": "symmetric", "nearest": "edge"}


def window_mean(values: np.ndarray, width: int, beyond: Beyond = "reflect", axes: Sequence[int] = (0, 1)) -> np.ndarray:
    """Return the mean over a window of so many values along each of the axes, of the type of `values`.

    The window of an even width has one value more before its middle than behind it. Sums of 64 bits run along an axis, one
    value in and one out at each step: their rounding errors are 1e-16 of the largest value for each step.
    """
    for axis in axes if width > 1 else ():
        values = window_mean_along(values, width, axis, beyond)
    return values


def window_mean_along(values: np.ndarray, width: int, axis: int, beyond: Beyond = "reflect") -> np.ndarray:
    """Return `window_mean` along one axis."""
    size, around = values.shape[axis], _padded(values.astype(np.float64, copy=False), width, axis, beyond)
    steps = np.empty(values.shape)
    steps[_part(axis, 0, 1)] = np.add.accumulate(around[_part(axis, 0, width)], axis=axis)[_part(axis, width - 1, 1)]
    np.subtract(around[_part(axis, width, size - 1)], around[_part(axis, 0, size - 1)], out=steps[_part(axis, 1, size - 1)])
    sums = np.add.accumulate(steps, axis=axis, out=steps)
    return np.divide(sums, width, out=sums).astype(values.dtype, copy=False)


def window_minimum(values: np.ndarray, width: int, beyond: Beyond = "reflect", axes: Sequence[int] = (0, 1)) -> np.ndarray:
    """Return the least value in a window as of `window_mean`."""
    return _extreme(np.minimum, values, width, beyond, axes)


def window_maximum(values: np.ndarray, width: int, beyond: Beyond = "reflect", axes: Sequence[int] = (0, 1)) -> np.ndarray:
    """Return the greatest value in a window as of `window_mean`."""
    return _extreme(np.maximum, values, width, beyond, axes)


def _extreme(join: np.ufunc, values: np.ndarray, width: int, beyond: Beyond, axes: Sequence[int]) -> np.ndarray:
    """Join the values in a window, which windows of powers of 2 cover: each is joined of two of half its width."""
    for axis in axes if width > 1 else ():
        size, values, covered = values.shape[axis], _padded(values, width, axis, beyond), 1
        while 2 * covered <= width:
            count = values.shape[axis] - covered
            values, covered = join(values[_part(axis, 0, count)], values[_part(axis, covered, count)]), 2 * covered
        values = join(values[_part(axis, 0, size)], values[_part(axis, width - covered, size)])
    return values


def _part(axis: int, first: int, count: int) -> tuple[slice, ...]:
    """Index of so many values along an axis."""
    return (*(slice(None),) * axis, slice(first, first + count))


def _padded(values: np.ndarray, width: int, axis: int, beyond: Beyond) -> np.ndarray:
    """Continue values along an axis by what a window around the first and the last one reaches."""
    before = width // 2
    sides = [(before, width - 1 - before) if place == axis else (0, 0) for place in range(values.ndim)]
    return np.pad(values, sides, mode=_PADDING[beyond])
