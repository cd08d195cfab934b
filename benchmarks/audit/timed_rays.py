"""Plans of the reference path whose rays carry instants, in place of images of many instants whose rays are the same."""

from dataclasses import replace

from simulator.optics.geometry.motion_plan import Timing
from simulator.optics.motion_planning import can_join, with_joint_motion
from simulator.optics.passes.reference_mosaic import light_limit
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot


def with_timed_rays(planned: Plan, shot: Shot) -> Plan:
    """Return the plan of a shot at `tolerance: 0` with rays that carry instants; the plan itself where they cannot.

    Their error is seen in the scatter of independent sets of rays, as that of places in the pupil is. Lamps send rays of their
    own in images at rest, so that instants are fewer than the rays that would meet them.
    """
    optics = planned.optics
    if not optics.moves_pixels or optics.defocus is None or shot.motion is None:
        return planned
    has_lamps = light_limit(optics.scene, optics.weights) is not None
    if has_lamps or not can_join(optics, Timing(shot.motion, planned.exposed.components)):
        return planned
    motions, joint = with_joint_motion(optics, optics.scene, [optics.motion, optics.flash_motion], shot.lens, planned.sensor)
    return replace(planned, optics=replace(joint, motion=motions[0], flash_motion=motions[1]))
