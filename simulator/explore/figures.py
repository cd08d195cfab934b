"""The numbers beside the picture: lens, exposure and shutter of a planned shot, as plain data for the page's diagrams."""

import math
from typing import Any

import numpy as np

from simulator.exposure.camera_motion import SteadyMotion
from simulator.optics.lens.perspective import crop_factor
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.cfa import Cfa, CfaName
from simulator.sensor.sensor_plan import SensorPlan

CURVE_POINTS = 97  # distances at which the blur circle is drawn
LINES_SHOWN = 9  # of the sensor, in the diagram of the shutter

Data = dict[str, Any]


def figures_of(shot: Shot, planned: Plan, sensor: SensorPlan) -> Data:
    """Return numbers of a shot by topic, in the units of their names; None stands for infinity and for what there is not.

    lens: of a thin lens: Gauss's equation, field of view, depth of field, blur circle over distance. exposure: luminous
    exposure and electrons of a white surface, exposure value. shutter: when lines open and close. motion: of a camera that
    turns at constant speed, the way of the image on the axis. sensor: format, photosites.
    planned: of the shot or its preview. sensor: of the shot.
    """
    return {
        "lens": _lens(shot),
        "exposure": _exposure(shot, planned, sensor),
        "shutter": _shutter(planned),
        "motion": _motion(shot),
        "sensor": {
            "name": f"{shot.camera.make} {shot.camera.model}",
            "width_mm": shot.camera.sensor_mm[0],
            "height_mm": shot.camera.sensor_mm[1],
            "width_px": shot.camera.frame.width,
            "height_px": shot.camera.frame.height,
            "pixel_pitch_um": shot.camera.pixel_pitch_um,
        },
    }


def finite(value: float) -> float | None:
    """Return a number that JSON can hold, None for any other."""
    return float(value) if math.isfinite(value) else None


def color_names(cfa: CfaName) -> str:
    """Return the letter of each colour plane of a filter pattern; M without a filter."""
    return "M" if cfa == "MONO" else Cfa.named(cfa).letters


def _lens(shot: Shot) -> Data | None:
    """Return the lens's numbers (Gauss 1841; depth of field as `ThinLens` has it); None for what is no thin lens."""
    lens, sensor_mm = shot.lens, shot.camera.sensor_mm
    if not isinstance(lens, ThinLens):
        return None
    diagonal_mm = math.hypot(*sensor_mm)
    circle_um = lens.circle_um(diagonal_mm)
    near_m, far_m = lens.depth_of_field_m(circle_um)
    distances_m = np.geomspace(max(1.05e-3 * lens.focal_length_mm, 0.1), 100.0, CURVE_POINTS)
    return {
        "focal_length_mm": lens.focal_length_mm,
        "f_number": lens.f_number,
        "pupil_diameter_mm": lens.pupil_diameter_mm,
        "image_distance_mm": lens.image_distance_mm,
        "focus_distance_m": finite(lens.focus_distance_m),
        "magnification": lens.magnification,
        "field_of_view_deg": [lens.field_of_view_deg(extent_mm) for extent_mm in (*sensor_mm, diagonal_mm)],
        "crop_factor": crop_factor(diagonal_mm),
        "focal_length_35mm_mm": lens.focal_length_35mm_mm(diagonal_mm),
        "f_number_35mm": lens.f_number_35mm(diagonal_mm),
        "circle_of_confusion_um": circle_um,
        "near_m": finite(near_m),
        "far_m": finite(far_m),
        "hyperfocal_m": lens.hyperfocal_m(circle_um),
        "airy_diameter_um": lens.airy_diameter_um(),
        "blur_at_infinity_um": 2.0 * abs(float(lens.blur_radius_um(math.inf))),
        "distances_m": distances_m.tolist(),
        "blur_diameter_um": (2.0 * np.abs(lens.blur_radius_um(distances_m))).tolist(),
    }


def _exposure(shot: Shot, planned: Plan, sensor: SensorPlan) -> Data:
    """Return exposure value, and luminous exposure and electrons of a white surface where the scene states its luminance."""
    exposure = shot.exposure
    white = grey_patch(shot, planned.optics.scene, 1.0, planned.exposed.components[0].most)
    names = color_names(shot.camera.cfa)
    has_lens = math.isfinite(shot.lens.f_number)
    return {
        "time_s": exposure.time_s,
        "iso": exposure.iso,
        "exposure_value": math.log2(shot.lens.f_number**2 / exposure.time_s) if has_lens else None,
        "white_exposure_lx_s": None if white is None else white.exposure_lx_s,
        "white_electrons": None if white is None else dict(zip(names, map(float, white.electrons), strict=True)),
        "full_scale_e": sensor.electrons_at_white(),
        "gain_dn_per_e": sensor.gain_dn_per_e(),
        "dark_noise_e": math.sqrt(sensor.moments(0.0).variance) / sensor.gain_dn_per_e(),
    }


def _shutter(planned: Plan) -> Data:
    """Return when some lines of the sensor open and close, from the release on [s]."""
    lines = planned.exposed.components[0].openings[0]
    shown = np.unique(np.linspace(0, len(lines.peak) - 1, LINES_SHOWN).round().astype(int))
    return {
        "axis": lines.axis,
        "lines": shown.tolist(),
        "total_lines": len(lines.peak),
        "opens_s": lines.opens_s[shown].tolist(),
        "open_s": lines.open_s[shown].tolist(),
        "closes_s": lines.closes_s[shown].tolist(),
        "closed_s": lines.closed_s[shown].tolist(),
    }


def _motion(shot: Shot) -> Data | None:
    """Return the way of the image on the axis while the shutter is open, s = omega z_i t [photosites]; None where it rests."""
    path = None if shot.motion is None else shot.motion.camera
    if not isinstance(path, SteadyMotion) or not math.isfinite(shot.lens.image_distance_mm):
        return None
    speed_rad_per_s = math.radians(math.hypot(path.pan_deg_per_s, path.tilt_deg_per_s))
    speed_px_per_s = 1e3 * shot.lens.image_distance_mm / shot.camera.pixel_pitch_um * speed_rad_per_s
    if speed_px_per_s == 0.0:
        return None
    return {"speed_px_per_s": speed_px_per_s, "way_px": speed_px_per_s * shot.exposure.time_s}
