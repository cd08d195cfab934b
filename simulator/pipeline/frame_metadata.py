"""Metadata of a raw frame: levels, noise, colour, lens, and the shot, files and versions that it was made from."""

import platform
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from simulator import __version__
from simulator.color.camera_matrices import as_shot_neutral
from simulator.device import DeviceInfo
from simulator.exposure.exposed_light import plan_exposure
from simulator.exposure.later_exposures import later_exposures
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.motion_truth import pose_facts
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.raw.raw_image import Raw
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_color import matrices_under_two_lights, matrix_under_d65
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.iso_speed import baseline_exposure_ev


def assemble_raw(shot: Shot, planned: Plan, device: DeviceInfo, arrays: Mapping[str, Any]) -> Raw:
    """Return the raw frame of these arrays with its metadata. Raises OSError for a scene's file that has gone.

    arrays: dn, mean_electrons, noise_free_dn, and those of the truth, as `Raw` has them; the second and third may be functions
        that make them when they are first read. Its field `resolved` is one.
    """
    camera, lens, sensor = shot.camera, shot.lens, planned.sensor
    fitted_matrices = matrices_under_two_lights(camera)
    combined = sensor if isinstance(sensor, HdrSensorPlan) else None
    frame = {name: arrays[name] for name in ("dn", "mean_electrons", "noise_free_dn")}
    late: dict[str, Any] = {"resolved": _provenance(shot, planned, device)}
    return Raw(
        **frame,
        **late,
        truth={name: array for name, array in arrays.items() if name not in frame},
        cfa=camera.frame_cfa(),
        bit_depth=camera.bit_depth if combined is None else combined.stored_bits,
        linearization=None if combined is None else combined.decoding,
        black_level_dn=sensor.black_level_dn,
        white_level_dn=sensor.white_level_dn(),
        noise_profile=(sensor.noise_profile(),) * camera.channels,
        gain_dn_per_e=sensor.frame_gain_dn_per_e(),
        dark_noise_dn=sensor.dark_noise_dn(),
        color_matrix=matrix_under_d65(camera),
        color_matrix_a=fitted_matrices.get("color_matrix_a"),
        forward_matrix_d65=fitted_matrices.get("forward_matrix_d65"),
        forward_matrix_a=fitted_matrices.get("forward_matrix_a"),
        as_shot_neutral=neutral_of(planned.optics.scene, camera),
        make=camera.make,
        model=camera.model,
        lens_model=lens.model,
        exposure_time_s=shot.exposure.time_s,
        f_number=lens.f_number,
        focal_length_mm=lens.focal_length_mm,
        focal_length_35mm_mm=lens.focal_length_35mm_mm(float(np.hypot(*camera.sensor_mm))),
        focus_distance_m=lens.focus_distance_m,
        iso=shot.exposure.iso,
        baseline_exposure_ev=baseline_exposure_ev(sensor, shot.exposure.iso),
        name=shot.name,
        black_offsets_dn=sensor.black_offsets_dn() if shot.raw.black_per_place else (0.0,) * 4,
        format=shot.raw,
        date_time=shot.exposure.date_time,
        active_area=sensor.readout.active_area,
        charge_reach_px=sensor.readout.charge_reach_px,
        warp_rectilinear=warp_rectilinear(planned),
    )


def neutral_of(scene: Scene, camera: Camera) -> tuple[float, ...]:
    """Return camera RGB of a white surface in the scene's light, largest = 1 (DNG AsShotNeutral)."""
    response = camera.response
    neutral = as_shot_neutral(scene.illuminant, response.wavelengths_nm, response.quantum_efficiency, scene.wavelengths_nm)
    return tuple(float(value) for value in neutral)


def warp_rectilinear(planned: Plan) -> tuple[tuple[tuple[float, ...], ...], tuple[float, float]] | None:
    """Return the polynomials that undo the lens's distortion in the frame's active area; see `Raw.warp_rectilinear`."""
    readout, warp = planned.sensor.readout, planned.optics.projection.warp
    output, active = readout.output, readout.active
    if warp is None:
        return None
    left, top = max(output.x, active.x), max(output.y, active.y)
    right = min(output.x + output.width, active.x + active.width)
    bottom = min(output.y + output.height, active.y + active.height)
    half = 0.5 * (1 if readout.binning is None else readout.binning.factor)
    return warp.rectilinear(left + half, top + half, right - half, bottom - half)


def _provenance(shot: Shot, planned: Plan, device: DeviceInfo) -> Callable[[], dict[str, object]]:
    """Return a function that gives shot, input files, seeds, plan, device and versions, plain data for the JSON file.

    All but the shot's own text is made at once. That text takes longer than a small frame, and follows from the shot alone,
    unless a path in it begins at the current folder.
    """
    inputs = fingerprints(shot.scene, shot.lens, shot.motion)
    metered = {} if planned.metered is None else {"metered": planned.metered.describe()}
    fitted = {} if planned.fitted is None else {"time_budget": asdict(planned.fitted)}
    rest: dict[str, object] = {
        **metered,
        **fitted,
        "inputs": inputs,
        "seeds": asdict(shot.seeds),
        "pose": pose_facts(shot.exposure, shot.motion, planned.exposed.openings),
        "times": planned.exposed.describe_lines(planned.sensor.readout.output),
        **_later_times(shot, planned),
        "plan": [asdict(step) for step in planned.steps],
        "notes": planned.notes,
        "error_budget": planned.error_budget.describe(),
        "warnings": planned.warnings(),
        "device": asdict(device),
        "versions": dict(_versions()),
    }
    if not all(Path(one["path"]).is_absolute() for one in inputs):
        rest["shot"] = shot.resolved
    return lambda: rest if "shot" in rest else {"shot": shot.resolved, **rest}


def _later_times(shot: Shot, planned: Plan) -> dict[str, object]:
    """Return when the lines of each exposure after the first are open, of a frame of several exposures; {} of any other."""
    numbers = shot.camera, shot.lens.f_number, shot.lens.diffraction_f_number
    later = [plan_exposure(one, *numbers) for one in later_exposures(shot.exposure, shot.camera)]
    output = planned.sensor.readout.output
    return {"later_times": [one.describe_lines(output) for one in later]} if later else {}


@cache
def _versions() -> dict[str, str]:
    found = {"photosite": __version__, "python": platform.python_version()}
    for package in ("numpy", "pyopencl"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
