"""A reduced scene holds the means of the scene's light."""

import numpy as np
import pytest
from helpers.scene_builders import band_scene

from simulator.scene.reduced import crop_scene, reduce_scene
from simulator.scene.scene import Layer, Scene


def scene(height=48, width=64, bands=3, **settings):
    rng = np.random.default_rng(1)
    planes = rng.uniform(0.0, 2.0, (height, width, bands)).astype(np.float32)
    grid = np.array([500.0, 600.0])
    return Scene(planes, np.ones((bands, 2)), grid, np.ones(2), **settings)


def test_colours_and_coverage_are_means_over_blocks_and_depth_is_that_of_one_pixel():
    rng = np.random.default_rng(2)
    depth_m = rng.choice([1.0, 5.0, np.inf], (48, 64)).astype(np.float32)
    coverage = rng.uniform(0.0, 1.0, (48, 64)).astype(np.float32)
    whole = scene(depth_m=depth_m, coverage=coverage, behind=(Layer(np.ones((48, 64, 3), np.float32), 9.0),))
    small = reduce_scene(whole, 16)
    for made, held in ((small.planes, whole.planes), (small.coverage[..., None], coverage[..., None])):
        blocks = held.astype(np.float64).reshape(12, 4, 16, 4, -1).mean(axis=(1, 3))
        np.testing.assert_allclose(made, blocks, rtol=2e-6)
    assert np.isin(small.depth_m, depth_m).all() and small.depth_m.shape == (12, 16)
    assert np.array_equal(small.behind[0].planes, np.ones((12, 16, 3), np.float32)) and small.behind[0].depth_m == 9.0
    assert not any(array.flags.writeable for array in small.arrays())


@pytest.mark.parametrize("width", [7, 23, 63])
def test_even_light_stays_even_and_the_mean_stays_at_any_ratio(width):
    even = reduce_scene(band_scene(np.full((50, 64), 0.7), 2.0).load(), width)
    np.testing.assert_allclose(even.planes, even.planes.flat[0], rtol=1e-6)
    textured = scene(50, 64)
    mean = textured.planes.mean(dtype=float)
    assert reduce_scene(textured, width).planes.mean(dtype=float) == pytest.approx(mean, rel=1e-6)


def test_a_scene_that_is_coarse_already_stays_as_it_is():
    whole = scene()
    assert reduce_scene(whole, 64) is whole


def test_the_middle_of_a_scene_lies_where_it_did():
    depth_m = np.arange(48 * 64, dtype=np.float32).reshape(48, 64) + 1.0
    whole = scene(depth_m=depth_m, field_of_view_deg=60.0, behind=(Layer(np.ones((48, 64, 3), np.float32), 9.0),))
    part = crop_scene(whole, 31, 20)
    assert part.planes.shape == (20, 32, 3) and part.behind[0].planes.shape == (20, 32, 3) and part.behind[0].depth_m == 9.0
    assert np.array_equal(part.planes, whole.planes[14:34, 16:48]) and np.array_equal(part.depth_m, depth_m[14:34, 16:48])
    per_px = [np.tan(np.radians(0.5 * one.field_of_view_deg)) / one.planes.shape[1] for one in (whole, part)]
    assert per_px[0] == pytest.approx(per_px[1], rel=1e-12)
    assert not any(array.flags.writeable for array in part.arrays())


def test_a_scene_that_is_seen_whole_or_fills_the_sensor_is_not_cut():
    whole = scene(field_of_view_deg=60.0)
    assert crop_scene(whole, 64, 48) is whole
    filling = scene()
    assert crop_scene(filling, 8, 8) is filling
