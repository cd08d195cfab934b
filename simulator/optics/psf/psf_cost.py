"""Predicts the time of a planned point spread function from the work that it does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

import math
from collections.abc import Mapping

from simulator.optics.geometry.projection import Projection
from simulator.optics.psf.field_psf import FieldPsf, correction_reach_px
from simulator.optics.psf.lamps import Lamps, lie_alike

COST_NS = {
    "gathers": 1.2e6,  # of a frame that the device gathers: launches and kernels
    "corrections": 5.0e6,  # of a frame whose blur is corrected to wave optics, or that is gathered by distance: their kernels
    "light": 15.0,  # for each photosite
    "taps": 0.08,  # for each photosite and sample of light that it gathers
    "transforms": 1.2e6,  # of a frame that the host transforms
    "lamps": 20.0,  # for each photosite of the image of a lamp
    "samples": 22.0,  # for each sample of a frame with its margins, colour and slab of blur radius that is transformed
}

INTERPOLATED = 6.0  # times the work of a lamp whose image is computed for its own place, in each colour

Work = dict[str, float]  # counts, by key of COST_NS


def cost_ms(work: Mapping[str, float]) -> float:
    """Return the predicted time of some work [ms]."""
    return 1e-6 * sum(COST_NS[name] * count for name, count in work.items())


def psf_work(psf: FieldPsf, width_px: int, height_px: int, channels: int) -> Work:
    """Return the work of a window of so many photosites."""
    if psf.core is None:
        side = 2 * psf.reach_px
        samples = (width_px + side) * (height_px + side) * psf.over**2 * channels * len(psf.radii_px)
        return {"transforms": 1.0, "samples": float(samples)}
    pixels = float(width_px * height_px)
    extra = float(bool(psf.corrected_px) or psf.is_gathered_by_distance)
    return {"gathers": 1.0, "corrections": extra, "light": pixels, "taps": pixels * gathered_samples(psf)}


def lamp_work(psf: FieldPsf, projection: Projection, lamps: Lamps, channels: int) -> Work:
    """Return the work of drawing all lamps of a scene."""
    side = 2.0 * (psf.reach_px + math.ceil(1.0 / projection.scale)) + 1.0
    times = 1.0 if lie_alike(projection) else INTERPOLATED * channels
    return {"lamps": lamps.count * times * side**2}


def gathered_samples(psf: FieldPsf) -> float:
    """Return how many samples of light a photosite gathers through the kernels of a PSF with a core."""
    core = psf.core
    assert core is not None  # else the host transforms the light
    taps = float((psf.over * (2 * core.reach_px + 1)) ** 2)
    if core.arm_px > core.reach_px:
        taps += 4 * core.arm_px
    if core.has_tail:
        taps += 32 * (psf.reach_px / core.cell_px**2) ** 2
    taps *= 4 if psf.nodes != (1, 1) else 1
    if psf.corrected_px:
        taps += 2 * (2 * max(correction_reach_px(radius) for radius in psf.corrected_px) + 1) ** 2
    return 2 * taps if psf.is_gathered_by_distance else taps
