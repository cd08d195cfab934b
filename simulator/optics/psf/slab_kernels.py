"""Kernels by distance as the device gathers with them: for all nodes, channels and blur radii of a wavefront.

What lies beyond a kernel's core goes to a tail on cells, which all share (`slab_tails`).
"""

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from simulator.optics.psf.field_psf import RINGING, SLAB_PX, FieldPsf
from simulator.optics.psf.fraunhofer import ROUND, odd
from simulator.optics.psf.gather_kernels import positive_too
from simulator.optics.psf.kernel_split import CELLS, Core, fits_tail
from simulator.optics.psf.node_tables import tables_of
from simulator.optics.psf.rotated_kernels import BLADE_STEPS, BLADE_TURNS, RotatedKernels, lagrange_weights, samples_of
from simulator.optics.psf.slab_table import SlabKernels, mirrored_nodes
from simulator.optics.psf.slab_tails import REACHES_PX, Keyed, slab_tail
from simulator.optics.psf.smooth_cores import ShownKernel, core_matrix
from simulator.optics.psf.visibility import DARK_SHARE, Visibility
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

ZONES = 4  # rings of the field in which cores have the same reach
TAPERS_PX = (0, 2)  # photosites over which a core may fade out
MARGINS = ((0.004, 12.0), (0.0, 36.0), (0.0, 60.0))  # allowed error from which on kernels may have this margin [lambda N]
MOST_SLABS = 63  # one bit each in kernels/psf_slab_bits.cl
NODE_SHARE = 0.1  # of the allowed error, for kernels of nodes that are not computed
STEP_SHARE = 0.3  # of the allowed error, for the interpolation between blur radii, and for that between nodes
FINER = (2, 4)  # slabs in place of one of `slab_radii_px`
FINEST = 4  # blur radii at which light is counted, in place of one of the slabs
MOST_BYTES = 1 << 29  # of what blades change
MOST_NODES = 41  # along the sensor's longer side
HEIGHTS = (0.125, 0.75)  # field radii at which the error of interpolation is measured
BLADE_HEIGHTS = (0.125, 0.875)  # and that of what blades change, between the places where it is computed


def plan_slabs(psf: FieldPsf, seen: Visibility) -> FieldPsf:
    """Return a PSF by distance with the slabs, nodes and core by which the device gathers it; the same PSF where it cannot."""
    lens, given = psf.lens_psf, psf
    if seen.is_smooth:  # cores show its pixels as the open part of photosites does, without finer samples
        psf = replace(psf, over=1)
    fits = psf.by_distance and psf.over == 1 and len(psf.radii_px) > 1
    if not fits or not isinstance(lens, WavefrontPsf) or (psf.nodes != (1, 1) and lens.aberrations.has_fixed_orientation):
        return given
    wide = _widened(list(psf.radii_px))
    fitting = [cell_px for cell_px in CELLS if fits_tail(psf.reach_px, cell_px)]
    if not fitting:
        return given
    # A tail on finer cells costs more, and lets cores be smaller.
    cell_px = min(fitting, key=lambda cell_px: slab_tail(psf, seen, 0, cell_px).core_px + 8 // cell_px)
    beside_px = 1 if seen.is_smooth else psf.sampling.margin_px(lens.pitch_um)
    own_px = _size_px(lens, (wide[0], wide[-1]), _margin(psf, seen, cell_px)) // 2 + beside_px
    reach_px = next((reach_px for reach_px in REACHES_PX if reach_px >= own_px), 0)
    if not reach_px:
        return given
    turned = _blade_error(Keyed(psf.key, psf), seen)
    if turned > STEP_SHARE * seen.allowed:
        return given
    finer, nodes, between = _choose_steps(Keyed(psf.key, psf), seen)
    radii_px = _widened(finer_radii(psf, finer))
    if len(radii_px) > MOST_SLABS or (
        lens.opening.blades and psf.nodes != (1, 1) and _blade_bytes(psf, radii_px, own_px) > MOST_BYTES
    ):
        return given
    psf = replace(psf, radii_px=tuple(radii_px), nodes=nodes)
    error = 2.0 * seen.allowed_dark + max(between, 2.0 * STEP_SHARE * seen.allowed) + turned
    error += NODE_SHARE * seen.allowed if psf.nodes != (1, 1) else 0.0
    return psf.with_core(Core(reach_px, reach_px, cell_px, error), seen)


def _margins(seen: Visibility) -> list[float]:
    """Margins that computed kernels may have around the geometric rays, ascending [lambda N]."""
    first = next(margin for least, margin in MARGINS if seen.allowed >= least)
    return [margin for _, margin in MARGINS if margin >= first]


def _margin(psf: FieldPsf, seen: Visibility, cell_px: int) -> float:
    """Least margin of computed kernels beyond which a tail on cells of cell_px has all light that the scene may show."""
    lens = psf.lens_psf
    assert isinstance(lens, WavefrontPsf)  # plan_slabs asks for no other
    tails = [slab_tail(psf, seen, channel, cell_px) for channel in range(len(lens.wavelengths_nm))]
    for margin in _margins(seen):
        half_px = _size_px(lens, (0.0,), margin) // 2
        if all(seen.error(tail.beyond(half_px)) <= seen.allowed_dark for tail in tails):
            return margin
    return MARGINS[-1][1]


def _size_px(lens: WavefrontPsf, radii_px: tuple[float, ...], margin: float) -> int:
    """Photosites across kernels of these blur radii with a margin [lambda N]."""
    return kernel_size_px(lens.aberrations, lens.f_number, lens.pitch_um, lens.wavelengths_nm, radii_px, airy_margin=margin)


def finer_radii(psf: FieldPsf, finer: int) -> list[float]:
    """Blur radii of a PSF, and finer - 1 between two that are one surface."""
    found = [psf.radii_px[0]]
    for slab in range(1, len(psf.radii_px)):
        parts = finer if psf.is_continuous(slab) else 1
        found += np.linspace(psf.radii_px[slab - 1], psf.radii_px[slab], parts + 1)[1:].tolist()
    return found


def _widened(radii_px: list[float]) -> list[float]:
    """Radii with one more at either end, so that cubics find four around each place."""
    first, last = (min(abs(here - beside), SLAB_PX) for here, beside in (radii_px[:2], radii_px[-2:]))
    return [radii_px[0] - first, *radii_px, radii_px[-1] + last]


@lru_cache(maxsize=8)
def _choose_steps(of: Keyed, seen: Visibility) -> tuple[int, tuple[int, int], float]:
    """How many slabs take the place of one, rows and columns of nodes, and the error of interpolation between both.

    Neither errs by more than its share, while so many slabs and nodes are allowed. The error of cubics grows as the fourth
    power of their step, that of a linear interpolation as the square; it is measured at a few radii and places.
    """
    psf = of.psf
    assert isinstance(psf.lens_psf, WavefrontPsf)  # plan_slabs asks for no other
    radii, varies = psf.radii_px, psf.nodes != (1, 1)
    lens = _of_one_color(psf.lens_psf)
    lens = replace(lens, opening=ROUND) if varies else lens
    how = varies, _margins(seen)[0], psf.even_squares
    few = [slab for slab in range(1, len(radii)) if psf.is_continuous(slab)]
    between, beside = 0.0, 0.0
    for slab in few[:: max(1, len(few) // 2)]:
        step_px, middle_px = (radii[slab] - radii[slab - 1]) / FINER[0], 0.5 * (radii[slab - 1] + radii[slab])
        around_px = middle_px + step_px * np.array([-1.5, -0.5, 0.5, 1.5])
        _, weights = lagrange_weights(around_px, middle_px)
        measured = RotatedKernels(lens, psf.sampling, (*around_px.tolist(), middle_px), *how)
        for height in HEIGHTS if varies else (0.0,):
            kernels = measured.kernels((height, 0.0))[:, 0]
            between = max(between, seen.error(kernels[-1] - np.tensordot(weights, kernels[:-1], axes=1)))
    for radius_px in radii[:: len(radii) - 1] if varies else ():
        one = RotatedKernels(lens, psf.sampling, (radius_px,), *how)
        for height in HEIGHTS:
            ahead, here, behind = (one.kernels((height + step, 0.0))[0, 0] for step in (-0.125, 0.0, 0.125))
            beside = max(beside, seen.error(here - 0.5 * (ahead + behind)))
    finer = next((parts for parts in FINER if between * (FINER[0] / parts) ** 4 <= STEP_SHARE * seen.allowed), FINER[-1])
    between *= (FINER[0] / finer) ** 4
    if not varies:
        return finer, (1, 1), between
    # `beside` is the error over 0.25 half diagonals; both axes add theirs.
    measured_px = 0.25 * 0.5 * math.hypot(*psf.sensor_px)
    step_px = measured_px * math.sqrt(STEP_SHARE * seen.allowed / max(2.0 * beside, 1e-9))
    columns, rows = (min(max(odd(side / step_px + 1.0), 3), MOST_NODES) for side in psf.sensor_px)
    steps_px = (side / (count - 1) for side, count in zip(psf.sensor_px, (columns, rows), strict=True))
    left = sum(beside * (one / measured_px) ** 2 for one in steps_px)
    return finer, (rows, columns), between + left


def _blade_bytes(psf: FieldPsf, radii_px: list[float], reach_px: int) -> int:
    """Memory of what blades change, of kernels with this reach."""
    lens = psf.lens_psf
    assert isinstance(lens, WavefrontPsf)  # plan_slabs asks for no other
    across = samples_of(lens, even_squares=psf.even_squares) * (2 * reach_px + 1)
    samples = len(radii_px) * len(lens.wavelengths_nm) * across**2
    return 4 * BLADE_TURNS * len(BLADE_STEPS) * samples


@lru_cache(maxsize=8)
def _blade_error(of: Keyed, seen: Visibility) -> float:
    """Error of interpolating what blades change, at the ends of the blur radii, as far as can be from where it is computed."""
    psf, lens = of.psf, of.psf.lens_psf
    assert isinstance(lens, WavefrontPsf)  # plan_slabs asks for no other
    opening, found = lens.opening, 0.0
    if psf.nodes == (1, 1) or not opening.blades:
        return 0.0
    turned = opening.with_corner(math.pi / (BLADE_TURNS * opening.blades))  # the field is along x, and kernels are not turned
    lens = replace(_of_one_color(lens), opening=turned)
    for radius_px, height in itertools.product(psf.radii_px[:: len(psf.radii_px) - 1], BLADE_HEIGHTS):
        made = RotatedKernels(lens, psf.sampling, (radius_px,), True, _margins(seen)[0], psf.even_squares)
        found = max(found, seen.error((made.kernels((height, 0.0)) - made.computed_kernels((height, 0.0)))[0, 0]))
    return found


def _of_one_color(lens: WavefrontPsf) -> WavefrontPsf:
    return replace(lens, wavelengths_nm=lens.wavelengths_nm[:1])


def slab_kernels_of(psf: FieldPsf, channels: int) -> SlabKernels:
    """Kernels of a PSF of `plan_slabs`; those of the last few are kept."""
    return _made(Keyed((*psf.key, psf.core, psf.seen), psf), channels)


@lru_cache(maxsize=4)
def _made(of: Keyed, channels: int) -> SlabKernels:
    psf, lens, seen = of.psf, of.psf.lens_psf, of.psf.seen
    assert psf.core is not None and seen is not None and isinstance(lens, WavefrontPsf)  # plan_slabs
    tails = [slab_tail(psf, seen, channel, psf.core.cell_px) for channel in range(channels)]
    within, tail, smooth = (np.array([getattr(one, name) for one in tails]) for name in ("within", "cells", "spread"))
    light, farthest_px = 1.0 - tail.sum(axis=(1, 2)), max(one.core_px for one in tails)
    margin = _margin(psf, seen, psf.core.cell_px)
    source = RotatedKernels(lens, psf.sampling, psf.radii_px, psf.nodes != (1, 1), margin, psf.even_squares)

    def tables(field_xy: tuple[float, float]) -> _Tables:
        samples = source.samples(field_xy)
        kernels = source.photosites(samples)[..., ::-1, ::-1] / within[:, None, None]
        near = _of_size(smooth, kernels.shape[-1])
        own = (kernels - near) * source.computed(kernels.shape[-1], farthest_px)  # what lies beyond is the tail's
        own *= (light / own.sum(axis=(2, 3)))[..., None, None].astype(np.float32)
        return _Tables(np.asarray(own), near, samples[::-1, ::-1])

    zones = _zones(psf, tables, light)
    rows, columns = psf.nodes
    mirrors = not source.has_blades  # light falls alike in mirrored places
    allowed = NODE_SHARE * seen.allowed + _blade_error(Keyed(psf.key, psf), seen)  # which differs from node to node

    def fits(wrong: np.ndarray) -> bool:
        return all(seen.error(table) <= allowed for table in wrong[:, 0])

    of_nodes = tables_of(lambda row, column: tables(psf.field_xy(row, column)).cores, psf.nodes, fits, mirrors=mirrors)
    quarter: dict[tuple[int, int, int], np.ndarray] = {}
    rings = np.zeros((len(psf.radii_px), rows, columns), bool)
    for row, column in itertools.product(*(range((count + 1) // 2 if mirrors else count) for count in psf.nodes)):
        zone = zones[_zone(psf.field_xy(row, column))]
        for number, core in enumerate(_cores(of_nodes.at(row, column), zone, light, seen)):
            quarter[number, row, column] = core[None]
        rings[np.ix_(range(len(rings)), *mirrored_nodes((row, column), psf.nodes, mirrors=mirrors))] = zone.rings[:, None, None]
    if rings.any():
        quarter = {place: _with_highlights(core[0]) for place, core in quarter.items()}
    tail = tail.astype(np.float32)[None, None]
    apart = [slab for slab in range(len(psf.radii_px)) if not psf.is_continuous(slab)]
    starts = np.array(apart)[np.searchsorted(apart, np.arange(len(psf.radii_px)), side="right") - 1]
    cores = psf.nodes, mirrors, quarter
    return SlabKernels(np.array(psf.radii_px), starts, *cores, tail, psf.core.cell_px, light.astype(np.float32), rings)


def _of_size(tables: np.ndarray, size: int) -> np.ndarray:
    """Middle of tables (channels, n, n), with zeros around it where they are smaller, (channels, size, size)."""
    beyond = max((size - tables.shape[-1]) // 2, 0)
    padded = np.pad(tables, ((0, 0), (beyond, beyond), (beyond, beyond)))
    spare = (padded.shape[-1] - size) // 2
    return padded[:, spare : spare + size, spare : spare + size]


@dataclass(frozen=True)
class _Tables:
    """Gather tables of a place.

    cores: (slabs, channels, size, size) what the cores should be. smooth: (channels, size, size) what the tail gives beside
    them. samples: (samples, samples, slabs, channels) light of a point, mirrored as they are.
    """

    cores: np.ndarray
    smooth: np.ndarray
    samples: np.ndarray


def _zone(field_xy: tuple[float, float]) -> int:
    return min(int(math.hypot(*field_xy) * ZONES), ZONES - 1)


@dataclass(frozen=True)
class _Zone:
    """A ring of the field, of a width that all have.

    reaches: reach and taper of each slab's cores, (slabs, 2), as far as the scene may show. rings: (slabs,) whether light of
    highlights shows their negative values at either end of the zone.
    """

    reaches: np.ndarray
    rings: np.ndarray


def _zones(psf: FieldPsf, tables: Callable[[tuple[float, float]], _Tables], light: np.ndarray) -> list[_Zone]:
    """Cores of the ZONES, measured at three places each. light: of `SlabKernels`."""
    assert psf.seen is not None  # plan_slabs
    seen, varies = psf.seen, psf.nodes != (1, 1)
    found, inner = list[_Zone](), np.zeros(len(psf.radii_px), bool)
    for height in [(zone + 1) / ZONES for zone in range(ZONES)] if varies else [0.0]:
        angles = np.linspace(0.0, 0.5 * math.pi, 3) if varies else (0.0,)
        places = [tables((height * math.cos(angle), height * math.sin(angle))) for angle in angles]
        zone = _Zone(_slab_reaches(places, psf, seen), inner)
        if psf.highlight_limits:
            ends = places if found or not varies else [*places, tables((0.0, 0.0))]  # of the first also its middle
            every = [_rings(_cores(one.cores, zone, light, seen), one.smooth, seen) for one in ends]
            zone, inner = replace(zone, rings=np.logical_or.reduce([inner, *every])), np.logical_or.reduce(every)
        found.append(zone)
    return found if varies else ZONES * found


def _cores(tables: np.ndarray, zone: _Zone, light: np.ndarray, seen: Visibility) -> list[np.ndarray]:
    """Core of each slab at a place of a zone, (channels, taps, taps) float32 each. tables: `_Tables.cores`."""
    pairs = zip(tables, zone.reaches.tolist(), strict=True)
    return [_cut(table, reach_px, taper_px, light, seen) for table, (reach_px, taper_px) in pairs]


def _slab_reaches(places: list[_Tables], psf: FieldPsf, seen: Visibility) -> np.ndarray:
    """Reach and taper of each slab's cores at some places of the field, (slabs, 2)."""
    assert psf.core is not None  # plan_slabs
    if not seen.is_smooth:
        return np.array([_reach(np.concatenate(slab), seen) for slab in zip(*(one.cores for one in places), strict=True)])
    found = np.zeros((len(psf.radii_px), 2), int)
    for one in places:
        for slab, channel in itertools.product(range(len(found)), range(len(one.smooth))):
            shown = ShownKernel(one.samples[:, :, slab, channel], psf.sampling, psf.pitch_um, seen)
            limits_px = int(found[slab, 0]), psf.core.reach_px
            reach_px = _smooth_reach(one.cores[slab, channel], one.smooth[channel], shown, *limits_px)
            found[slab, 0] = max(found[slab, 0], reach_px)
    return found


def _smooth_reach(table: np.ndarray, smooth: np.ndarray, shown: ShownKernel, least_px: int, most_px: int) -> int:
    """Least of REACHES_PX from least_px to most_px at which a scene's pixels differ as little as by the whole table.

    The light of photosites does not tell where in them a pixel lies. That error is no core's, however far it reaches.
    """
    half = len(table) // 2
    allowed = shown.error(table + smooth) + DARK_SHARE * shown.seen.allowed
    for reach_px in REACHES_PX:
        if reach_px >= min(half, most_px):
            return reach_px
        if reach_px < least_px:
            continue
        fold, spare = core_matrix(len(table), reach_px, shown.width_px), half - reach_px
        if shown.error(np.pad(fold @ table @ fold.T, spare) + smooth) <= allowed:
            return reach_px
    return REACHES_PX[-1]


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


def _cut(table: np.ndarray, reach_px: int, taper_px: int, light: np.ndarray, seen: Visibility) -> np.ndarray:
    """Core of tables (channels, size, size), with this sum: (channels, taps, taps) float32."""
    half = table.shape[-1] // 2
    if seen.is_smooth and reach_px < half:
        fold = core_matrix(table.shape[-1], reach_px, 1.0 / seen.scale)
        folded = fold @ table @ fold.T
        return np.asarray(folded * (light / folded.sum(axis=(1, 2)))[:, None, None], np.float32)
    inner, pad = slice(max(half - reach_px, 0), half + reach_px + 1), max(reach_px - half, 0)
    window = _window(half, reach_px, 0 if reach_px >= half else taper_px)
    core = np.pad((window * table)[:, inner, inner], ((0, 0), (pad, pad), (pad, pad)))
    return np.asarray(core * (light / core.sum(axis=(1, 2)))[:, None, None], np.float32)


def _with_highlights(core: np.ndarray) -> np.ndarray:
    """Join to a core (channels, taps, taps) that for highlights, without negative values: (2, channels, taps, taps)."""
    return positive_too(core.reshape(len(core), -1)).reshape(2, *core.shape)


def _rings(cores: list[np.ndarray], smooth: np.ndarray, seen: Visibility) -> np.ndarray:
    """Whether the negative values of cores with their tail exceed RINGING of their light in any channel, (cores,) bool.

    cores: (channels, taps, taps) each. smooth: (channels, size, size) what the tail gives. In smooth light those count that
    show.
    """
    half = max(smooth.shape[-1], *(core.shape[-1] for core in cores)) // 2
    spares = (2 * [2 * [half - one.shape[-1] // 2]] for one in (*cores, smooth))
    *padded, beside = (np.pad(one, ((0, 0), *spare)) for one, spare in zip((*cores, smooth), spares, strict=True))
    whole = np.stack(padded) + beside
    shown = seen.spread(whole) if seen.is_smooth else whole
    return np.asarray((-np.minimum(shown, 0.0).sum(axis=(-2, -1)) > RINGING * whole.sum(axis=(-2, -1))).any(axis=-1))
