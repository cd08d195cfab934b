"""The part of a scene that a window sees holds every pixel that the window's photosites read."""

import numpy as np
import pytest

from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.scene_part import ALIGNED_PX, ScenePart, find_scene_part
from simulator.optics.lens.distortion import Distortion, plan_warp
from simulator.sensor.camera.camera_sections import Window

SENSOR = (600, 400)
WINDOWS = [
    Window(0, 0, 600, 400),
    Window(500, 10, 64, 48),
    Window(3, 340, 17, 60),
    Window(-40, -30, 60, 50),
    Window(590, 380, 90, 70),
]
DISTORTIONS = [None, Distortion(k1=-0.2, k2=0.05), Distortion(k1=0.15, p1=0.01, p2=-0.02, lateral=(1.002, 1.0, 0.997))]


@pytest.mark.parametrize("scale", [0.3, 1.0, 2.7])
@pytest.mark.parametrize("distortion", DISTORTIONS, ids=["none", "barrel", "decentred"])
@pytest.mark.parametrize("window", WINDOWS, ids=str)
def test_every_corner_of_a_photosite_lies_in_it(window, distortion, scale):
    warp = plan_warp(distortion, 800.0, *SENSOR, 3)
    stretch = 1.0 if warp is None else warp.extent(*SENSOR)[2]
    width, height = round(1.1 * scale * SENSOR[0]), round(1.1 * scale * SENSOR[1])
    offset = 0.5 * (width - scale * SENSOR[0]), 0.5 * (height - scale * SENSOR[1])
    projection = Projection(scale, *offset, width, height, 1, False, warp, stretch)
    part = find_scene_part([(projection, window)])
    x, y = np.meshgrid(window.x + np.arange(window.width + 1.0), window.y + np.arange(window.height + 1.0))
    for channel in range(3 if warp is not None else 1):
        places = (x, y) if warp is None else warp.undistorted(x, y, channel)
        for place, start, length, first, count in zip(
            places, offset, (width, height), (part.x, part.y), (part.width, part.height), strict=True
        ):
            read = np.clip(start + scale * place, 0.0, length - 1.0)
            assert first <= np.floor(read - 1.0).clip(0).min()
            assert np.ceil(read + 1.0).clip(max=length - 1).max() <= first + count - 1


def test_it_is_not_much_larger_than_what_is_seen():
    projection = Projection(2.0, 0.0, 0.0, 8000, 6000, 2, False)
    part = find_scene_part([(projection, Window(1000, 700, 512, 512))])
    assert part.height <= 2 * 512 + 8 and part.width <= 2 * 512 + 8 + ALIGNED_PX and part.width % ALIGNED_PX == 0


def test_a_scene_that_is_hardly_wider_is_taken_in_whole_rows():
    part = find_scene_part([(Projection(1.0, 0.0, 0.0, 250, 200, 1, False), Window(100, 50, 64, 48))])
    assert part == ScenePart(0, 47, 250, 54)


def test_of_several_windows_it_holds_each():
    projection = Projection(1.0, 0.0, 0.0, 5000, 4000, 1, False)
    one, other = Window(100, 100, 50, 50), Window(3000, 2000, 50, 50)
    part = find_scene_part([(projection, one), (projection, other)])
    assert part.x <= 97 and part.y == 97 and part.x + part.width >= 3053 and part.y + part.height == 2053
