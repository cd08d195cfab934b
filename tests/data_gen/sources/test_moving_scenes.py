"""Scenes of things that move: layers whose coverage is what their outlines say, written as a shot can read them."""

import math

import numpy as np
import pytest

from data_gen.sources.moving_scenes import HEIGHT_PX, SCENES, WIDTH_PX, moving_scene
from simulator.errors import PhotositeError
from simulator.scene.layered import LayeredScene, PictureLayer


@pytest.mark.parametrize("name", SCENES)
def test_layers_are_premultiplied_and_the_last_covers_all(name):
    layers = list(SCENES[name]().values())
    for layer in layers:
        assert layer.shape == (HEIGHT_PX, WIDTH_PX, 4) and np.isfinite(layer).all() and layer.min() >= 0.0
        assert layer[..., 3].max() == 1.0
        assert not layer[layer[..., 3] == 0.0].any()
    assert (layers[-1][..., 3] == 1.0).all()


def test_outlines_have_the_area_of_their_shapes():
    ball = SCENES["ball"]()["ball"][..., 3].sum()
    assert ball == pytest.approx(math.pi * 110.0**2, rel=1e-4)
    drop = SCENES["drop"]()["drop"][..., 3].sum()
    assert drop == pytest.approx(math.pi * 60.0**2, rel=3e-4)


def test_the_fan_looks_the_same_after_a_fifth_of_a_turn():
    blades = SCENES["fan"]()["blades"][..., 3]
    y, x = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    angle = np.arctan2(0.5 * HEIGHT_PX - (y + 0.5), x + 0.5 - 0.5 * WIDTH_PX)
    sectors = [blades[(angle >= low) & (angle < low + 0.4 * math.pi)].sum() for low in np.arange(5) * 0.4 * math.pi - math.pi]
    assert np.ptp(sectors) < 2e-3 * np.mean(sectors)


def test_the_zone_plate_reaches_a_quarter_of_a_cycle_per_pixel_at_the_edge():
    row = SCENES["pattern"]()["plate"][HEIGHT_PX // 2, WIDTH_PX // 2 :, 0]
    half_cycles = np.count_nonzero(np.diff(np.sign(row - 0.5)))
    assert abs(half_cycles - 0.25 * 600.0) <= 1.0  # the frequency grows evenly from 0 to 1/4, so its mean is 1/8


def test_the_files_are_a_scene_of_layers(tmp_path):
    front, back = moving_scene("ball", tmp_path)
    assert [path.name for path in (front, back)] == ["ball_ball.exr", "ball_wall.exr"]
    layers = (PictureLayer(front, 2.0), PictureLayer(back, 3.0))
    scene = LayeredScene(layers, luminance_cd_m2=1000.0).load()
    assert scene.coverage.sum() == pytest.approx(math.pi * 110.0**2, rel=1e-3)


def test_an_unknown_scene_is_named_with_those_there_are(tmp_path):
    with pytest.raises(PhotositeError, match="give one of ball, bullet"):
        moving_scene("rocket", tmp_path)
