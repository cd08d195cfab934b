"""Each photosite of a large pattern gets the light of its own colour, and the image of each colour is made once."""

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.own_colors import join_colors
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window


@pytest.mark.parametrize("window", [None, Window(5, 3, 23, 17)])
@pytest.mark.parametrize("cfa", ["GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG", "RGG/GBG/GGR/RBG"])
def test_photosites_take_the_light_of_their_own_colour(device, cfa, window):
    camera = small_camera(40, 30, cfa, window=window)
    optics = plan(Shot(band_scene(np.ones((30, 40, 3))), ThinLens(50.0, 8.0), Exposure(0.01), camera)).optics
    area, asked = optics.window, []

    def image(own):
        asked.append(own.cfa.colors)
        return device.upload(np.full((area.height, area.width), 10.0 + own.cfa.colors[0], np.float32))

    found = device.download(join_colors(optics, device, image), (area.height, area.width), np.float32)
    rows = cfa.split("/")
    expected = [
        [10 + "RGB".index(rows[(area.y + y) % len(rows)][(area.x + x) % len(rows[0])]) for x in range(area.width)]
        for y in range(area.height)
    ]
    assert np.array_equal(found, expected) and asked == [[0], [1], [2]]
