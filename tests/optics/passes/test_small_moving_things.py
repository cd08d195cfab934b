"""What moves and hardly shows: fewer pixels than a thousandth of a picture that pass many of its photosites, and slopes."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS as WIDE_OPEN
from helpers.lens_frame import depth_of
from helpers.moving_frame import moving_light, plan_moving
from helpers.scene_builders import FixedScene, band_scene
from scipy.ndimage import map_coordinates

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer

LENS, TIME_S, SIDE, WAY_PX = ThinLens(50.0, 8.0, cos4=False), 0.01, 200, 20.0
Y, X = np.mgrid[:SIDE, :SIDE]


def ball_before_wall(texture: float, radius_px: float = 3.0) -> tuple[Shot, np.ndarray, np.ndarray]:
    """Shot of a white ball that flies past a grey wall, the ball's coverage, and the wall."""
    ball = ((X - 60.0) ** 2 + (Y - 80.0) ** 2 < radius_px**2).astype(np.float32)
    wall = np.float32(0.5 + texture * (np.random.default_rng(1).random((SIDE, SIDE)) - 0.5))
    scene = band_scene(ball, 1e6, coverage=ball, behind=(Layer(wall[..., None], np.inf, None),))
    flies = Motion(layers={0: LayerMotion((Speed(WAY_PX / TIME_S, "px/s"), Speed(0.0, "px/s")))})
    return Shot(scene, LENS, Exposure(TIME_S), small_camera(SIDE, SIDE, pixel_pitch_um=40.0), motion=flies), ball, wall


@pytest.mark.parametrize("texture", [0.0, 0.02], ids=["even", "faint"])
def test_a_small_ball_before_an_even_wall_is_a_streak_within_the_stated_error(texture):
    """Its edge is 3 of 10,000 pixels and passes 4 of 1,000 photosites."""
    shot, ball, wall = ball_before_wall(texture)
    planned = plan_moving(shot)
    motion, accuracy = planned.optics.motion, planned.optics.accuracy
    assert isinstance(motion, MotionPlan)
    near, truth = slice(74, 87), np.zeros((13, SIDE))  # rows
    for share in (np.arange(800) + 0.5) / 800:
        moved = map_coordinates(np.float64(ball), (Y[near], X[near] - WAY_PX * share), order=1, mode="nearest")
        truth += (moved + (1.0 - moved) * wall[near]) / 800
    electrons = accuracy.electrons_per_radiance * float(planned.optics.weights.max())
    noise_e, found = np.sqrt(electrons * truth + accuracy.read_noise_e**2), moving_light(planned)
    error = electrons * np.abs(found[near] - truth) / noise_e
    assert error.max() < motion.error / accuracy.sigma <= shot.tolerance
    assert np.abs(found - wall)[:70].max() < 5e-6  # of sums of 250 instants in float32


def test_a_picture_whose_few_bright_pixels_alone_show_that_it_moves_is_moved():
    """Of one pixel per photosite and of a finer picture, by a pan."""
    for scale in (1, 2):
        picture = np.full((scale * 60, scale * 90), 0.5)
        picture[scale * 30, scale * 45] = 1.0
        shot = Shot(band_scene(picture, np.inf), LENS, Exposure(TIME_S), small_camera(90, 60, pixel_pitch_um=40.0))
        still = moving_light(plan(shot))
        pan = SteadyMotion(pan_deg_per_s=-50.0)  # 10.9 photosites
        planned = plan_moving(replace(shot, motion=Motion(camera=pan)))
        assert planned.optics.motion is not None
        moved = moving_light(planned)
        assert moved.sum() == pytest.approx(still.sum(), rel=1e-5)
        assert 0.0 < (moved - 0.5).max() < 0.2 * (still - 0.5).max()


def test_what_is_skipped_is_so_by_the_sharpest_pixel():
    """The stated error holds for that, too; an even picture stays as it is however far it moves."""
    picture = np.full((60, 90), 0.5)
    even = FixedScene(band_scene(picture, np.inf).load())
    picture[30, 45] = 1.0
    shot = Shot(band_scene(picture, np.inf), LENS, Exposure(TIME_S), small_camera(90, 60, pixel_pitch_um=40.0))
    way_px = 3e-4
    planned = plan(replace(shot, motion=Motion(layers={0: LayerMotion((Speed(way_px / TIME_S, "px/s"), Speed(0.0, "px/s")))})))
    skipped, electrons = planned.optics.motion_skipped, planned.optics.accuracy.electrons  # of the wall
    moved_e = way_px * electrons  # from the bright pixel, which has twice its light, to the one beside it
    assert planned.optics.motion is None and skipped is not None
    assert moved_e / np.sqrt(electrons) < 1.01 * skipped.sigma <= 1.01 * shot.tolerance
    far = Motion(layers={0: LayerMotion((Speed(WAY_PX / TIME_S, "px/s"), Speed(0.0, "px/s")))})
    found = plan(replace(shot, scene=even, motion=far)).optics
    assert found.motion is None and found.motion_skipped is not None


@pytest.mark.parametrize("scale", [1, 2])
def test_a_slope_behind_a_blur_moves_as_far_as_without(scale):
    """Light that rises evenly has its slope behind any circle, where an edge has a share of it: half of 3 photosites show."""
    rows, columns, way_px, darkest, radius_px = 40, 90, 3.0, 0.02, 9.0
    ramp = np.repeat(darkest + (np.arange(scale * columns) + 0.5)[None, :] / (scale * columns), scale * rows, axis=0)
    still = Shot(band_scene(ramp, depth_of(radius_px)), WIDE_OPEN, Exposure(TIME_S), small_camera(columns, rows), tolerance=1.0)
    still = replace(still, exposure=Exposure(TIME_S * 2000.0 / plan(still).optics.accuracy.electrons))
    speed = LayerMotion((Speed(-scale * way_px / still.exposure.time_s, "px/s"), Speed(0.0, "px/s")))
    planned = plan_moving(replace(still, motion=Motion(layers={0: speed})))
    accuracy = planned.optics.accuracy
    electrons = accuracy.electrons_per_radiance * float(planned.optics.weights.max())
    inner, middles = slice(12, -12), (np.arange(columns) + 0.5) / columns
    truth = (darkest + middles + 0.5 * way_px / columns)[inner]
    noise_e = np.sqrt(electrons * truth + accuracy.read_noise_e**2)
    assert (electrons * 0.5 * way_px / columns / noise_e).max() > 1.5 * still.tolerance
    assert (electrons * np.abs(moving_light(planned)[10:-10, inner] - truth) / noise_e).max() < 0.1 * still.tolerance


@pytest.mark.parametrize(("way_px", "radius_px"), [(1e-5, 0.45), (1e-3, 0.45), (0.02, 0.45), (1e-3, 0.31)])
def test_however_little_a_blurred_picture_moves_it_is_averaged_over_photosites(way_px, radius_px):
    """Of one pixel per photosite, of which what rests reads single ones: edges would differ between frames of a clip.

    A circle inside a photosite, which at rest blurs nothing, may be left out beside what would be seen of it.
    """
    picture = np.random.default_rng(5).choice([0.1, 1.0], (40, 50)).astype(np.float32)
    still = Shot(band_scene(picture, depth_of(radius_px)), WIDE_OPEN, Exposure(TIME_S), small_camera(50, 40), tolerance=1.0)
    still = replace(still, exposure=Exposure(TIME_S * 500.0 / plan(still).optics.accuracy.electrons))
    speed = LayerMotion((Speed(way_px / still.exposure.time_s, "px/s"), Speed(0.0, "px/s")))
    planned = plan_moving(replace(still, motion=Motion(layers={0: speed})))
    accuracy, inside = planned.optics.accuracy, (slice(2, -2), slice(2, -2))
    electrons = accuracy.electrons_per_radiance * float(planned.optics.weights.max())
    truth = photosite_means(picture.astype(np.float64), picture.shape, radius_px)[inside]
    noise_e = np.sqrt(electrons * truth + accuracy.read_noise_e**2)

    def worst_sigma(of: Plan) -> float:
        return float((electrons * np.abs(moving_light(of)[inside] - truth) / noise_e).max())

    assert worst_sigma(planned) < 0.3 * still.tolerance
    assert worst_sigma(plan(still)) > 3.0 * still.tolerance
