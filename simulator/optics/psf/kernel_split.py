"""Splits a kernel into a near core on the samples of the light and a wide smooth tail on cells of 2 x 2 photosites.

The tail is what a gather on cells, read bilinearly between their centres, gives on average over the photosites of a cell. The
core is the kernel less that average, so that both together have the kernel's values near the photosite, and its sum. What is
left differs from photosite to photosite of a cell, and is the error.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

CELL = 2  # photosites across a cell
_NOISE = 3.3 * 0.29  # a photosite in a thousand exceeds 3.3 deviations; light that is even from 0 to 1 has a deviation of 0.29


@dataclass(frozen=True)
class Core:
    """How kernels are gathered.

    reach_px: photosites to either side. has_tail: whether a tail takes the light beyond; else the photosite itself does.
    error: predicted, as a share of the brightest light.
    """

    reach_px: int
    has_tail: bool
    error: float


@dataclass(frozen=True)
class SplitKernel:
    """Two kernels that together stand for one.

    core: (taps, taps) float64, weights of samples. tail: (cells, cells) float64, weights of cells; None: the core is all.
    error: of `visible_error`. largest: greatest difference from the kernel at any photosite.
    """

    core: np.ndarray
    tail: np.ndarray | None
    error: float
    largest: float


def gather_table(phases: np.ndarray) -> np.ndarray:
    """Weights of the light's samples around a photosite, (over * size, over * size), of kernels (over^2, size, size).

    The first sample belongs to the photosite size // 2 above and left of it.
    """
    over, size = math.isqrt(len(phases)), phases.shape[-1]
    split = phases.reshape(over, over, size, size)[:, :, ::-1, ::-1]
    return split.transpose(2, 0, 3, 1).reshape(over * size, over * size)


def visible_error(rest: np.ndarray) -> float:
    """Error that a difference of kernels (size, size) makes, as a share of the brightest light.

    The larger of that beside straight edges from 0 to 1, and of that exceeded by one photosite in a thousand where each has
    light of its own, even from 0 to 1.
    """
    edges = max(float(np.abs(np.cumsum(rest.sum(axis=axis))).max()) for axis in (0, 1))
    return max(edges, _NOISE * math.sqrt(float((rest * rest).sum())))


def split_kernel(table: np.ndarray, over: int, core_px: int) -> SplitKernel:
    """Split a gather table into a core of core_px photosites to either side and a tail of all that the table reaches.

    table: (over * size, over * size) of `gather_table`, size odd.
    """
    half = len(table) // over // 2
    if core_px >= half:
        return SplitKernel(table, None, 0.0, 0.0)
    tail_cells = tail_reach(half)
    average, each = _cell_shares(tail_cells)
    reach = average.shape[-1] // 2
    photosites = table.reshape(2 * half + 1, over, 2 * half + 1, over)
    places = np.arange(-half, half + 1)
    away = np.clip(np.hypot(places[:, None], places[None, :]) / (core_px + 0.5), 0.0, 1.0)
    smooth = np.pad(photosites.sum(axis=(1, 3)) * away * away * (3.0 - 2.0 * away), reach - half)
    inverse = np.linalg.pinv(average.T)
    tail = inverse @ smooth @ inverse.T
    full = np.pad(photosites, ((reach - half, reach - half), (0, 0), (reach - half, reach - half), (0, 0)))
    near = slice(reach - core_px, reach + core_px + 1)
    core = (full - (average.T @ tail @ average)[:, None, :, None] / over**2)[near, :, near]
    core[core_px, :, core_px] += (table.sum() - core.sum() - tail.sum()) / over**2
    full = full.sum(axis=(1, 3))
    full[near, near] -= core.sum(axis=(1, 3))
    rests = [full - down.T @ tail @ across for down in each for across in each]
    error, largest = max(map(visible_error, rests)), max(float(np.abs(rest).max()) for rest in rests)
    taps = over * (2 * core_px + 1)
    return SplitKernel(core.reshape(taps, taps), tail, error, largest)


def cut_kernel(table: np.ndarray, over: int, core_px: int) -> SplitKernel:
    """Cut a gather table to core_px photosites to either side; the light beyond goes to the photosite itself."""
    half = len(table) // over // 2
    if core_px >= half:
        return SplitKernel(table, None, 0.0, 0.0)
    first, last = over * (half - core_px), over * (half + core_px + 1)
    core = table[first:last, first:last].copy()
    own = slice(over * core_px, over * (core_px + 1))
    core[own, own] += (table.sum() - core.sum()) / over**2
    rest = table.copy()
    rest[first:last, first:last] -= core
    rest = rest.reshape(2 * half + 1, over, 2 * half + 1, over).sum(axis=(1, 3))
    return SplitKernel(core, None, visible_error(rest), float(np.abs(rest).max()))


def tail_reach(half_px: int) -> int:
    """Cells to either side of a tail that reaches half_px photosites."""
    return -(-half_px // CELL)


@lru_cache(maxsize=8)
def _cell_shares(tail_cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights that a photosite gives to the photosites around it through each cell of a tail.

    (cells, photosites) on average over the places in a cell, and (CELL, cells, photosites) for each place.
    """
    reach = CELL * (tail_cells + 2)
    found = np.zeros((CELL, 2 * tail_cells + 1, 2 * reach + 1))
    for place in range(CELL):
        offset = (place + 0.5) / CELL - 0.5
        low = math.floor(offset)
        for cell, share in ((low, 1.0 - (offset - low)), (low + 1, offset - low)):
            for number in range(2 * tail_cells + 1):
                first = CELL * (cell + number - tail_cells) - place + reach
                found[place, number, first : first + CELL] += share / CELL
    return found.mean(axis=0), found
