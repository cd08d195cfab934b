"""Frames of a camera that sees 550 nm alone, through the whole pipeline."""

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from helpers.scene_builders import band_scene
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Camera

EXPOSURE = Exposure(0.01)
GREEN_UM = 0.55
PITCH_UM = 5.0
FINE = 8  # scene pixels per photosite


def lens(f_number: float = 8.0, **settings: Any) -> ThinLens:
    return ThinLens(50.0, f_number, cos4=False, **settings)  # focused at infinity: N is the working f-number


def electrons(
    planes: ArrayLike,
    camera: Camera,
    through: ThinLens,
    depth_m: float | np.ndarray = math.inf,
    tolerance: float = 0.1,
    **settings: Any,
) -> np.ndarray:
    scene = band_scene(planes, depth_m, interpolation="nearest", **settings)
    return simulate(Shot(scene, through, EXPOSURE, camera, tolerance=tolerance)).mean_electrons.astype(np.float64)


def point_frame(camera: Camera, through: ThinLens, depth_m: float = math.inf, light: float = 1000.0) -> np.ndarray:
    """Electrons of a light a quarter of a photosite wide, in the middle of a photosite in the middle of the frame."""
    planes = np.zeros((camera.height_px * FINE, camera.width_px * FINE))
    row, column = (side // 2 * FINE + FINE // 2 for side in (camera.height_px, camera.width_px))
    planes[row - 1 : row + 1, column - 1 : column + 1] = light
    return electrons(planes, camera, through, depth_m)
