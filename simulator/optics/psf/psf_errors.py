"""Predicts the error of the point spread function as it is planned."""

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.error_term import ErrorTerm, Skipped
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling

PSF = "point spread function"  # effect of the terms
TIGHTER = "give a smaller tolerance"
DIVIDED = "give a scene of 1, 2 or 4 pixels per photosite that begin at its border"
BLURRED = "it is gone without camera.low_pass and camera.fill_factor, or where nothing is in focus"


def psf_errors(
    psf: FieldPsf | None,
    skipped: Skipped | None,
    accuracy: Accuracy,
    smallest_px: float | None = None,
    contrast: float = 1.0,
    sampling_error: float = 0.0,
) -> list[ErrorTerm]:
    """Return the errors of a kernel, of the light that it is applied to, or of leaving it out.

    skipped: why there is none; None: there is one. smallest_px: radius of the smallest blur circle, of a geometric blur that
    comes first; None: none does. contrast: second difference of the light between photosites, as a share of the brightest.
    sampling_error: of the light that kernels by distance are applied to, the same.
    """
    if skipped is not None:
        return [ErrorTerm(PSF, "none, since its effect is small", skipped.sigma, TIGHTER, falls=True)]
    if psf is None:
        return []
    found = []
    if psf.core is not None:
        found.append(ErrorTerm(PSF, "a core and a tail on cells", accuracy.in_sigma(psf.core.error), TIGHTER, falls=True))
    if smallest_px is not None and not psf.by_distance and psf.over == 1 and psf.sampling != Sampling():
        error = accuracy.in_sigma(contrast * photosite_light_error(smallest_px))
        found.append(
            ErrorTerm(PSF, "light of whole photosites behind a blur, which a low-pass or open area divides", error, BLURRED)
        )
    if sampling_error > 0.0:
        cause = f"{psf.over} x {psf.over} samples of light per photosite, which mix pixels of the scene"
        found.append(ErrorTerm(PSF, cause, accuracy.in_sigma(sampling_error), DIVIDED))
    return found


def photosite_light_error(radius_px: float) -> float:
    """Error of a low-pass filter or a fill factor that is applied to means over whole photosites behind a blur circle.

    A share of the contrast. It bounds 99.9 % of the photosites of random squares of 1.5 and 0.75 photosites, for spots half a
    photosite and more apart and fill factors from 0.44 on: what is finer than the photosites cannot be told from their means.
    """
    return min(0.21, 0.025 * max(radius_px, 1e-3) ** -1.45)
