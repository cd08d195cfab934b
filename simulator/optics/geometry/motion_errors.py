"""Predicts the error of the image's motion as it is planned."""

from typing import TYPE_CHECKING

from simulator.optics.error_term import ErrorTerm, Skipped
from simulator.optics.geometry.instants import MOST_INSTANTS

if TYPE_CHECKING:
    from simulator.optics.geometry.motion_plan import MotionPlan

MOTION = "motion blur"  # effect of the terms
STILL = "give a smaller tolerance"
SHORTER = "give a shorter exposure.time"
FINER = "give a scene of more pixels, or tolerance: 0 for rays"
FLAT = "turn the camera instead of moving it, give layers with one distance each, or tolerance: 0 for rays"


def motion_errors(motion: "MotionPlan | None", skipped: Skipped | None, sigma: float) -> list[ErrorTerm]:
    """Return the error of the instants of a motion, or of leaving it out. skipped: why it is; None: it is not.

    sigma: one standard deviation of the noise, as a share of the brightest light.
    """
    if skipped is not None:
        return [ErrorTerm(MOTION, "none, since nothing moves far", skipped.sigma, STILL, falls=True)]
    if motion is None:
        return []
    missed = []
    if motion.missed_error:
        cells, fastest_hz = len(motion.path.light), motion.path.motion.fastest_hz
        cause = f"{cells} straight pieces of a path that may change at {fastest_hz:.3g} Hz"
        missed = [ErrorTerm(MOTION, cause, motion.missed_error / sigma, SHORTER)]
    if motion.method == "joint":  # whose other error is that of the blur
        return missed
    how = "a straight path" if motion.is_exact else f"{motion.count} instants on a path"
    cause = f"{how} of {motion.length.longest_px:.3g} photosites"
    if motion.blur is not None and motion.blur.slope:
        cause += f", blur radii of its middle, which change by {motion.blur.slope:.2g} from photosite to photosite"
    found = [*missed, ErrorTerm(MOTION, cause, motion.error / sigma, SHORTER, falls=motion.count < MOST_INSTANTS)]
    if motion.parallax_error:
        cause = "all of a surface moves as its nearest place"
        found.append(ErrorTerm(MOTION, cause, motion.parallax_error / sigma, FLAT))
    if motion.blur is not None and motion.blur.lamp_error:
        found.append(ErrorTerm(MOTION, "edges of the spots of lamps", motion.blur.lamp_error / sigma, FINER))
    return found
