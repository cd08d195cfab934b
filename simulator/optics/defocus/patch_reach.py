"""What can reach a patch of the frame, where blur circles span many patches.

Patch by patch the work grows with the fourth power of the radius. Here radii are put into classes; one class costs a few
passes over all patches, whatever its radius. A class counts as its largest radius and the disk as the square around it:
nothing is missed, a tile may see a little more than can reach it.
"""

from collections.abc import Iterator

import numpy as np

CLASSES_PER_OCTAVE = 2


def far_reaching(
    planes: dict[str, np.ndarray],
    join: dict[str, np.ufunc],
    found: dict[str, np.ndarray],
    reach_px: np.ndarray,
    largest_px: float,
    patch_px: tuple[int, int],
) -> None:
    """Join to `found`, for each patch with a reach, what it touches, and to all that it touches the patch itself.

    planes: by name, (patch rows, patch columns). join: minimum, maximum or bitwise_or of each. reach_px: of each patch, 0 for
        none. largest_px: that no patch of the scene exceeds. patch_px: rows and columns of a patch.
    """
    for reach, own in _classes(reach_px):
        around = [int(np.ceil(min(reach, largest_px) / size)) for size in patch_px]
        for name, plane in planes.items():
            widest = _windowed(plane, join[name], around)
            np.copyto(found[name], join[name](found[name], widest), where=own)
            kept = np.where(own, plane, _nothing(join[name], plane.dtype))
            found[name][...] = join[name](found[name], _windowed(kept, join[name], around))


def _classes(reach_px: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Largest reach of each class, and which patches are in it."""
    there = reach_px > 0
    steps = np.zeros(reach_px.shape, int)
    steps[there] = np.ceil(CLASSES_PER_OCTAVE * np.log2(reach_px[there])).astype(int)
    for step in np.unique(steps[there]):
        yield 2.0 ** (step / CLASSES_PER_OCTAVE), there & (steps == step)


def _nothing(join: np.ufunc, dtype: np.dtype) -> object:
    """What changes nothing when it is joined."""
    return dtype.type({np.minimum: np.inf, np.maximum: -np.inf, np.bitwise_or: 0}[join])


def _windowed(plane: np.ndarray, join: np.ufunc, around: list[int]) -> np.ndarray:
    """Join of all patches up to `around` (rows, columns) away, by doubling; beyond the border there is nothing."""
    for axis, reach in enumerate(around):
        padding = [(reach, reach) if side == axis else (0, 0) for side in (0, 1)]
        plane = np.pad(plane, padding, constant_values=_nothing(join, plane.dtype))
        count, width = 1, 2 * reach + 1
        while 2 * count <= width:
            plane = join(_part(plane, axis, 0, count), _part(plane, axis, count, 0))
            count *= 2
        if count < width:
            plane = join(_part(plane, axis, 0, width - count), _part(plane, axis, width - count, 0))
    return plane


def _part(plane: np.ndarray, axis: int, start: int, cut: int) -> np.ndarray:
    """Without so many at the start and the end of an axis."""
    part = slice(start, plane.shape[axis] - cut)
    return plane[part] if axis == 0 else plane[:, part]
