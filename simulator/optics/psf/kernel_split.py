"""Splits a kernel into a near core on the samples of the light, arms along rows and columns, and a wide smooth tail on cells.

The tail is what a gather on cells, read bilinearly between their centres, gives on average over the photosites of a cell. The
core is the kernel less that average, so that all together have the kernel's values near the photosite, and its sum. Arms are a
row and a column of it that reach farther, since kernels that are cut at half a cycle per photosite ring along the axes. What is
left differs from photosite to photosite of a cell, and is the error.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

CELLS = (4, 2)  # photosites across the cells of a tail
TAIL_MARGIN_PX = 64  # photosites beside a tile that have no tail; cells are read there
_NOISE = 3.3 * 0.29  # a photosite in a thousand exceeds 3.3 deviations; light that is even from 0 to 1 has a deviation of 0.29


@dataclass(frozen=True)
class Core:
    """How kernels are gathered.

    reach_px: photosites to either side. arm_px: photosites to either side along the photosite's row and column; reach_px: no
    farther. cell_px: photosites across the cells of a tail that takes the light beyond; 0: the photosite itself does.
    error: predicted, as a share of the brightest light.
    """

    reach_px: int
    arm_px: int
    cell_px: int
    error: float

    @property
    def has_tail(self) -> bool:
        """Whether a tail takes the light beyond."""
        return self.cell_px > 0


@dataclass(frozen=True)
class SplitKernel:
    """Kernels that together stand for one.

    core: (taps, taps) float64, weights of samples. arms: (2, 2 arm_px + 1) weights of the photosite's row and of its column
    beyond the core, 0 within; None: there are none. tail: (cells, cells) float64, weights of cells; None: there is none.
    error: what they leave shows.
    """

    core: np.ndarray
    arms: np.ndarray | None
    tail: np.ndarray | None
    error: float


def gather_table(phases: np.ndarray) -> np.ndarray:
    """Weights of the light's samples around a photosite, (over * size, over * size), of kernels (over^2, size, size).

    The first sample belongs to the photosite size // 2 above and left of it.
    """
    over, size = math.isqrt(len(phases)), phases.shape[-1]
    split = phases.reshape(over, over, size, size)[:, :, ::-1, ::-1]
    return split.transpose(2, 0, 3, 1).reshape(over * size, over * size)


def visible_error(rest: np.ndarray) -> float:
    """Error that a difference of kernels (size, size) makes, as a share of the brightest light.

    The larger of that beside a bar of light 1 on 0 of any width, and of that exceeded by one photosite in a thousand where each
    has light of its own, even from 0 to 1.
    """
    bars = max(float(np.ptp(np.concatenate([[0.0], np.cumsum(rest.sum(axis=axis))]))) for axis in (0, 1))
    return max(bars, _NOISE * math.sqrt(float((rest * rest).sum())))


def split_kernel(
    table: np.ndarray,
    over: int,
    core_px: int,
    arm_px: int = 0,
    cell_px: int = 0,
    error_of: Callable[[np.ndarray], float] = visible_error,
    spread: np.ndarray | None = None,
) -> SplitKernel:
    """Split a gather table into a core of core_px photosites to either side, arms of arm_px, and a tail of all it reaches.

    table: (over * size, over * size) of `gather_table`, size odd. arm_px: with one sample per photosite; up to core_px: none.
    cell_px: photosites across the tail's cells; 0: no tail, and the light beyond goes to the photosite itself.
    error_of: what a difference of kernels (size, size) shows, as a share of the brightest light. spread: shares of light along
    an axis, (odd,), that the samples around one have of what lies in its part of a photosite; None: it has that alone.
    """
    half = len(table) // over // 2
    if core_px >= half:
        return SplitKernel(table, None, None, 0.0)
    photosites = table.reshape(2 * half + 1, over, 2 * half + 1, over)
    if cell_px:
        lit = None if spread is None else _lit_samples(2 * half + 1, over, tuple(spread.tolist()))
        seen = photosites.sum(axis=(1, 3)) if lit is None else lit @ table @ lit.T
        tail, by_tail = fit_tail(seen, core_px, cell_px)
    else:
        tail, by_tail = None, np.zeros((1, 2 * half + 1, 2 * half + 1))
    reach, average = by_tail.shape[-1] // 2, by_tail.mean(axis=0)
    beyond = reach - half
    full = np.pad(photosites, ((beyond, beyond), (0, 0), (beyond, beyond), (0, 0)))
    rest = full - average[:, None, :, None] / over**2
    whole = full.sum(axis=(1, 3))
    left = table.sum() - (0.0 if tail is None else tail.sum())
    near, middle = slice(reach - core_px, reach + core_px + 1), reach
    taken, arms = np.zeros(whole.shape), None
    if arm_px > core_px:
        along = slice(max(middle - arm_px, 0), middle + arm_px + 1)
        arms = np.stack([rest[middle, 0, :, 0], rest[:, 0, middle, 0]])
        arms[:, near] = 0.0
        arms = np.pad(arms, ((0, 0), (arm_px, arm_px)))[:, middle : middle + 2 * arm_px + 1]
        taken[middle, along], taken[along, middle] = arms[:, : taken[middle, along].size]
        left -= arms.sum()
    core = rest[near, :, near].copy()
    core[core_px, :, core_px] += (left - core.sum()) / over**2
    if spread is None:
        taken[near, near] += core.sum(axis=(1, 3))
        rests = whole - taken - by_tail
    else:
        full[near, :, near] -= core
        full -= taken[:, None, :, None]  # arms, of one sample per photosite
        lit = _lit_samples(len(whole), over, tuple(spread.tolist()))
        lit_photosites = lit.reshape(len(whole), -1, over).sum(axis=-1) / over
        rests = lit @ full.reshape(2 * [lit.shape[1]]) @ lit.T - lit_photosites @ by_tail @ lit_photosites.T
    taps = over * (2 * core_px + 1)
    return SplitKernel(core.reshape(taps, taps), arms, tail, max(map(error_of, rests)))


@lru_cache(maxsize=8)
def _lit_samples(count: int, over: int, spread: tuple[float, ...]) -> np.ndarray:
    """Light that samples along an axis have of so many photosites that are lit one by one, (photosites, samples) float64."""
    found, reach = np.zeros((count, count * over)), len(spread) // 2
    for photosite, part, (away, share) in itertools.product(range(count), range(over), enumerate(spread)):
        sample = photosite * over + part + away - reach
        if 0 <= sample < count * over:
            found[photosite, sample] += share
    return found


def fit_tail(kernel: np.ndarray, core_px: int, cell_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Weights of cells for a kernel on photosites (size, size) outside a core, and what photosites gather with them.

    Returns (cells, cells), and (places in a cell, photosites, photosites).
    """
    half = len(kernel) // 2
    average, each, inverse = _cell_shares(tail_reach(half, cell_px), cell_px)
    places = np.arange(-half, half + 1)
    away = np.clip(np.hypot(places[:, None], places[None, :]) / (core_px + 0.5), 0.0, 1.0)
    # A tail that rises slowly from the middle is smooth on its cells; the core takes what it leaves there.
    smooth = np.pad(kernel * away**4 * (5.0 - 4.0 * away), average.shape[-1] // 2 - half)
    tail = inverse @ smooth @ inverse.T
    return tail, np.array([down.T @ tail @ across for down in each for across in each])


def tail_reach(half_px: int, cell_px: int) -> int:
    """Cells to either side of a tail that reaches half_px photosites."""
    return -(-half_px // cell_px)


def farthest_tail_px(cell_px: int) -> int:
    """Photosites that a tail may reach to find its cells in the margin of a tile."""
    return cell_px * (TAIL_MARGIN_PX // cell_px - 1)


def fits_tail(half_px: int, cell_px: int) -> bool:
    """Whether a tail that reaches half_px photosites finds its cells in the margin of a tile."""
    return half_px <= farthest_tail_px(cell_px)


@lru_cache(maxsize=8)
def _cell_shares(tail_cells: int, cell_px: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weights that a photosite gives to the photosites around it through each cell of a tail.

    (cells, photosites) on average over the places in a cell, (cell_px, cells, photosites) for each place, and the inverse of
    the first, (cells, photosites).
    """
    reach = cell_px * (tail_cells + 2)
    found = np.zeros((cell_px, 2 * tail_cells + 1, 2 * reach + 1))
    for place in range(cell_px):
        offset = (place + 0.5) / cell_px - 0.5
        low = math.floor(offset)
        for cell, share in ((low, 1.0 - (offset - low)), (low + 1, offset - low)):
            for number in range(2 * tail_cells + 1):
                first = cell_px * (cell + number - tail_cells) - place + reach
                found[place, number, first : first + cell_px] += share / cell_px
    average = found.mean(axis=0)
    return average, found, np.linalg.pinv(average.T)
