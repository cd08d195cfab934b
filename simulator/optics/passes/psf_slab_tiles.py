"""Parts of tiles that gather by distance: which slabs of blur radius surround each, and the terms of their sums."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from simulator.optics.passes.psf_bands import HALF_TILE, STEP_PARTS, TILE_ROWS, PsfBand, join_within

EDGE_PX = 1.0  # difference in blur radius from which a slab occludes another
EVEN_PX = 0.75  # largest range of the blur radius around a part whose photosites take the kernels of their own radius
CUBIC = 4  # slabs that share the light of a radius
PARTIAL = np.uint64(1 << 63)  # bit of a layer that does not cover all
INTEGERS = ("core", "reach", "node_column", "layer", "front", "columns", "ends")
TERM = np.dtype([*((name, "u4") for name in INTEGERS), ("number", "f4")])


@dataclass(frozen=True)
class BandNodes:
    """Nodes of kernels around a band.

    present: (tiles, parts, node columns) whether a column of nodes has weight in a part of a tile.
    reach_px, first: of `SlabKernels`. rings: (slabs, node columns) whether any kernel rings in the rows beside the band.
    radii_px: of the slabs, ascending.
    starts: number of the first slab of the surface of each. finer: light is counted at so many blur radii in place of a slab's.
    """

    present: np.ndarray
    reach_px: np.ndarray
    first: np.ndarray
    rings: np.ndarray
    radii_px: np.ndarray
    starts: np.ndarray
    finer: int

    @cached_property
    def counted_px(self) -> np.ndarray:
        """Blur radii at which light is counted, ascending; those of the slabs are among them."""
        slabs = np.arange(len(self.radii_px))
        found = np.interp(np.arange(self.finer * slabs[-1] + 1) / self.finer, slabs, self.radii_px)
        found[:: self.finer] = self.radii_px
        return found

    def slabs(self, held: np.ndarray) -> np.ndarray:
        """Slabs that have a share of light that is counted at blur radii (..., radii): (..., slabs)."""
        found = held[..., :: self.finer].copy()
        between = held[..., 1:] & held[..., :-1]
        between |= held[..., :-1] & (np.arange(held.shape[-1] - 1) % self.finer > 0)
        cells = between.reshape(*held.shape[:-1], -1, self.finer).any(axis=-1)  # between a slab and the next
        for beyond in range(1 - CUBIC // 2, 1 + CUBIC // 2):
            into = slice(max(beyond, 0), min(cells.shape[-1] + beyond, found.shape[-1]))
            cell = slice(max(-beyond, 0), into.stop - beyond)
            found[..., into] |= cells[..., cell]
        return found

    def farthest(self, held: np.ndarray) -> np.ndarray:
        """Farthest reach of the kernels of light that is held (layers, tiles, parts, radii): (tiles, parts)."""
        return np.asarray((self.slabs(np.logical_or.reduce(held, axis=0)) * self._part_reach_px).max(axis=-1, initial=0))

    def has_ringing(self, held: np.ndarray) -> np.ndarray:
        """Whether kernels of light that is held, as of `farthest`, ring: (tiles, parts)."""
        if not self.rings.any():
            return np.zeros(self.present.shape[:2], bool)
        of_part = self._over_nodes(self.rings, np.logical_or)
        return np.asarray((self.slabs(np.logical_or.reduce(held, axis=0)) & of_part).any(axis=-1))

    @cached_property
    def _part_reach_px(self) -> np.ndarray:
        """Farthest reach of each slab's kernels in each part, (tiles, parts, slabs)."""
        return self._over_nodes(self.reach_px, np.maximum)

    def _over_nodes(self, values: np.ndarray, join: np.ufunc) -> np.ndarray:
        """Join values (slabs, node columns) of the nodes of each part, (tiles, parts, slabs)."""
        found = np.zeros((*self.present.shape[:2], len(values)), values.dtype)
        for present, of_column in zip(np.moveaxis(self.present, -1, 0), values.T, strict=True):
            join(found, np.where(present[..., None], of_column, values.dtype.type(0)), out=found)
        return found

    @property
    def occluding(self) -> np.ndarray:
        """How many slabs, counted from the nearest, occlude each: none of those that share the light of a radius with it."""
        apart = np.searchsorted(self.radii_px, self.radii_px - EDGE_PX + 1e-6)
        return np.minimum(apart, np.maximum(np.arange(len(apart)) - CUBIC + 1, self.starts))

    @property
    def history(self) -> int:
        """Most slabs from those that occlude one up to that one."""
        return int((np.arange(len(self.radii_px)) - self.occluding).max()) + 1


@dataclass(frozen=True)
class Surroundings:
    """Light around each part of each tile.

    held: (layers, tiles, parts, radii) whether a visible layer has light at a blur radius there. filled: (tiles, parts) whether
    layers cover all. reach_px: (tiles, parts) farthest reach of the kernels.
    """

    held: np.ndarray
    filled: np.ndarray
    reach_px: np.ndarray

    @classmethod
    def around(cls, band: PsfBand, bits: np.ndarray, nodes: BandNodes) -> Self:
        """Light that the kernels of each part reach. bits: (layers, rows, columns) of kernels/psf_slab_bits.cl."""
        found = cls._within(band, bits, nodes, int(nodes.reach_px.max()))
        for reach_px in np.unique(found.reach_px):
            near = cls._within(band, bits, nodes, int(reach_px))
            same = found.reach_px == reach_px
            held = np.where(same[..., None], near.held, found.held)
            found = replace(found, held=held, filled=np.where(same, near.filled, found.filled))
        return replace(found, reach_px=nodes.farthest(found.held))

    @classmethod
    def _within(cls, band: PsfBand, bits: np.ndarray, nodes: BandNodes, reach_px: int) -> Self:
        joined = [join_within(band, one, np.bitwise_or, reach_px, STEP_PARTS) for one in bits]
        held, is_open = [], np.ones(joined[0].shape, bool)
        numbers = np.arange(len(nodes.counted_px), dtype=np.uint64)
        for one in joined:
            radii = (one[..., None] >> numbers & np.uint64(1)).astype(bool) & is_open[..., None]
            held.append(radii)
            is_open = np.asarray(is_open & ~(radii.any(axis=-1) & (one & PARTIAL == 0)))
        every = np.stack(held)
        return cls(every, ~is_open, nodes.farthest(every))

    def is_even(self, nodes: BandNodes) -> np.ndarray:
        """Whether a part sees one surface whose radius hardly changes, (tiles, parts)."""
        any_layer = self.held.any(axis=0)
        least = np.where(any_layer, nodes.counted_px, np.inf).min(axis=-1)
        greatest = np.where(any_layer, nodes.counted_px, -np.inf).max(axis=-1)
        return (self.held.any(axis=-1).sum(axis=0) == 1) & self.filled & (greatest - least <= EVEN_PX)

    def inside(self, band: PsfBand, bits: np.ndarray, nodes: BandNodes) -> Self:
        """Light of the parts' own photosites, of layers that are visible around them."""
        own = self._within(band, bits, nodes, 0).held & self.held
        return replace(self, held=own, reach_px=nodes.farthest(own))


def make_slab_terms(
    band: PsfBand, around: Surroundings, selected: np.ndarray, nodes: BandNodes
) -> tuple[np.ndarray, np.ndarray]:
    """Arguments `tiles` and `terms` of kernels/psf_slabs.cl for selected parts (tiles, parts).

    Terms are ordered by layer, by slab from near to far, and by column of nodes.
    """
    tile, part = np.nonzero(selected)
    held = nodes.slabs(np.moveaxis(around.held[:, tile, part], 1, 0))
    present = nodes.present[tile, part]
    place, layer, slab, column = np.nonzero(held[..., None] & present[:, None, None, :])
    before = np.concatenate([np.zeros((*held.shape[:2], 1), int), np.cumsum(held, axis=-1)], axis=-1)
    terms = np.zeros(len(place), TERM)
    terms["core"], terms["reach"] = nodes.first[slab, column], nodes.reach_px[slab, column]
    terms["node_column"], terms["layer"] = column, layer
    terms["front"], terms["number"] = before[place, layer, nodes.occluding[slab]], slab
    terms["columns"] = present.sum(axis=1)[place]
    terms["ends"] = slab == held.shape[2] - 1 - held[..., ::-1].argmax(axis=-1)[place, layer]
    rows, columns = np.array(band.tiles).reshape(-1, 2)[tile].T
    count = np.bincount(place, minlength=len(tile))
    first = HALF_TILE * columns + HALF_TILE // STEP_PARTS * part
    tiles = np.stack([first, TILE_ROWS * rows, np.cumsum(count) - count, count], axis=-1).astype(np.uint32)
    return tiles, terms
