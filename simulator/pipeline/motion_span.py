"""How long the paths of what moves in a shot are needed: told from its settings, before its scene is read."""

from simulator.exposure.exposed_light import plan_exposure
from simulator.exposure.later_exposures import later_exposures
from simulator.pipeline.shot import Shot


def motion_span(shot: Shot) -> tuple[float, float] | None:
    """Return the first and last time of the clock at which a shot needs the paths of its motion [s]; None: nothing moves.

    Where the camera chooses the time, that is the release. A frame of several exposures needs them until the last ends. Raises
    PhotositeError for a shutter or a flash that the shot cannot have.
    """
    motion, exposure, lens = shot.motion, shot.exposure, shot.lens
    if motion is None:
        return None
    if exposure.time_s == 0.0:
        return exposure.start_s, exposure.start_s
    spans = []
    for one in (exposure, *later_exposures(exposure, shot.camera)):
        exposed = plan_exposure(one, shot.camera, lens.f_number, lens.diffraction_f_number)
        spans.append(motion.needed_span(one.start_s, exposed.openings, "flow" in shot.truth))
    return min(first for first, _ in spans), max(last for _, last in spans)
