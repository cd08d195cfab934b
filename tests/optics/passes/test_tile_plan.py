"""The methods of a blur's tiles are chosen once for a window, and kept with the blur."""

import dataclasses

import numpy as np
from helpers.camera_builders import small_camera
from helpers.lens_frame import case_plan, executed_case
from helpers.scene_builders import band_scene
from helpers.textured_planes import one_picture, textured_planes

from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.defocus import STEEPEST_PX
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window


def test_a_second_plan_of_the_same_window_keeps_the_methods():
    case = one_picture(textured_planes((-4.0, 0.0, 4.0), shape=(80, 104)))
    planned, device = case_plan(case), open_device()
    first, again = (plan_tiles(planned.optics, device) for _ in range(2))
    assert again.chosen is first.chosen
    part = dataclasses.replace(planned.optics, window=Window(8, 8, 40, 24))
    assert plan_tiles(part, device).chosen is not first.chosen
    fresh = dataclasses.replace(planned.optics, defocus=dataclasses.replace(planned.optics.defocus))
    assert plan_tiles(fresh, device).chosen is not first.chosen
    kept = executed_case(case, planned)
    assert np.array_equal(kept, executed_case(case, dataclasses.replace(planned, optics=fresh)))


def test_images_are_tilted_no_more_than_continuous_surfaces():
    """Beyond the sensor surfaces keep the slope of its edge, which a step in depth there makes as steep as no surface is."""
    depth_m = np.full((33, 32), 1.7, np.float32)
    depth_m[:, :10] = depth_m[:10, 28:] = depth_m[20:30, 20:29] = 0.5
    scene = band_scene(np.random.default_rng(1).random((33, 32)), depth_m, hidden="extend")
    planned = plan(Shot(scene, ThinLens(16.84, 4.16, 1.815), Exposure(0.01), small_camera(32, 33, pixel_pitch_um=4.3)))
    images = plan_tiles(planned.optics, open_device()).chosen.all_images
    assert 0.0 < max(abs(slope) for image in images for slope in image.slope) <= STEEPEST_PX
