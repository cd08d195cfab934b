"""Signal of a white surface: luminous exposure, electrons and codes, with formulas."""

import math
from dataclasses import dataclass

from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.sensor.sensor_plan import SensorPlan


@dataclass(frozen=True)
class Fact:
    """A quantity, its value with unit, and the formula it comes from."""

    quantity: str
    value: str
    formula: str


def white_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Luminous exposure, electrons and codes of a white surface that has the scene's stated luminance."""
    collected = planned.exposed.components[0].most
    white = grey_patch(shot, planned.optics.scene, 1.0, collected)
    if white is None:
        return [Fact("luminance", "not stated", "the scene gives absolute radiance")]
    sensor = planned.sensor
    full_e = sensor.electrons_at_white()
    facts = [
        Fact("luminance", f"{white.luminance_cd_m2:g} cd/m^2", "L"),
        Fact("illuminance on the sensor", f"{white.illuminance_lx:.4g} lx", "E = L * irradiance per radiance"),
        Fact(
            "luminous exposure",
            f"{white.exposure_lx_s:.4g} lx s",
            "H = E t" if collected == 1.0 else f"H = E t * {collected:.4g}, see shutter and flicker",
        ),
    ]
    for color, mean in zip(("red", "green", "blue") if len(white.electrons) == 3 else ("mono",), white.electrons, strict=True):
        facts.append(Fact(f"electrons, {color}", f"{mean:.1f} e-", _describe_headroom(sensor, float(mean), full_e)))
    facts.append(Fact("clipping", f"{full_e:.0f} e-", f"gain {sensor.gain_dn_per_e():.5g} DN/e- at ISO {shot.exposure.iso}"))
    return facts


def _describe_headroom(sensor: SensorPlan, mean_e: float, full_e: float) -> str:
    """Stops to the clipping point and, below it, the signal-to-noise ratio."""
    if full_e == 0.0:
        return "dark current alone reaches white"
    stops = math.log2(full_e / mean_e) if mean_e > 0 else math.inf
    if stops <= 0:
        return f"{-stops:.2f} stops above clipping"
    moments = sensor.moments(mean_e)
    noise = math.sqrt(moments.variance)  # never 0: the ADC rounds
    return f"{stops:.2f} stops below clipping, SNR {(moments.mean - sensor.moments(0.0).mean) / noise:.1f}"
