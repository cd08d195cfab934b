"""Layers as the corrections to wave optics see them: the front one in focus, a wall behind it out of focus."""

import dataclasses
import math

import numpy as np
from helpers.green_frames import PITCH_UM
from helpers.psf_frames import SIDE, contrasts, error, shot_of
from helpers.scene_builders import FixedScene

from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.scene.scene import Layer


def test_a_wall_behind_a_layer_has_the_kernel_of_its_own_blur():
    planes, radius_px = 0.4 + 0.6 * contrasts(), 2.0
    through = ThinLens(50.0, 8.0, 2.0, cos4=False, diffraction=True)
    per_dioptre = float(through.blur_radius_um(math.inf) - through.blur_radius_um(1.0)) / PITCH_UM
    shot = shot_of(planes, through, 1.0 / (0.5 - radius_px / per_dioptre))
    wall = shot.scene.load()
    coverage = np.zeros((SIDE, SIDE), np.float32)
    coverage[:, SIDE // 2 :] = 1.0
    front = (0.7 * coverage)[..., None].astype(np.float32)
    slope = np.linspace(1.0 - 1e-4, 1.0 + 1e-4, SIDE, dtype=np.float32)  # layers of one distance each have kernels of each
    behind = (Layer(wall.planes, np.broadcast_to(np.float32(wall.depth_m) * slope, (SIDE, SIDE)).copy()),)
    scene = dataclasses.replace(wall, planes=front, depth_m=2.0, coverage=coverage, behind=behind)
    shot = dataclasses.replace(shot, scene=FixedScene(scene))
    psf = plan(shot).optics.psf
    assert psf.corrected_px
    exact = psf.at_radius(radius_px).kernel(0, 0, False, 0, 0)[0]
    assert error(shot, planes, exact, (slice(None), slice(0, SIDE // 2 - 24))) < 0.1
