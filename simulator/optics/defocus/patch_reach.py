"""Merges the statistics of patches within reach of each other, where blur circles span many patches.

The cost of comparing pairs of patches grows with the fourth power of the radius. Here reaches are grouped into classes, and a
class costs a few passes over all patches, whatever its reach. A class counts as its largest reach and a disk as its bounding
square, so that no patch within reach is missed and a few beyond it are included.
"""

from collections.abc import Iterator, Mapping

import numpy as np

CLASSES_PER_OCTAVE = 2
_NEUTRAL: dict[np.ufunc, float] = {np.minimum: np.inf, np.maximum: -np.inf, np.bitwise_or: 0}


def merge_far_patches(
    planes: dict[str, np.ndarray],
    join: Mapping[str, np.ufunc],
    merged: dict[str, np.ndarray],
    reach_px: np.ndarray,
    largest_px: float,
    patch_px: tuple[int, int],
) -> None:
    """Merge into each patch the statistics of all patches within its own reach, and of all patches within whose reach it lies.

    planes: statistics by name, (patch rows, patch columns) each. join: minimum, maximum or bitwise_or, by name.
    merged: planes that are changed in place. reach_px: reach of each patch; 0: the patch is skipped.
    largest_px: greatest reach in the scene. patch_px: rows and columns of a patch.
    """
    for reach, own in _classes(reach_px):
        around = [int(np.ceil(min(reach, largest_px) / size)) for size in patch_px]
        for name, plane in planes.items():
            widest = _window_merge(plane, join[name], around)
            np.copyto(merged[name], join[name](merged[name], widest), where=own)
            kept = np.where(own, plane, _neutral(join[name], plane.dtype))
            merged[name][...] = join[name](merged[name], _window_merge(kept, join[name], around))


def _classes(reach_px: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield the largest reach of each class and the mask of its patches."""
    there = reach_px > 0
    steps = np.zeros(reach_px.shape, int)
    steps[there] = np.ceil(CLASSES_PER_OCTAVE * np.log2(reach_px[there])).astype(int)
    for step in np.unique(steps[there]):
        yield 2.0 ** (step / CLASSES_PER_OCTAVE), there & (steps == step)


def _neutral(join: np.ufunc, dtype: np.dtype) -> np.generic:
    """Neutral element of the merge."""
    return dtype.type(_NEUTRAL[join])


def _window_merge(plane: np.ndarray, join: np.ufunc, around: list[int]) -> np.ndarray:
    """Merge of all patches up to `around` (rows, columns) away, by doubling; the border is padded with the neutral element."""
    for axis, reach in enumerate(around):
        padding = [(reach, reach) if side == axis else (0, 0) for side in (0, 1)]
        plane = np.pad(plane, padding, constant_values=_neutral(join, plane.dtype))
        count, width = 1, 2 * reach + 1
        while 2 * count <= width:
            plane = join(_part(plane, axis, 0, count), _part(plane, axis, count, 0))
            count *= 2
        if count < width:
            plane = join(_part(plane, axis, 0, width - count), _part(plane, axis, width - count, 0))
    return plane


def _part(plane: np.ndarray, axis: int, start: int, cut: int) -> np.ndarray:
    """Plane without `start` elements at the start and `cut` at the end of an axis."""
    part = slice(start, plane.shape[axis] - cut)
    return plane[part] if axis == 0 else plane[:, part]
