"""The tail of kernels by distance: what lies beyond their cores, on cells. It is that of one kernel for all.

Far from the rays light falls off alike.
"""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.kernel_split import fit_tail, gather_table
from simulator.optics.psf.visibility import Visibility

REACHES_PX = (3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 21, 24, 28, 32, 38, 44)  # photosites to either side of cores
TAIL_CORES_PX = (*range(4, 12), 12, 14, 16, 20, 24, 28, 32, 48, 64, 96, 128)  # photosites from which on tails are smooth
FARTHEST_TAIL_CORE_PX = 32  # of a tail beyond the reach of all cores


@dataclass(frozen=True)
class Keyed:
    """A PSF that is equal to another where all numbers are."""

    key: tuple[object, ...]
    psf: FieldPsf = field(compare=False)


@dataclass(frozen=True)
class SlabTail:
    """Tail of the kernel in focus on the axis.

    core_px: reach of the core from which on it is smooth. cells: (cells, cells) weights. spread: (photosites, photosites) what
    photosites gather with it on average over their places in a cell. within: light within the kernel, before normalisation.
    rest: (photosites, photosites) what the core is.
    """

    core_px: int
    cells: np.ndarray
    spread: np.ndarray
    within: float
    rest: np.ndarray

    @cached_property
    def beside_edge(self) -> tuple[np.ndarray, np.ndarray]:
        """What photosites see by mistake at each distance from the straight edge of a layer before light of 1, and should see.

        Two of (distances,). The tail has too much near its middle, of all light that cells have there. The core takes it away
        again, of a farther surface in proportion to how much of it the core sees.
        """
        away = np.arange(len(self.spread)) - len(self.spread) // 2
        inner = np.where(np.hypot(away[:, None], away) <= self.core_px + 0.5, self.spread, 0.0)
        tail, light = (np.cumsum(one.sum(axis=0))[: len(away) // 2 + 1] for one in (inner, self.rest + self.spread))
        return tail - inner.sum() * light, light

    def beyond(self, half_px: int) -> np.ndarray:
        """What is left of the core beyond so many photosites to either side, of the shape of `rest`."""
        found, away = self.rest.copy(), np.abs(np.arange(len(self.rest)) - len(self.rest) // 2)
        found[np.maximum(away[:, None], away[None, :]) <= half_px] = 0.0
        return found


def slab_tail(psf: FieldPsf, seen: Visibility, channel: int, cell_px: int) -> SlabTail:
    """Tail on cells of cell_px, from as near as its cells may show."""
    return _made_tail(Keyed((repr(psf.lens_psf), psf.sampling, psf.over), psf), seen, channel, cell_px)


@lru_cache(maxsize=16)
def _made_tail(of: Keyed, seen: Visibility, channel: int, cell_px: int) -> SlabTail:
    psf, focus = of.psf, of.psf.tail_kernel(cell_px)
    light = focus.cell_kernel(channel, 0.0, (0.0, 0.0))
    within = float(light.sum())
    table = gather_table(psf.sampling.phases(light / within, focus.cells, focus.pitch_um, 1, True))
    farthest_px = TAIL_CORES_PX[-1] if len(table) // 2 <= REACHES_PX[-1] else FARTHEST_TAIL_CORE_PX
    cores = [core_px for core_px in TAIL_CORES_PX if core_px <= farthest_px]
    tails = ((core_px, *fit_tail(table, core_px, cell_px)) for core_px in cores)
    for core_px, cells, spread in tails:
        average = spread.mean(axis=0)
        rest = np.pad(table, (len(average) - len(table)) // 2) - average
        tail = SlabTail(core_px, cells, average, within, rest)
        left = max(seen.error(one - average) for one in spread)
        if seen.has_layers:
            left = max(left, float(np.abs(tail.beside_edge[0]).max()))
        if core_px == farthest_px or left <= seen.allowed_dark:
            return tail
    raise AssertionError("the last core is taken")


def hidden_error(psf: FieldPsf, seen: Visibility) -> float:
    """Error of the tail beside edges of layers, as a share of the brightest light that is seen as clearly.

    seen: with the scene's darkest light.
    """
    assert psf.core is not None and psf.seen is not None  # it is gathered so
    channels = range(len(psf.fit_kernel(0.0).wavelengths_nm))
    tails = [slab_tail(psf, psf.seen, channel, psf.core.cell_px) for channel in channels]
    hidden = max(1.0 - seen.dark_e / max(seen.electrons, 1.0), 0.0)  # beyond what is seen
    return max(seen.in_the_dark(hidden, *tail.beside_edge) for tail in tails)
