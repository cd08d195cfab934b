"""Kernels by distance as the device gathers with them: for all nodes, channels and blur radii of a wavefront.

What lies beyond a kernel's core goes to a tail on cells. It is that of one kernel for all, since far from
the rays light falls off alike.
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from simulator.optics.psf.field_psf import RINGING, FieldPsf, has_fixed_orientation
from simulator.optics.psf.fraunhofer import odd
from simulator.optics.psf.gather_kernels import positive_too
from simulator.optics.psf.kernel_split import CELLS, Core, fit_tail, fits_tail, gather_table
from simulator.optics.psf.rotated_kernels import RotatedKernels, lagrange_weights
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

ZONES = 4  # rings of the field in which cores have the same reach
REACHES_PX = (3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 18, 21, 24, 28, 32, 38, 44)  # photosites to either side of cores
TAPERS_PX = (0, 2)  # photosites over which a core may fade out
TAIL_CORES_PX = (*range(4, 12), 12, 14, 16, 20, 24, 28, 32)  # photosites from which on a tail is smooth on its cells
MARGINS = ((0.004, 12.0), (0.0, 36.0))  # allowed error from which on kernels are computed with this margin [lambda N]
MOST_SLABS = 63  # one bit each in kernels/psf_slab_bits.cl
STEP_SHARE = 0.3  # of the allowed error, for the interpolation between blur radii, and for that between nodes
FINER = (1, 2, 4, 8)  # slabs in place of one
MOST_NODES = 41  # along the sensor's longer side
HEIGHTS = (0.125, 0.75)  # field radii at which the error of interpolation is measured


@dataclass(frozen=True)
class SlabKernels:
    """Weights for kernels/psf_slabs.cl and kernels/psf_tail.cl.

    radii_px: signed blur radii of the slabs, ascending [photosites].
    reach_px: (radii, node rows, node columns) photosites to either side of each core, one of REACHES_PX.
    cores: by slab, node row and node column: (channels, taps, taps) float32. rings: whether highlights need other cores.
    tail: (1, 1, channels, cells, cells) float32. cell_px: photosites across its cells.
    light: (channels,) float32, sum of each core; the rest is the tail's.
    """

    radii_px: tuple[float, ...]
    reach_px: np.ndarray
    cores: dict[tuple[int, int, int], np.ndarray]
    tail: np.ndarray
    cell_px: int
    light: np.ndarray
    rings: bool

    def packed(self, reach_px: int, rows: range, pairs: np.ndarray, is_bright: bool) -> np.ndarray:
        """Argument `kernels` of kernels/psf_slabs.cl. rows: of nodes. pairs: (pairs, 2) slab and column of nodes."""
        taps = 2 * reach_px + 1
        found = np.zeros((len(rows), len(pairs), len(self.light), taps, taps), np.float32)
        for place, row in enumerate(rows):
            for number, (slab, column) in enumerate(pairs.tolist()):
                core = self.cores[slab, row, column]
                spare = (taps - core.shape[-1]) // 2
                if spare >= 0:
                    found[place, number, :, spare : taps - spare, spare : taps - spare] = core
        if not is_bright:
            return found[None]
        both = positive_too(found.reshape(*found.shape[:3], taps * taps))
        return both.reshape(2, *found.shape)


def plan_slabs(psf: FieldPsf, seen: Visibility) -> FieldPsf:
    """Return a PSF by distance with the slabs, nodes and core by which the device gathers it; the same PSF where it cannot."""
    lens = psf.lens_psf
    fits = psf.by_distance and psf.over == 1 and len(psf.radii_px) > 1
    if not fits or not isinstance(lens, WavefrontPsf) or (psf.nodes != (1, 1) and has_fixed_orientation(lens)):
        return psf
    ends, lens_numbers = psf.radii_px[:: len(psf.radii_px) - 1], (lens.aberrations, lens.f_number, lens.pitch_um)
    own_px = kernel_size_px(
        *lens_numbers, lens.wavelengths_nm, ends, airy_margin=margin_of(seen)
    ) // 2 + psf.sampling.margin_px(lens.pitch_um)
    reach_px = next((reach_px for reach_px in REACHES_PX if reach_px >= own_px), 0)
    fitting = [cell_px for cell_px in CELLS if fits_tail(psf.reach_px, cell_px)]
    if not fitting or not reach_px:
        return psf
    finer, nodes = _choose_steps(_Keyed(psf.key, psf), seen)
    radii_px = finer_radii(psf, finer)
    if len(radii_px) > MOST_SLABS:
        return psf
    # A tail on finer cells costs more, and lets cores be smaller.
    cell_px = min(fitting, key=lambda cell_px: _make_tail(psf, seen, 0, cell_px).core_px + 8 // cell_px)
    computed_px = psf.radii_px
    psf = replace(psf, radii_px=tuple(radii_px), computed_px=computed_px, nodes=nodes)
    return psf.with_core(Core(reach_px, reach_px, cell_px, 2.0 * seen.allowed_dark + 2.0 * STEP_SHARE * seen.allowed), seen)


def margin_of(seen: Visibility) -> float:
    """Margin of computed kernels around the geometric rays [lambda N]."""
    return next(margin for least, margin in MARGINS if seen.allowed >= least)


def finer_radii(psf: FieldPsf, finer: int) -> list[float]:
    """Blur radii of a PSF's slabs, and finer - 1 between two that are one surface."""
    found = [psf.radii_px[0]]
    for slab in range(1, len(psf.radii_px)):
        parts = finer if psf.is_continuous(slab) else 1
        found += np.linspace(psf.radii_px[slab - 1], psf.radii_px[slab], parts + 1)[1:].tolist()
    return found


@dataclass(frozen=True)
class _Keyed:
    """A PSF that is equal to another where all numbers are."""

    key: tuple[object, ...]
    psf: FieldPsf = field(compare=False)


@lru_cache(maxsize=8)
def _choose_steps(of: _Keyed, seen: Visibility) -> tuple[int, tuple[int, int]]:
    """How many slabs take the place of one, and rows and columns of nodes: neither interpolation errs by more than its share.

    The error of a linear interpolation grows as the square of its step; it is measured at a few radii and places.
    """
    psf, allowed = of.psf, STEP_SHARE * seen.allowed
    assert isinstance(psf.lens_psf, WavefrontPsf)  # plan_slabs asks for no other
    lens = replace(psf.lens_psf, wavelengths_nm=psf.lens_psf.wavelengths_nm[:1])
    radii = psf.radii_px
    few = [slab for slab in range(1, len(radii)) if psf.is_continuous(slab)]
    varies = psf.nodes != (1, 1)
    between, beside = 0.0, 0.0
    for slab in few[:: max(1, len(few) // 3)]:
        low, high = radii[slab - 1 : slab + 1]
        three = RotatedKernels(lens, psf.sampling, (low, 0.5 * (low + high), high), varies, margin_of(seen))
        for height in HEIGHTS if varies else (0.0,):
            kernels = three.kernels((height, 0.0))[:, 0]
            between = max(between, seen.error(kernels[1] - 0.5 * (kernels[0] + kernels[2])))
    for radius_px in radii[:: len(radii) - 1] if varies else ():
        one = RotatedKernels(lens, psf.sampling, (radius_px,), varies, margin_of(seen))
        for height in HEIGHTS:
            ahead, here, behind = (one.kernels((height + step, 0.0))[0, 0] for step in (-0.125, 0.0, 0.125))
            beside = max(beside, seen.error(here - 0.5 * (ahead + behind)))
    finer = next((parts for parts in FINER if between / parts**2 <= allowed), FINER[-1])
    if not varies:
        return finer, (1, 1)
    width, height_px = psf.sensor_px
    # `beside` is the error over 0.25 half diagonals; both axes add theirs.
    step_px = 0.25 * 0.5 * math.hypot(width, height_px) * math.sqrt(allowed / max(2.0 * beside, 1e-9))
    columns, rows = (min(max(odd(side / step_px + 1.0), 3), MOST_NODES) for side in psf.sensor_px)
    return finer, (rows, columns)


def slab_kernels_of(psf: FieldPsf, channels: int) -> SlabKernels:
    """Kernels of a PSF of `plan_slabs`; those of the last few are kept."""
    return _made(_Keyed((*psf.key, psf.core, psf.seen), psf), channels)


@lru_cache(maxsize=4)
def _made(of: _Keyed, channels: int) -> SlabKernels:
    psf, lens = of.psf, of.psf.lens_psf
    assert psf.core is not None and psf.seen is not None and isinstance(lens, WavefrontPsf)  # plan_slabs
    tails = [_make_tail(psf, psf.seen, channel, psf.core.cell_px) for channel in range(channels)]
    within, tail, smooth = (np.array([getattr(one, name) for one in tails]) for name in ("within", "cells", "spread"))
    light = 1.0 - tail.sum(axis=(1, 2))
    source, finer = RotatedKernels(lens, psf.sampling, psf.computed_px, psf.nodes != (1, 1), margin_of(psf.seen)), _between(psf)

    def tables(field_xy: tuple[float, float]) -> np.ndarray:
        """What the cores of a place should be, (slabs, channels, size, size)."""
        kernels = np.tensordot(finer, source.kernels(field_xy) / within[:, None, None], axes=1)[..., ::-1, ::-1]
        spare = (smooth.shape[-1] - kernels.shape[-1]) // 2
        near = slice(spare, spare + kernels.shape[-1])
        return np.asarray(kernels - smooth[:, near, near])

    zones = _reaches(psf, tables)
    rows, columns = psf.nodes
    reach, cores = np.zeros((len(psf.radii_px), rows, columns), int), {}
    for row in range((rows + 1) // 2):
        for column in range((columns + 1) // 2):
            place = psf.field_xy(row, column)
            reaches, every = zones[_zone(place)], tables(place)
            for number, (table, (reach_px, taper_px)) in enumerate(zip(every, reaches.tolist(), strict=True)):
                core = _cut(table, reach_px, taper_px, light)
                for down, flip_y in {rows - 1 - row: -1, row: 1}.items():  # light falls alike in mirrored places
                    for across, flip_x in {columns - 1 - column: -1, column: 1}.items():
                        reach[number, down, across] = reach_px
                        cores[number, down, across] = core[:, ::flip_y, ::flip_x]
    rings = bool(psf.highlight_limits) and any(_rings(core, psf.seen) for core in cores.values())
    tail = tail.astype(np.float32)[None, None]
    return SlabKernels(psf.radii_px, reach, cores, tail, psf.core.cell_px, light.astype(np.float32), rings)


def _zone(field_xy: tuple[float, float]) -> int:
    return min(int(math.hypot(*field_xy) * ZONES), ZONES - 1)


def _reaches(psf: FieldPsf, tables: Callable[[tuple[float, float]], np.ndarray]) -> list[np.ndarray]:
    """Reach and taper of each slab's cores, (slabs, 2), in rings of the field of equal width: as far as the scene may show."""
    assert psf.seen is not None  # plan_slabs
    if psf.nodes == (1, 1):
        return ZONES * [np.array([_reach(slab, psf.seen) for slab in tables((0.0, 0.0))])]
    found = []
    for zone in range(ZONES):
        height = (zone + 1) / ZONES
        places = [tables((height * math.cos(angle), height * math.sin(angle))) for angle in np.linspace(0.0, 0.5 * math.pi, 3)]
        found.append(np.array([_reach(np.concatenate(slab), psf.seen) for slab in zip(*places, strict=True)]))
    return found


def _reach(tables: np.ndarray, seen: Visibility) -> tuple[int, int]:
    """Least of REACHES_PX by which tables (any, size, size) may be cut, and the taper at which they may."""
    half, places = tables.shape[-1] // 2, itertools.product(REACHES_PX, TAPERS_PX)
    for reach_px, taper_px in places:
        lost = 1.0 - _window(half, reach_px, taper_px)
        if reach_px >= half or all(seen.error(lost * table) <= seen.allowed_dark for table in tables):
            return reach_px, taper_px
    return REACHES_PX[-1], 0


@lru_cache(maxsize=128)
def _window(half: int, reach_px: int, taper_px: int) -> np.ndarray:
    """Weights of a core in a table (2 half + 1, 2 half + 1): 1, and less over the last taper_px photosites, 0 beyond its reach.

    Ringing that ends smoothly adds up to nothing in light that is smooth.
    """
    away = np.abs(np.arange(-half, half + 1))
    inside = np.clip((reach_px + 1.0 - away) / (taper_px + 1.0), 0.0, 1.0)
    along = 0.5 - 0.5 * np.cos(math.pi * inside)
    return np.minimum(along[:, None], along[None, :])


def _cut(table: np.ndarray, reach_px: int, taper_px: int, light: np.ndarray) -> np.ndarray:
    """Core of tables (channels, size, size), with this sum: (channels, taps, taps) float32."""
    half = table.shape[-1] // 2
    inner, pad = slice(max(half - reach_px, 0), half + reach_px + 1), max(reach_px - half, 0)
    window = _window(half, reach_px, 0 if reach_px >= half else taper_px)
    core = np.pad((window * table)[:, inner, inner], ((0, 0), (pad, pad), (pad, pad)))
    return np.asarray(core * (light / core.sum(axis=(1, 2)))[:, None, None], np.float32)


@dataclass(frozen=True)
class _Tail:
    """Tail of the kernel in focus on the axis.

    core_px: reach of the core from which on it is smooth. cells: (cells, cells) weights. spread: (photosites, photosites) what
    photosites gather with it on average over their places in a cell. within: light within the kernel, before normalisation.
    """

    core_px: int
    cells: np.ndarray
    spread: np.ndarray
    within: float


def _make_tail(psf: FieldPsf, seen: Visibility, channel: int, cell_px: int) -> _Tail:
    """Tail on cells of cell_px, from as near as its cells may show."""
    focus = psf.fit_kernel(0.0)
    light = focus.cell_kernel(channel, 0.0, (0.0, 0.0))
    within = float(light.sum())
    table = gather_table(psf.sampling.phases(light / within, focus.cells, focus.pitch_um, 1, True))
    tails = ((core_px, *fit_tail(table, core_px, cell_px)) for core_px in TAIL_CORES_PX)
    for core_px, cells, spread in tails:
        average = spread.mean(axis=0)
        is_last = core_px == TAIL_CORES_PX[-1]
        if is_last or max(seen.error(one - average) for one in spread) <= seen.allowed_dark:
            return _Tail(core_px, cells, average, within)
    raise AssertionError("the last core is taken")


def _between(psf: FieldPsf) -> np.ndarray:
    """Weights of computed kernels in those of the slabs, (slabs, computed): cubics within each run of one surface."""
    coarse, computed = replace(psf, radii_px=psf.computed_px), np.array(psf.computed_px)
    runs = np.split(np.arange(len(computed)), [slab for slab in range(1, len(computed)) if not coarse.is_continuous(slab)])
    found = np.zeros((len(psf.radii_px), len(computed)))
    for slab, radius_px in enumerate(psf.radii_px):
        run = next(run for run in reversed(runs) if computed[run[0]] <= radius_px)
        numbers, weights = lagrange_weights(computed[run], radius_px)
        found[slab, run[numbers]] = weights
    return found


def _rings(core: np.ndarray, seen: Visibility) -> bool:
    """Whether the negative values of a core exceed RINGING of its light in any channel; in smooth light those that show."""
    shown = np.stack([seen.spread(one) for one in core]) if seen.is_smooth else core
    return bool((-np.minimum(shown, 0.0).sum(axis=(1, 2)) > RINGING * core.sum(axis=(1, 2))).any())
