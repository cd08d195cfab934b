"""What a lens and an exposure amount to, in numbers with their formulas."""

import math
from dataclasses import dataclass

from simulator.grey_patch import grey_patch
from simulator.planner import Plan
from simulator.shot import Shot

SHARP_DIAMETER_PX = 2.0  # a blur circle within one 2x2 block of the filter mosaic counts as sharp


@dataclass(frozen=True)
class Fact:
    """A quantity, its value with unit, and the formula it comes from."""

    quantity: str
    value: str
    formula: str


def lens_facts(shot: Shot) -> list[Fact]:
    """Field of view, pupil, depth of field and light gathering of the shot's thin lens."""
    lens, camera = shot.lens, shot.camera
    width_mm, height_mm = camera.sensor_mm
    near_m, far_m = depth_of_field_m(shot)
    angles = f"{lens.field_of_view_deg(width_mm):.2f} deg x {lens.field_of_view_deg(height_mm):.2f} deg"
    far_px = abs(2.0 * float(lens.blur_radius_um(math.inf))) / camera.pixel_pitch_um
    diagonal_mm = math.hypot(width_mm, height_mm)
    circle = f"{SHARP_DIAMETER_PX:g} photosites"
    return [
        Fact(
            "focal length", f"{lens.focal_length_mm:g} mm", f"{lens.focal_length_35mm_mm(diagonal_mm):.1f} mm on 36 mm x 24 mm"
        ),
        Fact("pupil diameter", f"{lens.pupil_diameter_mm:.3f} mm", "A = f / N"),
        Fact("image distance", f"{lens.image_distance_mm:.3f} mm", "1/f = 1/z_i + 1/z_o"),
        Fact("magnification", f"{lens.magnification:.5f}", "m = z_i / z_o"),
        Fact("field of view", angles, "2 atan(extent / 2 z_i)"),
        Fact("depth of field", f"{_metres(near_m)} to {_metres(far_m)}", f"blur circle within {circle}"),
        Fact("hyperfocal distance", _metres(hyperfocal_m(shot)), f"f^2 / (N C) + f with C = {circle}"),
        Fact("blur circle at infinity", f"{far_px:.2f} photosites", "C = A |z_s - z_i| / z_i"),
        Fact("irradiance per radiance", f"{lens.irradiance_per_radiance_sr():.5f} sr", _irradiance_formula(lens.irradiance)),
    ]


def hyperfocal_m(shot: Shot) -> float:
    """Focus distance from which everything up to infinity is sharp: f^2 / (N C) + f [m]."""
    lens = shot.lens
    circle_mm = SHARP_DIAMETER_PX * shot.camera.pixel_pitch_um * 1e-3
    return 1e-3 * (lens.focal_length_mm**2 / (lens.f_number * circle_mm) + lens.focal_length_mm)


def depth_of_field_m(shot: Shot) -> tuple[float, float]:
    """Nearest and farthest distance [m] whose blur circle is at most SHARP_DIAMETER_PX photosites wide.

    The blur is linear in 1/z: C = A z_i |1/z_focus - 1/z|.
    """
    lens = shot.lens
    circle_mm = SHARP_DIAMETER_PX * shot.camera.pixel_pitch_um * 1e-3
    diopters = 1e3 * circle_mm / (lens.pupil_diameter_mm * lens.image_distance_mm)  # 1/mm to 1/m
    focus = 1.0 / lens.focus_distance_m
    return 1.0 / (focus + diopters), (1.0 / (focus - diopters) if focus > diopters else math.inf)


def white_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Luminous exposure, electrons and codes of a white surface that has the scene's stated luminance."""
    white = grey_patch(shot, planned, 1.0)
    if white is None:
        return [Fact("luminance", "not stated", "the scene gives absolute radiance")]
    gain_dn_per_e = planned.moments(1.0).mean - planned.moments(0.0).mean  # of all stages together
    full_e = (planned.white_level_dn() - planned.stage("adc").black_level_dn) / gain_dn_per_e
    facts = [
        Fact("luminance", f"{white.luminance_cd_m2:g} cd/m^2", "L"),
        Fact("illuminance on the sensor", f"{white.illuminance_lx:.4g} lx", "E = L * irradiance per radiance"),
        Fact("luminous exposure", f"{white.exposure_lx_s:.4g} lx s", "H = E t"),
    ]
    for color, mean in zip(("red", "green", "blue") if len(white.electrons) == 3 else ("mono",), white.electrons, strict=True):
        facts.append(Fact(f"electrons, {color}", f"{mean:.1f} e-", _headroom(planned, float(mean), full_e)))
    facts.append(Fact("clipping", f"{full_e:.0f} e-", f"gain {gain_dn_per_e:.5g} DN/e- at ISO {shot.exposure.iso}"))
    return facts


def _headroom(planned: Plan, mean_e: float, full_e: float) -> str:
    """Stops to the clipping point and, below it, the signal-to-noise ratio."""
    stops = math.log2(full_e / mean_e) if mean_e > 0 else math.inf
    if stops <= 0:
        return f"{-stops:.2f} stops above clipping"
    moments = planned.moments(mean_e)
    noise = math.sqrt(moments.variance)  # never 0: the ADC rounds
    return f"{stops:.2f} stops below clipping, SNR {(moments.mean - planned.moments(0.0).mean) / noise:.1f}"


def _irradiance_formula(kind: str) -> str:
    return "pi tau / (1 + 4 N^2 (1 + m)^2)" if kind == "thin_lens" else "pi tau / (4 N^2 (1 + m)^2)"


def _metres(distance_m: float) -> str:
    return "infinity" if math.isinf(distance_m) else f"{distance_m:#.4g} m"
