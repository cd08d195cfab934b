"""Kernels of a point spread function as the device gathers with them, for all nodes, channels and blur radii."""

from dataclasses import dataclass, field
from functools import cached_property, lru_cache

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.psf.field_psf import FieldPsf, correction_reach_px, farthest_correction_px
from simulator.optics.psf.kernel_split import Core, cut_kernel, gather_table, split_kernel, tail_reach
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil

CORES_PX = (*range(2, 18), 20, 22, 24, 28, 32)
TAIL_COST = 2.0  # of a tap on cells, in taps of a core: three colours on a quarter as many places, and margins
MOST_TAPS = 96  # samples across a core; more are cheaper by transforms
LARGEST_TAIL_CELLS = 31


@dataclass(frozen=True)
class GatherKernels:
    """Weights for kernels/psf_gather.cl and kernels/psf_tail.cl.

    radii_px: signed blur radii, ascending [photosites].
    core: (2, radii, node rows, node columns, channels, taps, taps) float32, for all light and without negative values.
    tail: (node rows, node columns, channels, cells, cells) float32; None: there is none.
    over: samples per photosite and axis. core_px: photosites that the core reaches.
    error: predicted, as a share of the brightest light. rings: whether highlights need the second half of `core`.
    """

    radii_px: tuple[float, ...]
    core: np.ndarray
    tail: np.ndarray | None
    over: int
    core_px: int
    error: float
    rings: bool

    @property
    def taps(self) -> int:
        """Samples across the core."""
        return self.core.shape[-1]

    @property
    def first(self) -> int:
        """Sample at which the taps begin, relative to the photosite's first sample."""
        return -self.over * self.core_px

    @property
    def tail_taps(self) -> int:
        """Cells across the tail; 0: there is none."""
        return 0 if self.tail is None else self.tail.shape[-1]

    @cached_property
    def nodes(self) -> tuple[int, int]:
        """Rows and columns of nodes."""
        return self.core.shape[2:4]


def fits_gather(psf: FieldPsf) -> bool:
    """Whether kernels are small enough for direct sums."""
    return tail_reach(psf.reach_px) <= LARGEST_TAIL_CELLS


def choose_core(psf: FieldPsf, channels: int, allowed: float, peak: float) -> Core | None:
    """Cheapest core and tail whose error is allowed, by the kernels in the middle of the sensor and in its corner.

    None where no core of up to MOST_TAPS samples is. peak: light of the brightest scene pixel on one photosite, in units of the
    brightest light.
    """
    return _chosen(_Keyed(psf.key, psf), channels, allowed, peak)


@lru_cache(maxsize=32)
def _chosen(of: "_Keyed", channels: int, allowed: float, peak: float) -> Core | None:
    psf = of.psf
    places = {(psf.nodes[0] // 2, psf.nodes[1] // 2), (0, 0)}
    tables = [gather_table(psf.kernel(0, channel, False, *place)) for place in places for channel in range(channels)]
    found: list[tuple[float, Core]] = []
    for has_tail, split, cost in (
        (True, split_kernel, TAIL_COST * (2 * tail_reach(psf.reach_px) + 1) ** 2),
        (False, cut_kernel, 0.0),
    ):
        for wanted_px in (*CORES_PX, psf.reach_px):
            reach_px = min(wanted_px, psf.reach_px)
            taps = psf.over * (2 * reach_px + 1)
            if taps > MOST_TAPS or (found and taps**2 + cost >= found[0][0]):
                break
            splits = [split(table, psf.over, reach_px) for table in tables]
            error = max(max(one.error, peak * one.largest) for one in splits)
            if error <= allowed:
                found = [(taps**2 + cost, Core(reach_px, has_tail and reach_px < psf.reach_px, error))]
                break
    return found[0][1] if found else None


def make_gather_kernels(psf: FieldPsf, channels: int) -> GatherKernels:
    """Kernels of a planned PSF of one blur radius."""
    assert psf.core is not None  # else it is convolved by transforms
    split, core_px = split_kernel if psf.core.has_tail else cut_kernel, psf.core.reach_px
    found = [
        [
            [
                split(_padded(psf.kernel(0, channel, False, row, column), psf.reach_px, psf.over), psf.over, core_px)
                for channel in range(channels)
            ]
            for column in range(psf.nodes[1])
        ]
        for row in range(psf.nodes[0])
    ]
    core = np.array([[[one.core for one in places] for places in row] for row in found])[None]
    tails = [[[one.tail for one in places] for places in row] for row in found]
    tail = None if found[0][0][0].tail is None else np.array(tails, np.float32)
    error = max(one.error for row in found for places in row for one in places)
    rings = any(psf.has_ringing(0, channel) for channel in range(channels))
    return GatherKernels((0.0,), positive_too(core), tail, psf.over, core_px, error, rings)


def _padded(phases: np.ndarray, reach_px: int, over: int) -> np.ndarray:
    """Gather table of kernels (over^2, size, size), all of the size of the largest."""
    return np.pad(gather_table(phases), over * (reach_px - phases.shape[-1] // 2))


def positive_too(core: np.ndarray) -> np.ndarray:
    """Join to cores (..., taps, taps) the same without negative values and with the same sum: (2, ..., taps, taps) float32."""
    kept = np.maximum(core, 0.0)
    sums = kept.sum(axis=(-2, -1), keepdims=True)
    scale = core.sum(axis=(-2, -1), keepdims=True) / np.where(sums > 0.0, sums, 1.0)
    return np.stack([core, kept * scale]).astype(np.float32)


@dataclass(frozen=True)
class _Keyed:
    """A PSF that is equal to another where all numbers are."""

    key: tuple[object, ...]
    psf: FieldPsf = field(compare=False)


@lru_cache(maxsize=8)
def _made(of: _Keyed, channels: int) -> GatherKernels:
    return make_gather_kernels(of.psf, channels)


def gather_kernels_of(psf: FieldPsf, channels: int) -> GatherKernels:
    """Kernels of a planned PSF; those of the last few are kept."""
    return _made(_Keyed((*psf.key, psf.core), psf), channels)


def corrections_of(psf: FieldPsf, channels: int) -> list[GatherKernels]:
    """Corrections of a geometric blur, followed by the kernel in focus, to wave optics; one for each size of kernels.

    Kernels have the sum 0: those of wave optics at a blur radius, less the image of the aperture convolved with the kernel in
    focus. They are gathered from the sharp light. Those of the last few PSFs are kept.
    """
    return _corrections(_Keyed((*psf.key, psf.corrected_px), psf), channels)


@lru_cache(maxsize=8)
def _corrections(of: _Keyed, channels: int) -> list[GatherKernels]:
    psf, found = of.psf, []
    sizes = [correction_reach_px(radius) for radius in psf.corrected_px]
    rings = any(psf.has_ringing(0, channel) for channel in range(channels))
    # A round pupil without aberrations has the same spot in front of the plane in focus and behind it.
    own = [abs(radius_px) if psf.pupil == Pupil() else radius_px for radius_px in psf.corrected_px]
    made = {radius_px: np.array([correction_core(psf, radius_px, c) for c in range(channels)]) for radius_px in set(own)}
    cores = [made[radius_px] for radius_px in own]
    for size in sorted(set(sizes)):
        # A weight falls to 0 at the neighbouring radius, also where that has kernels of another size: those are 0 here.
        held = [number for number in range(len(sizes)) if size in sizes[max(number - 1, 0) : number + 2]]
        taps = 2 * size + 1
        core = np.zeros((2, len(held), 1, 1, channels, taps, taps), np.float32)
        for place, number in enumerate(held):
            if sizes[number] == size:
                core[:, place, 0, 0] = cores[number].swapaxes(0, 1)
        found.append(GatherKernels(tuple(psf.corrected_px[number] for number in held), core, None, 1, size, 0.0, rings))
    return found


def correction_core(psf: FieldPsf, radius_px: float, channel: int) -> np.ndarray:
    """Kernels of one correction (2, taps, taps) float64: for all light, and for highlights from kernels without ringing."""
    from scipy.signal import fftconvolve

    size = correction_reach_px(radius_px)
    if not isinstance(psf.lens_psf, WavefrontPsf) or abs(radius_px) > farthest_correction_px(psf.lens_psf) + 1e-6:
        return np.zeros((2, 2 * size + 1, 2 * size + 1))
    wave, focus = psf.at_radius(radius_px), psf.at_radius(radius_px, in_focus=True)
    disk = aperture_weights(psf.pupil, radius_px)
    found = []
    for positive in (False, True):
        exact, blurred = (one.kernel(0, channel, positive, 0, 0)[0][::-1, ::-1] for one in (wave, focus))
        blurred = fftconvolve(blurred, disk)
        half = max(len(exact), len(blurred)) // 2
        difference = np.pad(exact, half - len(exact) // 2) - np.pad(blurred, half - len(blurred) // 2)
        difference = np.pad(difference, max(size - half, 0))
        middle = len(difference) // 2
        kept = difference[middle - size : middle + size + 1, middle - size : middle + size + 1].copy()
        kept[size, size] -= kept.sum()
        found.append(kept)
    return np.array(found)
