"""Predicts the error of the point spread function as it is planned."""

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.error_term import ErrorTerm, Skipped
from simulator.optics.psf.field_psf import FieldPsf

PSF = "point spread function"  # effect of the terms
TIGHTER = "give a smaller tolerance"


def psf_errors(psf: FieldPsf | None, skipped: Skipped | None, accuracy: Accuracy) -> list[ErrorTerm]:
    """Return the error of a kernel that is gathered with a core and a tail. skipped: why there is none; None: there is one."""
    if skipped is not None:
        return [ErrorTerm(PSF, "none, since its effect is small", skipped.sigma, TIGHTER)]
    if psf is None or psf.core is None:
        return []
    return [ErrorTerm(PSF, "a core and a tail on cells", accuracy.in_sigma(psf.core.error), TIGHTER)]
