"""Chooses the samples of light that a point spread function is applied to."""

import math
from collections.abc import Callable
from dataclasses import replace

from simulator.optics.defocus.accuracy import RAY_ERROR, Accuracy
from simulator.optics.geometry.footprint import pixels_read
from simulator.optics.geometry.projection import Projection
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.sampled_light import fit_footprint
from simulator.optics.psf.wavefront_psf import WavefrontPsf

MOST_OVER = 4  # light samples per photosite and axis
KERNEL_SHARE = 0.5  # of the allowed error, for bends within samples that kernels of a lens spread; cores have the rest
MOST_SIDE_PX, MOST_READS = 3.0, 40  # of a footprint [photosites], and pixels of a scene that are read for it along an axis
FOOTPRINT_SHARE = 0.8  # of the tolerance of the photograph, for the same of samples of a footprint


def choose_over(lens_psf: WavefrontPsf | PsfTable | None, sampling: Sampling, scale: float) -> int:
    """Light samples per photosite and axis: as many as scene pixels, where the lens resolves detail finer than photosites."""
    most = MOST_OVER
    if isinstance(lens_psf, PsfTable):
        most = min(most, lens_psf.cells)
    elif lens_psf is not None and lens_psf.cutoff < 0.25:
        return 1
    least = 2 if sampling.fill_factor < 1.0 else 1
    return min(max(round(scale), least), most)


def has_squares(psf: FieldPsf, projection: Projection) -> bool:
    """Whether samples of light are even squares behind the optics of a lens: where they are those of the scene.

    Others are means over several of its pixels, those behind the blur of geometry have no edges, and a table in whole
    photosites does not tell what is finer.
    """
    are_squares = projection.has_square_pixels and projection.whole_pixels((psf.over,)) == psf.over and not psf.footprints
    is_coarse = isinstance(psf.lens_psf, PsfTable) and psf.lens_psf.cells == 1
    return are_squares and psf.by_distance and not is_coarse


def with_samples(
    psf: FieldPsf,
    projection: Projection,
    accuracy: Accuracy,
    sampling_error: Callable[[FieldPsf], float],
    channels: int,
    whole: float | None,
    *,
    apart: bool,
) -> FieldPsf:
    """Return the PSF over the cheapest samples of the scene's light that keep their part of the allowed error.

    That is KERNEL_SHARE of it, and FOOTPRINT_SHARE of the tolerance of the photograph for samples of a footprint, beside which
    other approximations cost little; or the error of the reference's rays. Those with the least error where none do.
    sampling_error: of `plan_visible_psf`. whole: that tolerance; None: samples have no footprint, but are squares or means.
    apart: whether each channel has a footprint of its own; coverage of layers has one for all.
    """
    rays = RAY_ERROR * accuracy.sigma
    most = min(psf.lens_psf.cells if isinstance(psf.lens_psf, PsfTable) else MOST_OVER, MOST_OVER)
    reads = pixels_read(0.5 * MOST_SIDE_PX, projection.scale, is_tent=True)
    whole = whole if projection.fits_footprint and most > 1 and reads <= MOST_READS else None
    found, least = psf, math.inf
    for over in range(psf.over if whole is None else 1, max(psf.over, most) + 1):
        way, allowed = replace(psf, over=over), KERNEL_SHARE * accuracy.allowed
        if whole is not None and not has_squares(way, projection):
            if over % 2 == 0:  # an odd one lies in the middle of the photosite, in whose light what aliases has its own sign
                continue
            which, is_tent = [[one] for one in range(channels)] if apart else [range(channels)], projection.is_bilinear
            footprints = tuple(fit_footprint(way, own, projection.scale, is_tent=is_tent) for own in which)
            way, allowed = replace(way, footprints=footprints), FOOTPRINT_SHARE * whole * accuracy.sigma
        error = sampling_error(way)
        if error <= max(allowed, rays):
            return way
        if error < least:
            found, least = way, error
    return found
