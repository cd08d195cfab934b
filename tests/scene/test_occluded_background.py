"""The background behind edges: only behind edges, only from the farther side, and counted where a lens sees it."""

from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import FixedScene, band_scene

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.occluded_background import (
    depth_edges,
    disoccluded_pixels,
    disoccluded_share,
    extend_background,
    occluded_background,
)

MITSUBA = Path(__file__).parents[3] / "shared" / "data" / "mitsuba"
HEIGHT, WIDTH = 40, 60
Y, X = np.mgrid[:HEIGHT, :WIDTH]


def two_planes(near, near_m=1.0, far_m=5.0):
    """White where `near`, else grey of 0.25."""
    return np.where(near, 1.0, 0.25).astype(np.float32)[..., None], np.where(near, near_m, far_m).astype(np.float32)


def distance_to_other_side(near):
    """Of each near pixel to the nearest far one, by comparing all pairs in float64."""
    far = np.argwhere(~near)
    found = np.full(near.shape, np.inf)
    for y, x in np.argwhere(near):
        found[y, x] = np.sqrt(((far - [y, x]) ** 2).sum(axis=1).min())
    return found


SHAPES = {
    "half plane": X < 30,
    "disk": (X - 30) ** 2 + (Y - 20) ** 2 < 144,
    "hole": (X - 30) ** 2 + (Y - 20) ** 2 > 144,
    "wire": abs(X - 20) < 1,
    "corner": (X > 25) & (Y > 15),
}


@pytest.mark.parametrize("shape", sorted(SHAPES))
@pytest.mark.parametrize("reach", [1.5, 5.0, 9.0])
def test_it_covers_the_near_side_within_reach_and_the_edge_of_the_far_side_and_nothing_else(shape, reach):
    near = SHAPES[shape]
    layer = occluded_background(*two_planes(near), reach, 0.1)
    away = distance_to_other_side(near)
    covered = layer.coverage > 0
    beside = covered & ~near
    assert set(np.unique(layer.coverage)) <= {0.0, 1.0}
    np.testing.assert_array_equal(beside, ~near & (distance_to_other_side(~near) == 1.0))
    assert covered[away <= reach].all()  # from the edge pixel it is at most a pixel less
    assert not covered[near & (away > reach + 1.5)].any()
    np.testing.assert_allclose(layer.planes[covered], 0.25, rtol=1e-6)
    np.testing.assert_allclose(layer.depth_m[covered], 5.0, rtol=1e-6)
    assert not layer.planes[~covered].any()


def test_surfaces_without_edges_have_nothing_behind_them():
    slope = (1.0 / (0.2 + 0.01 * X)).astype(np.float32)  # 1/z rises by 0.01 per pixel
    planes = np.ones((HEIGHT, WIDTH, 3), np.float32)
    assert occluded_background(planes, slope, 8.0, 0.02) is None
    assert occluded_background(planes, 2.0, 8.0, 0.02) is None
    assert occluded_background(planes, slope, 0.0, 0.001) is None


def test_a_sloping_ground_is_not_behind_itself_beside_a_post():
    """A post on the ground: its foot stands on the ground without an edge; the ground comes nearer from row to row."""
    ground = 0.1 + 0.005 * Y
    post = (abs(X - 30) < 8) & (Y < 30)
    depth = (1.0 / np.where(post, 0.1 + 0.005 * 30, ground)).astype(np.float32)
    layer = occluded_background(np.ones((HEIGHT, WIDTH, 1), np.float32), depth, 6.0, 0.012)
    covered = layer.coverage > 0
    away = distance_to_other_side(~post)
    assert covered[:20, 26].all() and not covered[~post & (away > 1.0) & (Y < 30)].any() and not covered[37:].any()
    np.testing.assert_allclose(1.0 / layer.depth_m[covered & post], ground[covered & post], atol=0.03)


def test_what_is_behind_comes_from_the_farther_side_alone():
    """Steps of random depths, some at infinity: never from a surface as near as the one before it."""
    rng = np.random.default_rng(5)
    inverse = rng.choice([0.0, 0.2, 0.5, 1.0], (8, 12)).repeat(5, axis=0).repeat(5, axis=1)
    with np.errstate(divide="ignore"):
        depth = (1.0 / inverse).astype(np.float32)
    planes = inverse.astype(np.float32)[..., None]  # the colour tells where it comes from
    layer = occluded_background(planes, depth, 4.0, 0.1)
    covered = layer.coverage > 0
    is_own = layer.planes[..., 0] == planes[..., 0]  # the far side of an edge
    assert (covered & ~is_own).any() and (layer.planes[..., 0] <= planes[..., 0] - 0.05)[covered & ~is_own].all()
    assert not (covered & is_own & ~depth_edges(inverse.astype(np.float32), 0.1).far).any()
    np.testing.assert_allclose(1.0 / layer.depth_m[covered], layer.planes[covered][:, 0], atol=1e-6)


def test_the_picture_itself_is_left_alone():
    planes, depth = two_planes(SHAPES["disk"])
    kept = planes.copy(), depth.copy()
    occluded_background(planes, depth, 4.0, 0.1)
    np.testing.assert_array_equal(planes, kept[0])
    np.testing.assert_array_equal(depth, kept[1])


@pytest.mark.parametrize("radii", [(-6.25, 0.0), (0.0, 7.25), (-3.25, 5.0), (2.0, 8.25), (-9.25, -4.0)])
def test_pixels_that_see_past_an_edge_are_those_of_rays_through_the_pupil(radii):
    """Rays x + s u for a pupil of 4001 points on a line across the edge, which lies between pixels 29 and 30."""
    s_near, s_far = radii
    near = SHAPES["half plane"]
    radius = np.where(near, s_near, s_far).astype(np.float32)
    found = disoccluded_pixels(two_planes(near)[1], radius, 0.1)
    u = np.linspace(-1.0, 1.0, 4001)
    x = np.arange(WIDTH)[:, None] + 0.5 - 30.0
    sees = ((x + s_near * u >= 0) & (x + s_far * u < 0)).any(axis=1)
    np.testing.assert_array_equal(found[20], sees)


def test_no_pixel_of_a_sharp_picture_depends_on_occluded_background():
    planes, depth = two_planes(SHAPES["disk"])
    assert not disoccluded_pixels(depth, np.zeros(depth.shape, np.float32), 0.1).any()
    assert not disoccluded_pixels(2.0, np.ones((4, 4), np.float32), 0.1).any()


def test_the_share_of_a_large_picture_is_estimated_from_a_part_of_it():
    near = np.kron(SHAPES["disk"], np.ones((4, 4))) > 0
    depth = two_planes(near)[1]
    exact = disoccluded_share(depth, 25.0, 1.5)
    radius = 25.0 * (1 / 1.5 - 1 / depth)
    assert exact == disoccluded_pixels(depth, radius, 0.04).mean() > 0.05
    assert disoccluded_share(depth, 25.0, 1.5, most_pixels=depth.size // 3) == pytest.approx(exact, rel=0.1)


def scene_with(hidden):
    planes, depth = two_planes(SHAPES["disk"])
    return band_scene(planes, depth, hidden=hidden)


def test_a_scene_gets_its_background_when_it_asks_for_it():
    assert extend_background(scene_with("none").load(), 20.0).behind == ()
    scene = scene_with("extend").load()
    (layer,) = extend_background(scene, 20.0).behind
    away = distance_to_other_side(SHAPES["disk"])
    assert (layer.coverage[away <= 20.0 * 0.8] == 1.0).all()  # 0.8 dioptres lie between the planes
    assert extend_background(band_scene(np.ones((4, 4)), 2.0, hidden="extend").load(), 20.0).behind == ()


@pytest.mark.parametrize(("hidden", "says"), [("none", "none is assumed"), ("extend", "assumed to go on")])
def test_the_plan_states_the_share_of_the_picture_that_sees_occluded_background(hidden, says):
    """The number against the rays: between the radii of both planes, the edge of the disk all around."""
    lens, camera = ThinLens(50.0, 2.0, 1.5, cos4=False), small_camera(WIDTH, HEIGHT)
    planned = plan(Shot(scene_with(hidden), lens, Exposure(0.01), camera))
    (step,) = (step for step in planned.steps if step.stage == "hidden surfaces")
    near, far = (float(lens.blur_radius_um(z)) / camera.pixel_pitch_um for z in (1.0, 5.0))
    away, outside = distance_to_other_side(SHAPES["disk"]), distance_to_other_side(~SHAPES["disk"])
    share = ((away - 0.5 < -near) | (outside - 0.5 < far)).mean()
    percent = float(step.why.split()[1])
    assert says in step.why and step.kept == (hidden == "extend") and percent == pytest.approx(100 * share, rel=0.06)
    in_focus = plan(Shot(FixedScene(scene_with(hidden).load()), ThinLens(5.0, 64.0, 1.5), Exposure(0.01), camera))
    assert "hidden surfaces" not in {step.stage for step in in_focus.steps}


@pytest.mark.skipif(not MITSUBA.exists(), reason="no Mitsuba renders beside the checkout")
@pytest.mark.parametrize("name", ["near_occluder", "both_defocused"])
def test_behind_a_texture_it_is_as_good_a_guess_as_the_textures_mean(name):
    """Rendered backgrounds that the picture hides: rms error within a tenth of the texture's own spread."""
    renders = np.load(MITSUBA / f"{name}.npz")
    layer = occluded_background(renders["pinhole_wide"][..., None], renders["depth_wide"], 16.0, 0.05)
    truth = renders["layer0_rgb"]
    usual = (layer.coverage > 0) & (truth < 5.0) & (layer.planes[..., 0] < 5.0)  # without lamps of 1000 times white
    assert usual.sum() > 8000
    error = (layer.planes[..., 0] - truth)[usual]
    assert np.sqrt((error**2).mean()) < 1.1 * truth[usual].std() and abs(error.mean()) < 0.1 * truth[usual].std()
    np.testing.assert_allclose(layer.depth_m[usual], renders["layer0_z"], rtol=1e-5)
