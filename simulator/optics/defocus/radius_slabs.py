"""Blocks that sample the aperture, and the slabs of blur radius into which surfaces are divided for it."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import CLASSES, Defocus, Method, RadiusStatistics

EVEN_PX = 0.3  # largest range of a surface's radius that a correction may ignore at the accuracy MEASURED [photosites]
EVEN_STEPS_PER_PX = 8  # resolution of constant radii [1 / photosite]; blocks of equal rounded radius share a list of slabs
SLAB_GROUP = 16  # slabs whose numbers of one kind stand side by side for kernels/slab_list.h


@dataclass(frozen=True)
class BlockChoice:
    """Blocks of all tiles; arrays of (block rows, block columns), some with the layers as first axis.

    computed: whether the block is computed.
    methods: values of Method: CORRECTED or OCCLUSION where the aperture is sampled, WIDE where wider photosites do it.
    largest_px: largest blur radius that reaches the block [photosites].
    present: (layers, ...) classes of radii that occur around the block; 0 where the layer is occluded or absent.
    even_px: (layers, ...) constant radius of the layer around the block [photosites]; NaN where the radius varies.
    """

    computed: np.ndarray
    methods: np.ndarray
    largest_px: np.ndarray
    present: np.ndarray
    even_px: np.ndarray

    def part(self, rows: slice, computed: np.ndarray) -> "BlockChoice":
        """Select rows of blocks, with a mask of those that are computed."""
        kept = {name: plane[..., rows, :] for name, plane in vars(self).items()}
        return BlockChoice(**kept | {"computed": computed})

    def sampled(self) -> np.ndarray:
        """Mask of the computed blocks that sample the aperture."""
        return self.computed & ((self.methods == Method.CORRECTED) | (self.methods == Method.OCCLUSION))

    def wide(self) -> np.ndarray:
        """Mask of the computed blocks that come from the blur on photosites twice as wide."""
        return self.computed & (self.methods == Method.WIDE)


def find_even_radius(defocus: Defocus, seen: RadiusStatistics, methods: np.ndarray) -> np.ndarray:
    """Find the constant radius of a layer around each block that needs a correction only; NaN where the radius varies."""
    even = (methods == Method.CORRECTED) & (seen.greatest_px - seen.least_px <= EVEN_PX * min(defocus.accuracy.looser, 1.0))
    middle = np.rint(0.5 * (seen.least_px + seen.greatest_px) * EVEN_STEPS_PER_PX) / EVEN_STEPS_PER_PX
    return np.where(even, middle, np.nan).astype(np.float32)


@dataclass(frozen=True)
class SlabLists:
    """Slabs of the blocks that sample the aperture.

    slabs: (slabs, 6) float32 as in kernels/occlusion.cl; the last of each list fills the rest of its group of SLAB_GROUP.
    first, count: (blocks,) range of each block's slabs. mapped: (blocks,) whether any slab of the block reads a radius map.
    """

    slabs: np.ndarray
    first: np.ndarray
    count: np.ndarray
    mapped: np.ndarray

    def in_groups(self) -> np.ndarray:
        """Slabs as kernels/slab_list.h reads them, (groups, 6, SLAB_GROUP) float32."""
        return np.ascontiguousarray(self.slabs.reshape(-1, SLAB_GROUP, 6).swapaxes(1, 2))


def make_slab_lists(defocus: Defocus, present: np.ndarray, even_px: np.ndarray) -> SlabLists:
    """List the slabs of each block; blocks with the same classes and radii share a list.

    present: (layers, blocks) uint64. even_px: (layers, blocks) float32, NaN for a layer of several radii.
    """
    even_px = np.stack(
        [px if np.ndim(own) else np.full_like(px, own) for own, px in zip(defocus.radii_px, even_px, strict=True)]
    )
    several = np.isnan(even_px)
    keys = np.concatenate([np.where(several, present, present > 0).astype(np.uint64), even_px.view(np.uint32)], dtype=np.uint64)
    _, first_of, index = np.unique(keys, axis=1, return_index=True, return_inverse=True)
    slabs, count = _slabs(defocus, present[:, first_of], even_px[:, first_of])
    filled = -(-count // SLAB_GROUP) * SLAB_GROUP
    index, first = index.reshape(-1), np.cumsum(filled) - filled
    place = np.minimum(np.arange(filled.sum()) - np.repeat(first, filled), np.repeat(count, filled) - 1)
    slabs = slabs[np.repeat(np.cumsum(count) - count, filled) + place]
    mapped = np.logical_or.reduce(several & (present > 0), axis=0)
    return SlabLists(slabs, first[index], count[index], mapped)


def _slabs(defocus: Defocus, classes: np.ndarray, even_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slabs of some lists, (slabs, 6) float32, list by list, nearest first; and the number of slabs of each list.

    classes, even_px: (layers, lists).
    """
    is_even, parts = ~np.isnan(even_px), defocus.slab_parts
    bits, one_before = (
        (held.T[..., None] >> np.arange(CLASSES, dtype=np.uint64) & np.uint64(1)).astype(bool)
        for held in (classes, classes >> np.uint64(1))
    )
    listed = np.repeat(bits, parts, axis=-1)
    listed[..., parts - 1 :: parts] |= (
        one_before  # slabs shift by a phase of 0 to 1, so that a class begins in the slab before its own
    )
    one = np.zeros_like(listed)  # a layer of constant radius is one slab
    one[..., 0] = classes.T > 0
    lists, layers, numbers = np.nonzero(np.where(is_even.T[..., None], one, listed))
    even = is_even[layers, lists]
    borders = defocus.slab_borders_px[numbers[:, None] + np.arange(3)]
    radii = np.where(even[:, None], even_px[layers, lists][:, None], borders)
    maps = np.cumsum([np.ndim(radius) > 0 for radius in defocus.radii_px]) - 1
    names = np.where(even, -1, [maps[layers], numbers // parts])
    slabs = np.column_stack([layers, names[0], radii, names[1]]).astype(np.float32)
    return slabs, np.bincount(lists, minlength=classes.shape[1])
