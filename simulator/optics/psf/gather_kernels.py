"""Kernels of a point spread function as the device gathers with them, for all nodes, channels and blur radii."""

import itertools
import math
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Self

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.psf.field_psf import FieldPsf, correction_reach_px, farthest_correction_px
from simulator.optics.psf.kernel_split import CELLS, Core, SplitKernel, fits_tail, gather_table, split_kernel, tail_reach
from simulator.optics.psf.psf_cost import COST_NS
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil

CORES_PX = (*range(2, 18), 20, 22, 24, 28, 32)
ARMS_PX = (8, 12, 16, 20, 24, 32)
PASS_COST = 16.0  # of a launch that adds arms, in taps of a core
TAIL_COST = 8.0  # of a tap on cells of one photosite, in taps of a core: three colours, and margins
MOST_TAPS = 96  # samples across a core; more are cheaper by transforms
LIGHT_COST = COST_NS["light"] / COST_NS["taps"]  # of a photosite whatever its core, in taps of it
SPARED = 1.0 / 12.0  # of a photosite's time, which a core must spare: else it is one that leaves nothing out
EXACT = 1e-9  # share of the brightest light; rounding
CORE_SHARE = 0.16  # of the allowed error, for core and tail: beside an edge the dark side has less noise than the bright one

MIRRORED = 1e-6  # share of the largest weight by which halves of a kernel may differ that count as mirror images


@dataclass(frozen=True)
class GatherKernels:
    """Weights for kernels/psf_gather.cl and kernels/psf_tail.cl.

    radii_px: signed blur radii, ascending [photosites].
    core: (2, radii, node rows, node columns, channels, held down, held across) float32, for all light, and without negative
        values. taps: samples down and across. folded: whether rows mirror each other, and columns; the first half is held, with
        half the weight in the middle.
    tail: (node rows, node columns, channels, cells, cells) float32; None: there is none. cell_px: photosites across its cells.
    over: samples per photosite and axis. rings: whether highlights need the second half of `core`.
    """

    radii_px: tuple[float, ...]
    core: np.ndarray
    taps: tuple[int, int]
    folded: tuple[bool, bool]
    tail: np.ndarray | None
    cell_px: int
    over: int
    rings: bool

    @classmethod
    def of(
        cls,
        radii_px: tuple[float, ...],
        core: np.ndarray,
        over: int,
        rings: bool,
        tail: np.ndarray | None = None,
        cell_px: int = 0,
    ) -> Self:
        """Kernels with a core (2, radii, node rows, node columns, channels, taps down, taps across), folded where it can be."""
        taps, folded = (core.shape[-2], core.shape[-1]), []
        for axis, count in ((-2, taps[0]), (-1, taps[1])):
            mirrors = count > 1 and bool(np.abs(core - np.flip(core, axis)).max() < MIRRORED * np.abs(core).max())
            folded.append(mirrors)
            if mirrors:
                core = _fold(core, axis)
        return cls(radii_px, np.ascontiguousarray(core, np.float32), taps, (folded[0], folded[1]), tail, cell_px, over, rings)

    @cached_property
    def kept(self) -> np.ndarray:
        """Whether the kernels of a radius are not 0 throughout, (radii,)."""
        return np.asarray(self.core.any(axis=(0, *range(2, self.core.ndim))))

    @property
    def first(self) -> tuple[int, int]:
        """Row and column of the sample at which the taps begin, relative to the photosite's first sample."""
        down, across = (-self.over * (taps // self.over // 2) for taps in self.taps)
        return down, across

    @property
    def reach_px(self) -> int:
        """Photosites to either side."""
        return max(self.taps) // self.over // 2

    @property
    def tail_taps(self) -> int:
        """Cells across the tail; 0: there is none."""
        return 0 if self.tail is None else self.tail.shape[-1]


def _fold(core: np.ndarray, axis: int) -> np.ndarray:
    """First half of weights that mirror each other along an axis, their mean, with half the weight in the middle."""
    count = core.shape[axis]
    held = 0.5 * (core + np.flip(core, axis)).take(range((count + 1) // 2), axis)
    if count % 2:
        held.swapaxes(axis, -1)[..., -1] *= 0.5
    return held


def fits_gather(psf: FieldPsf) -> bool:
    """Whether kernels are small enough for direct sums."""
    return any(fits_tail(psf.reach_px, cell_px) for cell_px in CELLS)


def choose_core(psf: FieldPsf, channels: int, seen: Visibility) -> Core | None:
    """Cheapest core, arms and tail whose error is allowed, by the kernels in the middle of the sensor and in its corner.

    One that leaves nothing out where others spare less than SPARED of the time. None where no core of MOST_TAPS samples is.
    """
    return _chosen(_Keyed(psf.key, psf), channels, seen)


@lru_cache(maxsize=32)
def _chosen(of: "_Keyed", channels: int, seen: Visibility) -> Core | None:
    psf, found, allowed = of.psf, None, seen.allowed_dark if seen.is_smooth else CORE_SHARE * seen.allowed
    places = {(psf.nodes[0] // 2, psf.nodes[1] // 2), (0, 0)}
    tables = [
        (gather_table(psf.kernel(0, channel, False, *place)), psf.sample_spread(channel))
        for place, channel in itertools.product(places, range(channels))
    ]
    least = math.inf

    def error_of(core_px: int, arm_px: int, cell_px: int) -> float:
        """Predicted error; inf where one of the tables has more than is allowed."""
        most = 0.0
        for table, spread in tables:
            most = max(most, split_kernel(table, psf.over, core_px, arm_px, cell_px, seen.error, spread).error)
            if most > allowed:
                return math.inf
        return most

    for cell_px in (*(cell_px for cell_px in CELLS if fits_tail(psf.reach_px, cell_px)), 0):
        beyond = TAIL_COST * ((2 * tail_reach(psf.reach_px, cell_px) + 1) / cell_px) ** 2 if cell_px else 0.0
        for core_px in (*(core_px for core_px in CORES_PX if core_px < psf.reach_px), psf.reach_px):
            taps = psf.over * (2 * core_px + 1)
            if taps > MOST_TAPS or taps**2 + beyond >= least:
                break
            arms_px = [arm_px for arm_px in ARMS_PX if core_px < arm_px < psf.reach_px] if psf.over == 1 else []
            if math.isinf(error_of(core_px, arms_px[-1] if arms_px else 0, cell_px)):
                continue
            for arm_px in (core_px, *arms_px):
                cost = taps**2 + beyond + (2.0 * (2 * arm_px + 1 + PASS_COST) if arm_px > core_px else 0.0)
                error = error_of(core_px, arm_px, cell_px) if cost < least else math.inf
                if not math.isinf(error):
                    least, found = cost, Core(core_px, arm_px, cell_px if core_px < psf.reach_px else 0, error)
                    break
    most = (1.0 + SPARED) * (least + LIGHT_COST) - LIGHT_COST
    for core_px in (*(core_px for core_px in CORES_PX if core_px < psf.reach_px), psf.reach_px):
        taps = psf.over * (2 * core_px + 1)
        if found is None or taps > MOST_TAPS or taps**2 > most:
            break
        if error_of(core_px, core_px, 0) <= EXACT:
            return Core(core_px, core_px, 0, 0.0)
    return found


def make_gather_kernels(psf: FieldPsf, channels: int) -> list[GatherKernels]:
    """Kernels of a planned PSF of one blur radius, to be summed: its arms, if any, then core and tail."""
    assert psf.core is not None  # else it is convolved by transforms
    core, places = psf.core, list(itertools.product(*map(range, (*psf.nodes, channels))))
    tables = [_padded(psf.kernel(0, channel, False, *node), psf.reach_px, psf.over) for *node, channel in places]
    parts_px, spreads = (core.reach_px, core.arm_px, core.cell_px), [psf.sample_spread(channel) for channel in range(channels)]
    found = [
        split_kernel(table, psf.over, *parts_px, spread=spreads[channel])
        for table, (*_, channel) in zip(tables, places, strict=True)
    ]
    grid = (*psf.nodes, channels)
    rings = any(psf.has_ringing(0, channel) for channel in range(channels))
    middle = np.array([one.core for one in found])
    tail = None if found[0].tail is None else np.array([one.tail for one in found], np.float32)
    if tail is not None:
        tail = tail.reshape(*grid, *tail.shape[-2:])
    parts = _parts(found)
    weights = np.concatenate(parts, axis=1)
    joined = positive_too(weights)
    both = np.split(joined, np.cumsum([part.shape[1] for part in parts])[:-1], axis=-1)
    both[0] = both[0].reshape(2, 1, *grid, *middle.shape[1:])
    made = [GatherKernels.of((0.0,), both[0], psf.over, rings, tail, core.cell_px)]
    for arm, shape in zip(both[1:], ((1, -1), (-1, 1)), strict=False):
        made.insert(0, GatherKernels.of((0.0,), arm.reshape(2, 1, *grid, *shape), psf.over, rings))
    return made


def _parts(found: list[SplitKernel]) -> list[np.ndarray]:
    """Cores of each kernel, (kernels, taps), and if there are any its arms across and down."""
    arms = [one.arms for one in found if one.arms is not None]
    return [np.array([one.core.ravel() for one in found]), *(np.stack(arms, axis=1) if arms else ())]


def _padded(phases: np.ndarray, reach_px: int, over: int) -> np.ndarray:
    """Gather table of kernels (over^2, size, size), all of the size of the largest."""
    return np.pad(gather_table(phases), over * (reach_px - phases.shape[-1] // 2))


def positive_too(core: np.ndarray) -> np.ndarray:
    """Join to cores (..., taps) the same without negative values and with the same sum: (2, ..., taps) float32."""
    kept = np.maximum(core, 0.0)
    sums = kept.sum(axis=-1, keepdims=True)
    scale = core.sum(axis=-1, keepdims=True) / np.where(sums > 0.0, sums, 1.0)
    return np.stack([core, kept * scale]).astype(np.float32)


@dataclass(frozen=True)
class _Keyed:
    """A PSF that is equal to another where all numbers are."""

    key: tuple[object, ...]
    psf: FieldPsf = field(compare=False)


@lru_cache(maxsize=8)
def _made(of: _Keyed, channels: int) -> list[GatherKernels]:
    return make_gather_kernels(of.psf, channels)


def gather_kernels_of(psf: FieldPsf, channels: int) -> list[GatherKernels]:
    """Kernels of a planned PSF; those of the last few are kept."""
    return _made(_Keyed((*psf.key, psf.core, psf.seen), psf), channels)


def corrections_of(psf: FieldPsf, channels: int) -> list[GatherKernels]:
    """Corrections of a geometric blur, followed by the kernel in focus, to wave optics; one for each size of kernels.

    Kernels have the sum 0: those of wave optics at a blur radius, less the image of the aperture convolved with the kernel in
    focus. They are gathered from the sharp light. Those of the last few PSFs are kept.
    """
    return _corrections(_Keyed((*psf.key, psf.corrected_px, psf.seen), psf), channels)


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
        found.append(GatherKernels.of(tuple(psf.corrected_px[number] for number in held), core, 1, rings))
    return found


def correction_core(psf: FieldPsf, radius_px: float, channel: int) -> np.ndarray:
    """Kernels of one correction (2, taps, taps) float64: for all light, and for highlights from kernels without ringing."""
    from scipy.signal import fftconvolve

    size = correction_reach_px(radius_px)
    if not isinstance(psf.lens_psf, WavefrontPsf) or abs(radius_px) > farthest_correction_px(psf.lens_psf) + 1e-6:
        return np.zeros((2, 2 * size + 1, 2 * size + 1))
    wave, focus = psf.at_radius(radius_px), psf.at_radius(radius_px, in_focus=True)
    disk = aperture_weights(replace(psf.pupil, skew=psf.skew), radius_px)
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
