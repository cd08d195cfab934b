"""What other shots use again of a shot's light, and what they then cost, as `explain` prints it."""

from simulator.pipeline.light_cache import LIGHT_MB, LightCache
from simulator.pipeline.planner import Plan

ONCE = ("sensor", "truth")  # passes of each shot whose light is there


def describe_reuse(planned: Plan) -> str:
    """Return which shots of a sweep or of `simulate_many` use this light again, the memory that holds it, and their times."""
    if len(planned.strips) > 1:
        return f"a frame of {len(planned.strips)} strips shares scene and plan with other shots, but not its light"
    optics = planned.optics
    what = "ISO, seeds, gain, bit depth or noise"
    if optics.defocus is None and optics.psf is None:
        what += ", shutter time or aperture"
    held, room = 4 * optics.window.width * optics.window.height, LightCache().memory_bytes
    if held > room:
        return f"the light takes {1e-6 * held:.0f} MB and is not held in {1e-6 * room:.0f} MB (${LIGHT_MB})"
    later_ms = sum(one.cost_ms for one in planned.passes if one.name in ONCE or one.name.startswith("truth: "))
    return (
        f"shots of a sweep that differ only in {what} use this light again, {1e-6 * held:.0f} MB of {1e-6 * room:.0f} MB "
        f"(${LIGHT_MB}): about {later_ms:.3g} ms each after {planned.cost_ms():.3g} ms for the first"
    )
