"""What a plan says of the light over time: shutter, flicker and flash."""

from simulator.exposure.exposed_light import ExposedLight
from simulator.pipeline.step import Step


def time_steps(exposed: ExposedLight) -> list[Step]:
    """Steps of shutter, flicker and flash, with the range of what lines collect."""
    own, *flashes = exposed.components
    least = own.most * float(own.shares.min())
    spread = f"{own.most:.6g}" if own.shares.min() == 1.0 else f"{least:.6g} to {own.most:.6g}"
    collected = "all lines collect as much light" if exposed.is_plain else f"lines collect {spread} of the nominal exposure"
    steps = [Step("shutter", not exposed.is_plain, f"{exposed.shutter_text}; {collected}")]
    flicker = exposed.flicker_text
    steps.append(Step("flicker", flicker is not None, flicker or "the light is steady"))
    flash = exposed.flash_text
    if flashes:
        reached = float((flashes[0].shares > 0.5).mean())
        flash = f"{flash}; {100 * reached:.3g} % of the lines get more than half of what the best gets"
    steps.append(Step("flash", bool(flashes), flash or "none is fired"))
    return steps
