"""How long the paths of what moves in a shot are needed: told from its settings, before its scene is read."""

from simulator.exposure.exposed_light import plan_exposure
from simulator.pipeline.shot import Shot


def motion_span(shot: Shot) -> tuple[float, float] | None:
    """Return the first and last time of the clock at which a shot needs the paths of its motion [s]; None: nothing moves.

    Where the camera chooses the time, that is the release. Raises PhotositeError for a shutter that the shot cannot have.
    """
    motion, exposure, lens = shot.motion, shot.exposure, shot.lens
    if motion is None:
        return None
    if exposure.time_s == 0.0:
        return exposure.start_s, exposure.start_s
    exposed = plan_exposure(exposure, shot.camera, lens.f_number, lens.diffraction_f_number)
    return motion.needed_span(exposure.start_s, exposed.openings, "flow" in shot.truth)
