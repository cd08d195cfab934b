"""Mosaics of several colours that are blurred together: the bits of each alone."""

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.defocused_mosaic import defocused_mosaic, defocused_mosaics
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.cfa import Cfa

ROWS, COLUMNS = 48, 160


@pytest.mark.parametrize("near_m", [1.9, 1.2], ids=["slope", "steps"])
def test_colours_that_are_blurred_together_have_the_bits_of_each_alone(device, near_m):
    rng, camera = np.random.default_rng(0), small_camera(COLUMNS, ROWS, "RGGB")
    light = rng.random((ROWS, COLUMNS, camera.channels))
    light[20, 40] = 400.0  # a highlight
    depth_m = np.where(np.arange(COLUMNS) < 90, near_m, np.linspace(2.0, 2.1, COLUMNS)) * np.ones((ROWS, 1))
    shot = Shot(band_scene(light, depth_m), ThinLens(50.0, 2.8, 2.0), Exposure(0.001), camera)
    planned = measure(plan(shot), device)
    optics, tiles = planned.optics, planned.tiles
    assert tiles is not None
    planes = [camera_planes(device, layer, optics.weights, optics.has_coverage, None) for layer in optics.scene.layers]
    filters = [optics.cfa, *(Cfa.uniform(channel) for channel in optics.cfa.colors)]
    shape = tiles.optics.window.height, tiles.optics.window.width
    together = defocused_mosaics(tiles, filters, device, planes, lambda share: None)
    for cfa, found in zip(filters, together, strict=True):
        alone = defocused_mosaic(tiles, cfa, device, planes, lambda share: None)
        np.testing.assert_array_equal(*(device.download(one, shape, np.float32) for one in (found, alone)))
