"""Parts of tiles that gather by distance: which slabs of blur radius surround each, and the terms of their sums."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simulator.optics.passes.psf_bands import HALF_TILE, TILE_ROWS, PsfBand, join_within

EDGE_PX = 1.0  # difference in blur radius from which a slab occludes another
EVEN_PX = 0.75  # largest range of the slabs around a part whose photosites take the kernels of their own radius
HISTORY = 16  # most slabs within EDGE_PX
PARTIAL = np.uint64(1 << 63)  # bit of a layer that does not cover all
TERM = np.dtype(
    [(name, "u4") for name in ("pair", "node_column", "layer", "front", "columns", "ends")]
    + [(name, "f4") for name in ("radius", "rise", "fall")]
)


@dataclass(frozen=True)
class BandNodes:
    """Nodes of kernels around a band.

    rows: of nodes. present: (tiles, node columns) whether a column of nodes has weight in a tile.
    reach_px: (slabs, node columns) farthest reach of the kernels in these rows. radii_px: of the slabs, ascending.
    """

    rows: range
    present: np.ndarray
    reach_px: np.ndarray
    radii_px: np.ndarray

    def farthest(self, held: np.ndarray) -> np.ndarray:
        """Farthest reach of the kernels of slabs that are held (layers, tiles, parts, slabs): (tiles, parts)."""
        of_tile = (self.reach_px.T[None] * self.present[:, :, None]).max(axis=1)
        return np.asarray((held * of_tile[:, None, :]).max(axis=(0, -1), initial=0))


@dataclass(frozen=True)
class Surroundings:
    """Slabs around each part of each tile.

    held: (layers, tiles, parts, slabs) whether a visible layer has light of a slab there. filled: (tiles, parts) whether layers
    cover all. reach_px: (tiles, parts) farthest reach of the kernels.
    """

    held: np.ndarray
    filled: np.ndarray
    reach_px: np.ndarray

    @classmethod
    def around(cls, band: PsfBand, bits: np.ndarray, nodes: BandNodes, parts: int) -> Self:
        """Slabs that the kernels of each part reach. bits: (layers, rows, columns) of kernels/psf_slab_bits.cl."""
        found = cls._within(band, bits, nodes, parts, int(nodes.reach_px.max()))
        for reach_px in np.unique(found.reach_px):
            near = cls._within(band, bits, nodes, parts, int(reach_px))
            same = found.reach_px == reach_px
            held = np.where(same[..., None], near.held, found.held)
            found = replace(found, held=held, filled=np.where(same, near.filled, found.filled))
        return replace(found, reach_px=nodes.farthest(found.held))

    @classmethod
    def _within(cls, band: PsfBand, bits: np.ndarray, nodes: BandNodes, parts: int, reach_px: int) -> Self:
        joined = [join_within(band, one, np.bitwise_or, reach_px, parts) for one in bits]
        held, is_open = [], np.ones(joined[0].shape, bool)
        numbers = np.arange(len(nodes.radii_px), dtype=np.uint64)
        for one in joined:
            slabs = (one[..., None] >> numbers & np.uint64(1)).astype(bool) & is_open[..., None]
            held.append(slabs)
            is_open = np.asarray(is_open & ~(slabs.any(axis=-1) & (one & PARTIAL == 0)))
        every = np.stack(held)
        return cls(every, ~is_open, nodes.farthest(every))

    def is_even(self, nodes: BandNodes) -> np.ndarray:
        """Whether a part sees one surface whose radius hardly changes, (tiles, parts)."""
        any_layer = self.held.any(axis=0)
        least = np.where(any_layer, nodes.radii_px, np.inf).min(axis=-1)
        greatest = np.where(any_layer, nodes.radii_px, -np.inf).max(axis=-1)
        return (self.held.any(axis=-1).sum(axis=0) == 1) & self.filled & (greatest - least <= EVEN_PX)

    def inside(self, band: PsfBand, bits: np.ndarray, nodes: BandNodes) -> Self:
        """Slabs of the parts' own photosites, of layers that are visible around them."""
        own = self._within(band, bits, nodes, self.filled.shape[1], 0).held & self.held
        return replace(self, held=own, reach_px=nodes.farthest(own))


def make_slab_terms(
    band: PsfBand, around: Surroundings, selected: np.ndarray, nodes: BandNodes
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Arguments `tiles` and `terms` of kernels/psf_slabs.cl for selected parts (tiles, parts), and (pairs, 2) slab and column.

    Terms are ordered by layer, by slab from near to far, and by column of nodes.
    """
    radii_px, parts = nodes.radii_px, selected.shape[1]
    tile, part = np.nonzero(selected)
    held = np.moveaxis(around.held[:, tile, part], 1, 0)
    present = nodes.present[tile]
    place, layer, slab, column = np.nonzero(held[..., None] & present[:, None, None, :])
    before = np.concatenate([np.zeros((*held.shape[:2], 1), int), np.cumsum(held, axis=-1)], axis=-1)
    nearer = np.searchsorted(radii_px, radii_px - EDGE_PX + 1e-6)
    terms, below, above = np.zeros(len(place), TERM), np.r_[-np.inf, radii_px[:-1]], np.r_[radii_px[1:], np.inf]
    pairs, terms["pair"] = np.unique(np.stack([slab, column], axis=-1), axis=0, return_inverse=True)
    terms["node_column"], terms["layer"], terms["front"] = column, layer, before[place, layer, nearer[slab]]
    terms["columns"] = present.sum(axis=1)[place]
    terms["ends"] = slab == held.shape[2] - 1 - held[..., ::-1].argmax(axis=-1)[place, layer]
    terms["radius"], terms["rise"], terms["fall"] = (
        radii_px[slab],
        1.0 / (radii_px - below)[slab],
        1.0 / (above - radii_px)[slab],
    )
    rows, columns = np.array(band.tiles).reshape(-1, 2)[tile].T
    count = np.bincount(place, minlength=len(tile))
    first = HALF_TILE * columns + HALF_TILE // parts * part
    tiles = np.stack([first, TILE_ROWS * rows, np.cumsum(count) - count, count], axis=-1).astype(np.uint32)
    return tiles, terms, pairs
