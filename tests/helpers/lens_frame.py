"""The frame that the pipeline makes of a `lens_truths.Case`."""

import dataclasses
from typing import Any

import numpy as np

from helpers.camera_builders import small_camera
from helpers.lens_truths import Case
from helpers.scene_builders import FixedScene
from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.occluded_background import Hidden
from simulator.scene.scene import Layer, Scene

LENS = ThinLens(50.0, 1.4, focus_distance_m=2.0, cos4=False)
PX_PER_DIOPTRE = float(LENS.blur_radius_um(np.inf) - LENS.blur_radius_um(1.0)) / 5.0  # of small_camera's photosites


def depth_of(radius_px: float | np.ndarray) -> float | np.ndarray:
    """Distance at which LENS blurs by this signed radius [m]; a float when it is one everywhere."""
    depth = 1.0 / np.maximum(0.5 - np.asarray(radius_px, np.float64) / PX_PER_DIOPTRE, 1e-9)
    return float(depth.flat[0]) if np.ptp(depth) == 0.0 else depth


def case_plan(case: Case, electrons: float = 2000.0, tolerance: float = 0.1, hidden: Hidden = "none") -> Plan:
    """Plan of `case_shot`."""
    return plan(case_shot(case, electrons, tolerance, hidden))


def case_shot(case: Case, electrons: float = 2000.0, tolerance: float = 0.1, hidden: Hidden = "none") -> Shot:
    """Shot of a case whose samples become scene pixels, on a camera without colour filter.

    electrons: of a photosite at radiance 1. tolerance: as in `Shot`. hidden: as in `Scene`.
    """
    layers = [
        Layer(
            colour.astype(np.float32)[..., None], depth_of(radius), None if (cover >= 1.0).all() else cover.astype(np.float32)
        )
        for colour, cover, radius in zip(case.colour, case.coverage, case.radius_px, strict=True)
    ]
    first, *behind = layers
    spectrum, wavelengths = 1e-3 * np.ones((1, 31)), np.arange(400.0, 701.0, 10.0)
    scene = Scene(
        first.planes,
        spectrum,
        wavelengths,
        np.ones(31),
        first.depth_m,
        coverage=first.coverage,
        behind=tuple(behind),
        hidden=hidden,
    )
    height, width = (int(side // case.oversampling) for side in case.colour.shape[1:])
    camera = small_camera(width, height)
    weight = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency).sum()
    time_s = electrons / (weight * LENS.irradiance_per_radiance_sr() * camera.pixel_pitch_um**2)
    return Shot(FixedScene(scene), LENS, Exposure(time_s), camera, tolerance=tolerance)


def with_accuracy(planned: Plan, kind: type[Accuracy], **settings: Any) -> Plan:
    """The plan with an accuracy of another kind, or of other settings, in the place of its own."""
    accuracy = kind(**(vars(planned.optics.defocus.accuracy) | settings))
    defocus = dataclasses.replace(planned.optics.defocus, accuracy=accuracy)
    return dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, accuracy=accuracy, defocus=defocus))


def blurred_case(case: Case, electrons: float = 2000.0, tolerance: float = 0.1, hidden: Hidden = "none") -> np.ndarray:
    """Radiance of each photosite behind the lens, of the shape of the case's truth."""
    return executed_case(case, case_plan(case, electrons, tolerance, hidden))


def executed_case(case: Case, planned: Plan) -> np.ndarray:
    """The same by a plan of the case."""
    device = open_device()
    frame, margin = planned.optics.window, case.margin
    mosaic = device.download(expose(measure(planned, device), device), (frame.height, frame.width), np.float32)
    return mosaic[margin : frame.height - margin, margin : frame.width - margin] / planned.optics.weights.sum()
