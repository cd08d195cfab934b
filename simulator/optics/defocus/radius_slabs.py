"""Blocks of a blurred frame that need points of the aperture, and the slabs of radius in which the points meet surfaces."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import CLASSES, Defocus, Method, RadiusStatistics

EVEN_PX = 0.3  # a correction does not feel a surface's radius vary by so little, at Accuracy's MEASURED
EVEN_STEPS_PER_PX = 8  # radii that lie closer share a list


@dataclass(frozen=True)
class BlockChoice:
    """Blocks of all tiles; arrays of (block rows, block columns), some with the layers as first axis.

    wanted: whether it is computed. methods: of Method, CORRECTED or OCCLUSION where points are needed.
    largest_px: largest blur circle's radius that reaches the block.
    present: (layers, ...) classes of radii that occur around the block; 0 where the layer is hidden or absent.
    even_px: (layers, ...) the one radius around the block [photosites], NaN where there are several.
    """

    wanted: np.ndarray
    methods: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray
    even_px: np.ndarray

    def part(self, rows: slice, wanted: np.ndarray) -> "BlockChoice":
        """Rows of blocks, and which of them are wanted."""
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items()}
        return BlockChoice(**kept | {"wanted": wanted})

    def sampled(self) -> np.ndarray:
        """Wanted blocks that need points."""
        return self.wanted & np.isin(self.methods, (Method.CORRECTED, Method.OCCLUSION))


def even_radius(defocus: Defocus, seen: RadiusStatistics, methods: np.ndarray) -> np.ndarray:
    """Radius of a layer around each block whose points find a correction only and whose radius hardly changes, else NaN."""
    even = (methods == Method.CORRECTED) & (seen.greatest_px - seen.least_px <= EVEN_PX * min(defocus.accuracy.looser, 1.0))
    middle = np.rint(0.5 * (seen.least_px + seen.greatest_px) * EVEN_STEPS_PER_PX) / EVEN_STEPS_PER_PX
    return np.where(even, middle, np.nan).astype(np.float32)


@dataclass(frozen=True)
class SlabLists:
    """Slabs that blocks work through.

    slabs: (slabs, 5) float32 as kernels/occlusion.cl has them. first, count: (blocks,) each block's own.
    mapped: (blocks,) whether any of them reads a map of radii.
    """

    slabs: np.ndarray
    first: np.ndarray
    count: np.ndarray
    mapped: np.ndarray


def slab_lists(defocus: Defocus, present: np.ndarray, even_px: np.ndarray) -> SlabLists:
    """Slabs for blocks; blocks that hold the same share a list.

    present: (layers, blocks) uint64. even_px: (layers, blocks) float32, NaN for a layer of several radii.
    """
    even_px = np.stack(
        [px if np.ndim(own) else np.full_like(px, own) for own, px in zip(defocus.radii_px, even_px, strict=True)]
    )
    several = np.isnan(even_px)
    keys = np.concatenate([np.where(several, present, present > 0).astype(np.uint64), even_px.view(np.uint32)], dtype=np.uint64)
    _, first_of, index = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    lists = [_slabs(defocus, present[:, place], even_px[:, place]) for place in first_of]
    count = np.array([len(entries) for entries in lists], int)
    index, first = index.reshape(-1), np.concatenate([[0], np.cumsum(count)[:-1]])
    mapped = (several & (present > 0)).any(axis=0)
    slabs = np.array([slab for entries in lists for slab in entries], np.float32).reshape(-1, 5)
    return SlabLists(slabs, first[index], count[index], mapped)


def _slabs(defocus: Defocus, classes: np.ndarray, even_px: np.ndarray) -> list[tuple[float, ...]]:
    entries, maps = [], 0
    for layer, radius in enumerate(defocus.radii_px):
        if classes[layer] and not np.isnan(even_px[layer]):
            entries.append((layer, -1, *(float(even_px[layer]),) * 3))
        elif classes[layer]:
            held = int(classes[layer])
            held |= held >> 1  # with a phase of 0 to 1, a class lies in its own slab or the one before
            numbers = [bit for bit in range(CLASSES) if held >> bit & 1]
            entries += [(layer, maps, *(defocus.class_border_px(number + i) for i in range(3))) for number in numbers]
        maps += np.ndim(radius) > 0
    return sorted(entries, key=lambda slab: (slab[0], slab[2]))
