"""The work of a frame behind a point spread function, by which its time is predicted."""

import math

from simulator.optics.geometry.projection_cost import projection_work
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.psf_bands import TILE_COLUMNS, TILE_ROWS, split_into_bands
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.psf_cost import Work, correction_work, gather_work, kernel_work, transform_work


def gathered_work(optics: OpticsPlan, psf: FieldPsf) -> Work:
    """Return the work of a window that the device gathers: whole tiles, and the samples of bands with their margins."""
    pixels, samples = _in_bands(optics, psf)
    found = gather_work(psf, pixels) | kernel_work(psf, optics.channels)
    layers, planes = len(optics.scene.layers) if optics.has_coverage else 1, optics.channels + optics.has_coverage
    if psf.is_gathered_by_distance:  # layers with coverage are projected once more for the tail
        projected = samples * layers * planes * (1 + optics.has_coverage)
    elif optics.defocus is None or psf.by_distance:  # by one kernel of all distances
        projected = samples * optics.channels
    else:
        found["copies"] = samples * optics.channels
        projected = samples * layers * planes * bool(psf.corrected_px)
    return found | projection_work(psf.sampled(optics.projection), psf.over, projected)


def transformed_work(optics: OpticsPlan, psf: FieldPsf) -> Work:
    """Return the work of a window that the host transforms, whose samples the device projects where no blur comes first."""
    found = transform_work(psf, optics.window.width, optics.window.height, optics.channels) | kernel_work(psf, optics.channels)
    each = found["samples"] / len(psf.radii_px) / optics.channels
    layers, planes = len(optics.scene.layers) if optics.has_coverage else 1, optics.channels + optics.has_coverage
    if optics.defocus is not None and not psf.by_distance:
        if not psf.corrected_px:
            return found
        pixels, each = _in_bands(optics, psf)
        found |= correction_work(psf, pixels)
    return found | projection_work(psf.sampled(optics.projection), psf.over, each * layers * planes)


def _in_bands(optics: OpticsPlan, psf: FieldPsf) -> tuple[int, float]:
    """Photosites of the tiles of all bands, and samples of one plane of the bands with their margins."""
    bands = split_into_bands(optics.window, psf.gather_reach_px, psf.over)
    pixels = TILE_ROWS * TILE_COLUMNS * sum(len(band.tiles) for band in bands)
    return pixels, float(len(bands) * math.prod(bands[0].layout.shape(1)))
