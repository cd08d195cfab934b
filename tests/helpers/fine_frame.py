"""Frames of scenes finer than the photosites, as the pipeline makes them, on a camera without colour filter."""

import numpy as np

from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import FixedScene
from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene


def fine_shot(
    pixels: np.ndarray,
    shape: tuple[int, int],
    radius_px: float | np.ndarray,
    electrons: float,
    fill_factor: float = 1.0,
    tolerance: float = 0.1,
    lens=LENS,
) -> Shot:
    """Shot of a scene that covers the sensor, at the distance of this blur radius.

    pixels: (height, width) radiance. shape: rows and columns of photosites. electrons: of a photosite at radiance 1.
    """
    spectrum, wavelengths = 1e-3 * np.ones((1, 31)), np.arange(400.0, 701.0, 10.0)
    scene = Scene(np.asarray(pixels, np.float32)[..., None], spectrum, wavelengths, np.ones(31), depth_of(radius_px))
    camera = small_camera(shape[1], shape[0], fill_factor=fill_factor)
    weight = electron_radiance_weights(scene, camera.response.wavelengths_nm, camera.response.quantum_efficiency).sum()
    per_second = weight * lens.irradiance_per_radiance_sr() * camera.pixel_pitch_um**2 * fill_factor
    return Shot(FixedScene(scene), lens, Exposure(electrons / per_second), camera, tolerance=tolerance)


def frame_radiance(shot: Shot) -> tuple[np.ndarray, Plan]:
    """Radiance of each photosite behind the lens, and the plan by which it was computed."""
    device = open_device()
    planned = measure(plan(shot), device)
    frame = planned.optics.window
    mosaic = device.download(expose(planned, device), (frame.height, frame.width), np.float32)
    return mosaic / planned.optics.weights.sum(), planned
