"""Sharp frames whose photosites nothing displaces: spans and bands leave no seams. test_projection.py has their exact means."""

import dataclasses
import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import Window


@pytest.mark.parametrize(
    ("cfa", "width", "interpolation"),
    [("RGGB", 300, "bilinear"), ("RRGG/RRGG/GGBB/GGBB", 1200, "nearest"), ("RGGB", 1700, "bilinear")],
)
def test_a_frame_wider_than_a_span_has_the_bits_of_its_windows(cfa, width, interpolation):
    """Spans of columns and bands of rows begin elsewhere in a window; the scene is coarser, as fine, and finer."""
    picture = np.random.default_rng(6).random((24 * width // 1200 + 2, width, 3))
    scene = band_scene(picture, math.inf, interpolation=interpolation)
    lit = Shot(scene, ThinLens(50.0, 8.0), Exposure(0.01), small_camera(1200, 24, cfa=cfa))
    whole = simulate(lit)
    for x, y in ((1, 5), (1100, 2)):
        crop = simulate(dataclasses.replace(lit, camera=dataclasses.replace(lit.camera, window=Window(x, y, 97, 17))))
        assert np.array_equal(crop.mean_electrons, whole.mean_electrons[y : y + 17, x : x + 97])
