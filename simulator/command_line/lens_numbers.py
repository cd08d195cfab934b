"""What a lens amounts to, in numbers with their formulas."""

import math
from functools import singledispatch

import numpy as np

from simulator.command_line.shot_numbers import Fact
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.perspective import GREEN_NM, crop_factor
from simulator.optics.lens.pinhole import RAYLEIGH, SHARPEST, Pinhole
from simulator.optics.lens.thin_lens import CIRCLES_PER_DIAGONAL, ThinLens
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.irradiance import Irradiance

BLOCK_PX = 2.0  # a blur circle within one 2x2 block of the filter mosaic cannot be seen in the raw file


def lens_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Geometry, depth of field, blur and light gathering of the shot's lens."""
    return [*_facts(shot.lens, shot, planned), *_filter_facts(shot.lens)]


def _filter_facts(lens: Lens) -> list[Fact]:
    """Grey filter before the lens; nothing without one."""
    if lens.nd_filter is None:
        return []
    share = lens.nd_filter.transmittance
    formula = f"10^-D, D = {-math.log10(share):.4g}: {100 * share:.4g} % of the light passes"
    return [Fact("ND filter", f"{-math.log2(share):.3f} stops", formula)]


@singledispatch
def _facts(lens: Lens, shot: Shot, planned: Plan) -> list[Fact]:
    """Facts of one kind of lens; each kind is registered below."""
    raise NotImplementedError(type(lens).__name__)


@_facts.register
def _bare_sensor_facts(lens: BareSensor, shot: Shot, planned: Plan) -> list[Fact]:
    formula = "pi, of a hemisphere of one radiance; the notes say how much of it the scene fills"
    return [Fact("irradiance per radiance", f"{lens.irradiance_per_radiance_sr():.6g} sr", formula)]


@_facts.register
def _pinhole_facts(lens: Pinhole, shot: Shot, planned: Plan) -> list[Fact]:
    pitch_um = shot.camera.pixel_pitch_um
    at = f"at {GREEN_NM:g} nm"
    advised = f"half of the light in the smallest circle: {SHARPEST:.3f} sqrt(lambda v) {at}"
    return [
        Fact("hole", f"{lens.diameter_mm:g} mm", "d"),
        Fact("image distance", f"{lens.distance_mm:g} mm", "v, hole to sensor"),
        *perspective_facts(lens, shot.camera.sensor_mm),
        *_blur_facts(lens, planned.optics, pitch_um, "d (1 + v / z)"),
        Fact("Airy disk", size(lens.airy_diameter_um(), pitch_um), f"2.44 lambda N {at}, N = v / d = {lens.f_number:.4g}"),
        Fact("sharpest hole", f"{lens.sharpest_diameter_mm():.3f} mm", advised),
        Fact("sharpest, Rayleigh", f"{lens.sharpest_diameter_mm(constant=RAYLEIGH):.3f} mm", f"{RAYLEIGH} sqrt(lambda v) {at}"),
        Fact("irradiance per radiance", f"{lens.irradiance_per_radiance_sr():.4g} sr", "pi / (1 + 4 N^2)"),
        _corner_fact(shot.camera, planned.sensor.irradiance),
    ]


@_facts.register
def _thin_lens_facts(lens: ThinLens, shot: Shot, planned: Plan) -> list[Fact]:
    pitch_um = shot.camera.pixel_pitch_um
    diagonal_mm = math.hypot(*shot.camera.sensor_mm)
    return [
        Fact("focal length", f"{lens.focal_length_mm:g} mm", "f"),
        Fact("pupil diameter", f"{lens.pupil_diameter_mm:.3f} mm", "A = f / N"),
        Fact("image distance", f"{lens.image_distance_mm:.3f} mm", "1/f = 1/z_i + 1/z_o"),
        Fact("magnification", f"{lens.magnification:.5f}", "m = z_i / z_o"),
        *perspective_facts(lens, shot.camera.sensor_mm),
        *_depth_facts(lens, diagonal_mm, pitch_um),
        *_blur_facts(lens, planned.optics, pitch_um, "C = A z_i |1/z_focus - 1/z|"),
        Fact("Airy disk", size(lens.airy_diameter_um(), pitch_um), f"2.44 lambda N_w at {GREEN_NM:g} nm"),
        Fact("working f-number", f"f/{lens.working_f_number:.4g}", "N_w = N (1 + m)"),
        Fact("T-stop", f"T/{lens.t_number:.4g}", f"T = N / sqrt(tau), tau = {lens.effective_transmittance:.4g}"),
        Fact("irradiance per radiance", f"{lens.irradiance_per_radiance_sr():.6g} sr", _irradiance_formula(lens.irradiance)),
        _corner_fact(shot.camera, planned.sensor.irradiance),
    ]


def perspective_facts(lens: ThinLens | Pinhole, sensor_mm: tuple[float, float]) -> list[Fact]:
    """Field of view, and what sees and gathers the same on 36 mm x 24 mm."""
    diagonal_mm = math.hypot(*sensor_mm)
    across, down, diagonal = (lens.field_of_view_deg(extent) for extent in (*sensor_mm, diagonal_mm))
    same = f"{lens.focal_length_35mm_mm(diagonal_mm):.1f} mm f/{lens.f_number_35mm(diagonal_mm):.3g}"
    return [
        Fact("field of view", f"{across:.2f} deg x {down:.2f} deg, diagonal {diagonal:.2f} deg", "2 atan(extent / 2 z_i)"),
        Fact("35 mm equivalent", same, f"f and N times the crop factor 43.27 mm / diagonal = {crop_factor(diagonal_mm):.3f}"),
    ]


def _depth_facts(lens: ThinLens, diagonal_mm: float, pitch_um: float) -> list[Fact]:
    circle_um, block_um = lens.circle_um(diagonal_mm), BLOCK_PX * pitch_um
    default, formula = lens.circle_of_confusion_um is None, f"diagonal / {CIRCLES_PER_DIAGONAL:g} (Lyon 2006)"
    return [
        Fact("circle of confusion", size(circle_um, pitch_um), formula if default else "as stated"),
        Fact("depth of field", _range(lens.depth_of_field_m(circle_um)), "1/z = 1/z_focus +- C / (A z_i)"),
        Fact("depth of field, raw", _range(lens.depth_of_field_m(block_um)), f"the same, C = {BLOCK_PX:g} photosites"),
        Fact("hyperfocal distance", metres(lens.hyperfocal_m(circle_um)), "f^2 / (N C) + f"),
    ]


def _blur_facts(lens: ThinLens | Pinhole, optics: OpticsPlan, pitch_um: float, formula: str) -> list[Fact]:
    """Blur circle at infinity and at the scene's nearest and farthest place."""
    depths_m = [layer.depth_m for layer in optics.scene.layers]
    near_m, far_m = min(float(np.min(depth_m)) for depth_m in depths_m), max(float(np.max(depth_m)) for depth_m in depths_m)
    distances = {f"at {metres(distance)}": distance for distance in (near_m, far_m, math.inf)}
    return [
        Fact(f"blur circle {where}", size(2.0 * abs(float(lens.blur_radius_um(distance))), pitch_um), formula)
        for where, distance in distances.items()
    ]


def _corner_fact(camera: Camera, stage: Irradiance) -> Fact:
    share = stage.relative_illumination(0.5 * math.hypot(camera.width_px, camera.height_px))
    factors = ["cos^4 of the field angle"] * (stage.tan2_per_px2 > 0) + ["open share of the pupil"] * bool(stage.vignetting)
    stops = f", {math.log2(share):.2f} stops" if 0 < share < 1 else ""
    return Fact("light in the corner", f"{100 * share:.2f} %{stops}", " * ".join(factors) or "as on the axis")


def size(diameter_um: float, pitch_um: float) -> str:
    """A diameter in micrometres and in photosites."""
    return f"{diameter_um:.4g} um, {diameter_um / pitch_um:.2f} photosites"


def metres(distance_m: float) -> str:
    """A distance; infinity in words."""
    return "infinity" if math.isinf(distance_m) else f"{distance_m:#.4g} m"


def _range(limits_m: tuple[float, float]) -> str:
    return " to ".join(map(metres, limits_m))


def _irradiance_formula(kind: str) -> str:
    return "pi tau / (1 + 4 N_w^2)" if kind == "thin_lens" else "pi tau / (4 N_w^2)"
