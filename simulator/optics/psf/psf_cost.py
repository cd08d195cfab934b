"""Predicts the time of a planned point spread function from the work that it does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.projection_cost import COST_NS as PROJECTION_NS
from simulator.optics.psf.field_psf import FieldPsf, correction_reach_px, has_fixed_orientation
from simulator.optics.psf.lamps import Lamps, lie_alike
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.slab_table import MOST_HELD
from simulator.optics.psf.slab_tails import REACHES_PX, Keyed, slab_tail
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

COST_NS = {
    "gathers": 6.0e5,  # of a frame that the device gathers: launches and kernels
    "corrections": 5.0e6,  # of a frame whose blur is corrected to wave optics, or that is gathered by distance: their kernels
    "copies": 0.7,  # for each sample of a colour behind the geometric blur
    "light": 15.0,  # for each photosite
    "taps": 0.018,  # for each photosite and sample of light that it gathers
    "distances": 65.0,  # for each photosite whose light is gathered by distance
    "distance taps": 0.03,  # for each photosite and tap of the kernels by distance that reach it
    "transforms": 1.2e6,  # of a frame that the host transforms
    "lamps": 20.0,  # for each photosite of the image of a lamp
    "kernel cells": 50.0,  # for each cell of the kernels of all nodes, and sample of light along an axis: they are made once
    "turned cells": 150.0,  # the same of each kernel of a table that is turned to its node
    "wave cells": 120.0,  # the same of each kernel of a wavefront, by its wavelengths and places, whatever its samples
    "samples": 22.0,  # for each sample of a frame with its margins, colour and slab of blur radius that is transformed
    **PROJECTION_NS,
}

CUBIC, PART_PX = 4, 32  # slabs that share the light of a radius; columns of the parts whose slabs are listed
SHOWN_SHARE = 0.5  # of the error that the dark allows: kernels out of focus show farther than that in focus
INTERPOLATED = 6.0  # times the work of a lamp whose image is computed for its own place, in each colour

Work = dict[str, float]  # counts, by key of COST_NS


def cost_ms(work: Mapping[str, float]) -> float:
    """Return the predicted time of some work [ms]."""
    return 1e-6 * sum(COST_NS[name] * count for name, count in work.items())


def gather_work(psf: FieldPsf, pixels: int) -> Work:
    """Return the work of photosites, those of whole tiles, whose light the device gathers; without that of its samples."""
    extra = float(bool(psf.corrected_px) or psf.is_gathered_by_distance)
    taps = gathered_samples(psf) + correction_samples(psf)
    found = {"gathers": 1.0, "corrections": extra, "light": float(pixels), "taps": pixels * taps}
    if psf.core is not None and psf.is_gathered_by_distance:
        found |= {"distances": float(pixels), "distance taps": pixels * reaching_kernels(psf) * core_taps(psf)}
    return found


def correction_work(psf: FieldPsf, pixels: int) -> Work:
    """Return the work of corrections to wave optics alone, as `gather_work`."""
    return {"gathers": 1.0, "corrections": 1.0, "light": float(pixels), "taps": pixels * correction_samples(psf)}


def transform_work(psf: FieldPsf, width_px: int, height_px: int, channels: int) -> Work:
    """Return the work of a window of so many photosites whose light the host transforms; without that of its projection."""
    side = 2 * psf.reach_px
    samples = (width_px + side) * (height_px + side) * psf.over**2 * channels * len(psf.radii_px)
    return {"transforms": 1.0, "samples": float(samples)}


def kernel_work(psf: FieldPsf, channels: int) -> Work:
    """Return the work of making kernels at nodes over the field; none of one kernel for the whole field, which "gathers" has.

    It is that of the first frame: kernels of the last few PSFs are kept. Those of slabs that a device gathers do not count.
    """
    if psf.nodes == (1, 1) or psf.lens_psf is None or psf.is_gathered_by_distance:
        return {}
    nodes = psf.nodes[0] * psf.nodes[1]
    if isinstance(psf.lens_psf, PsfTable):
        cells = float(len(psf.radii_px) * psf.lens_psf.kernels.shape[-1] ** 2)
        made = {"turned cells": cells * nodes * channels}
    else:
        cells = float(sum((lens.size_px * lens.cells) ** 2 for lens in map(psf.fit_kernel, psf.radii_px)))
        places = nodes if has_fixed_orientation(psf.lens_psf) else psf.field_steps + 1
        made = {"wave cells": cells * places * sum(map(len, psf.lens_psf.wavelengths_nm))}
    return {"kernel cells": cells * nodes * channels * psf.over, **made}


def lamp_work(psf: FieldPsf, projection: Projection, lamps: Lamps, channels: int) -> Work:
    """Return the work of drawing all lamps of a scene."""
    side = 2.0 * (psf.reach_px + math.ceil(1.0 / projection.scale)) + 1.0
    times = 1.0 if lie_alike(projection) else INTERPOLATED * channels
    return {"lamps": lamps.count * times * side**2}


def gathered_samples(psf: FieldPsf) -> float:
    """Return how many samples of light a photosite gathers through core, arms and tail of a PSF; 0 of kernels by distance."""
    core = psf.core
    assert core is not None  # else the host transforms the light
    taps = 0.0 if psf.is_gathered_by_distance else float((psf.over * (2 * core.reach_px + 1)) ** 2)
    if core.arm_px > core.reach_px:
        taps += 4 * core.arm_px
    if core.has_tail:
        taps += 32 * (psf.reach_px / core.cell_px**2) ** 2
    return taps * (4 if psf.nodes != (1, 1) and not psf.is_gathered_by_distance else 1)


def correction_samples(psf: FieldPsf) -> float:
    """Return how many samples of light a photosite gathers for corrections to wave optics: a blur radius lies between two."""
    reach_px = (correction_reach_px(radius) for radius in psf.corrected_px)
    return max((2.0 * (2 * reach + 1) ** 2 for reach in reach_px), default=0.0)


def reaching_kernels(psf: FieldPsf) -> float:
    """Return how many kernels by distance reach a photosite, of a scene whose blur radius varies evenly across the sensor.

    Cubics take four slabs around each radius.
    """
    core = psf.core
    assert core is not None  # else the host transforms the light
    seen = min((2 * core.reach_px + PART_PX) / psf.sensor_px[0], 1.0)
    columns = min(psf.nodes[1], 2)  # of nodes beside a photosite; their rows are mixed
    return columns * min(CUBIC + (len(psf.radii_px) - CUBIC) * seen, len(psf.radii_px))


def core_taps(psf: FieldPsf) -> float:
    """Return how many taps a kernel by distance has, on average over its slabs.

    It reaches as far as geometric rays do; in scenes that are not smooth, also as what the tail in focus leaves of it shows.
    """
    return _core_taps(Keyed((*psf.key, psf.core, psf.seen), psf))


@lru_cache(maxsize=32)
def _core_taps(of: Keyed) -> float:
    psf, core, seen, lens = of.psf, of.psf.core, of.psf.seen, of.psf.lens_psf
    assert core is not None and seen is not None and isinstance(lens, WavefrontPsf)  # plan_slabs
    tail, most, least_px = slab_tail(psf, seen, 0, core.cell_px), SHOWN_SHARE * seen.allowed_dark, 0
    if not seen.is_smooth:
        shown_px = (reach_px for reach_px in REACHES_PX if seen.error(tail.beyond(reach_px)) <= most)
        least_px = min(next(shown_px, core.reach_px), core.reach_px)
    lies = lens.aberrations, lens.f_number, lens.pitch_um, lens.wavelengths_nm
    some_px = psf.radii_px[0], psf.radii_px[len(psf.radii_px) // 2], psf.radii_px[-1]
    across = [kernel_size_px(*lies, (radius_px,), airy_margin=0.0) for radius_px in some_px]
    return float(np.mean(np.clip(across, 2 * least_px + 1, 2 * core.reach_px + 1) ** 2.0))


def core_bytes(psf: FieldPsf, channels: int, rows: int) -> int:
    """Return the memory of the kernels by distance of all slabs and nodes, without those for highlights.

    rows: most node rows of a band, which alone are laid out for the device where all are many. Mirror images are made then.
    """
    every = 4 * len(psf.radii_px) * math.prod(psf.nodes) * channels * core_taps(psf)
    own = [(count + 1) // 2 / count if psf.has_mirrored_nodes else 1.0 for count in psf.nodes]
    laid_out = 1.0 if every <= MOST_HELD else min(rows / psf.nodes[0], 1.0)
    return int(every * (math.prod(own) + laid_out))
