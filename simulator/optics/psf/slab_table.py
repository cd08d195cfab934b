"""Table of the kernels by distance of all slabs and nodes, as kernels/psf_slabs.cl and kernels/psf_own_slabs.cl read it."""

import itertools
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

CHUNK_TAPS = 8  # that are gathered at a time
MOST_HELD = 1 << 28  # bytes of the table up to which all of it is held


@dataclass(frozen=True)
class SlabKernels:
    """Weights for kernels/psf_slabs.cl and kernels/psf_tail.cl.

    radii_px: signed blur radii of the slabs, ascending [photosites]. starts: number of the first slab of the surface of each.
    nodes: rows and columns. mirrors: whether nodes have mirror images of the kernels of those in the first quarter.
    cores: (halves, channels, taps, taps) float32 by slab, node row and column, but for mirror images; the second half is for
        highlights.
    rings: (slabs, node rows, node columns) whether light of highlights needs it.
    tail: (1, 1, channels, cells, cells) float32. cell_px: photosites across its cells.
    light: (channels,) float32, sum of each core; the rest is the tail's.
    """

    radii_px: np.ndarray
    starts: np.ndarray
    nodes: tuple[int, int]
    mirrors: bool
    cores: dict[tuple[int, int, int], np.ndarray]
    tail: np.ndarray
    cell_px: int
    light: np.ndarray
    rings: np.ndarray

    @cached_property
    def reach_px(self) -> np.ndarray:
        """Photosites to either side of each core, (slabs, node columns)."""
        found = np.zeros((len(self.radii_px), self.nodes[1]), int)
        for (number, row, column), core in self.cores.items():
            for across in self._mirrored(row, column)[1]:
                found[number, across] = max(found[number, across], core.shape[-1] // 2)
        return found

    @cached_property
    def first(self) -> np.ndarray:
        """First element of each core in its line, (slabs, node columns)."""
        return np.asarray(np.cumsum(self._sizes).reshape(self._sizes.shape) - self._sizes)

    @property
    def elements(self) -> int:
        """Elements of a line."""
        return int(self._sizes.sum())

    def lines(self, rows: slice) -> tuple[np.ndarray, int]:
        """Kernels of some node rows at least, (halves, rows, elements) float32, and the first of the rows.

        A core lies in its line as (channels, taps, row_taps(reach)). All rows are one array where they are few.
        """
        if 4 * len(self._some_core) * self.nodes[0] * self.elements <= MOST_HELD:
            return self._every, 0
        return self._of_rows(rows), rows.start

    @cached_property
    def _every(self) -> np.ndarray:
        return self._of_rows(slice(0, self.nodes[0]))

    def _of_rows(self, rows: slice) -> np.ndarray:
        """`lines` of these node rows alone."""
        found = np.zeros((len(self._some_core), rows.stop - rows.start, self.elements), np.float32)
        reaches_px, taps_of_row = self.reach_px.tolist(), row_taps(self.reach_px).tolist()
        for (number, row, column), core in self.cores.items():
            for down, across in itertools.product(*self._mirrored(row, column)):
                if not rows.start <= down < rows.stop:
                    continue
                reach_px, taps = reaches_px[number][across], core.shape[-1]
                shape, spare = (*core.shape[:2], 2 * reach_px + 1, taps_of_row[number][across]), reach_px - taps // 2
                begin = int(self.first[number, across])
                held = found[:, down - rows.start, begin : begin + math.prod(shape[1:])].reshape(shape)
                turned = core[:, :, :: 1 if down == row else -1, :: 1 if across == column else -1]
                held[:, :, spare : spare + taps, 1 + spare : 1 + spare + taps] = turned
        return found

    @property
    def _some_core(self) -> np.ndarray:
        return next(iter(self.cores.values()))

    @cached_property
    def _sizes(self) -> np.ndarray:
        """Elements of each core, (slabs, node columns)."""
        return self._some_core.shape[1] * (2 * self.reach_px + 1) * row_taps(self.reach_px)

    def _mirrored(self, row: int, column: int) -> list[list[int]]:
        return mirrored_nodes((row, column), self.nodes, mirrors=self.mirrors)


def row_taps(reach_px: np.ndarray) -> np.ndarray:
    """Elements of a row of a core: a 0 and its taps, in whole chunks."""
    return np.asarray((2 * reach_px + 1 + CHUNK_TAPS) // CHUNK_TAPS * CHUNK_TAPS)


def mirrored_nodes(node: tuple[int, int], nodes: tuple[int, int], *, mirrors: bool) -> list[list[int]]:
    """Rows and columns of the nodes that have a node's kernel or a mirror image of it."""
    return [sorted({one, count - 1 - one} if mirrors else {one}) for one, count in zip(node, nodes, strict=True)]
