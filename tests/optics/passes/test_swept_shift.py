"""A picture that moves without a turn: one convolution with the weights of its path, against dense means in float64."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.moving_frame import moving_light, plan_moving, rolling
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.swept_shift import path_taps
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window

LENS, TIME_S = ThinLens(50.0, 8.0, cos4=False), 0.01
WIDTH, HEIGHT = 150, 24  # two spans of a row
PICTURE = np.random.default_rng(2).random((HEIGHT, WIDTH))


def across(x_px: float, y_px: float) -> Motion:
    """The only layer moves by this way to the right and down in the exposure [px]."""
    return Motion(layers={0: LayerMotion((Speed(x_px / TIME_S, "px/s"), Speed(y_px / TIME_S, "px/s")))})


def shot_of(motion, cfa="MONO", depth_m=np.inf, **settings) -> Shot:
    planes = PICTURE if cfa == "MONO" else PICTURE[..., None] * np.array([1.0, 0.7, 0.4])
    camera = small_camera(WIDTH, HEIGHT, cfa=cfa, pixel_pitch_um=40.0)
    return Shot(
        band_scene(planes, depth_m),
        replace(LENS, focus_distance_m=depth_m),
        Exposure(TIME_S),
        camera,
        motion=motion,
        tolerance=0.05,
        **settings,
    )


def dense(way_px: tuple[float, float], opens_s: np.ndarray, instants: int = 4096) -> np.ndarray:
    """Mean of bilinear readings of PICTURE over so many instants."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    total = np.zeros(PICTURE.shape)
    for share in (np.arange(instants) + 0.5) / instants:
        come = opens_s[:, None] / TIME_S + share
        total += map_coordinates(PICTURE, (y - come * way_px[1], x - come * way_px[0]), order=1, mode="nearest")
    return total / instants


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
@pytest.mark.parametrize("way_px", [(9.3, 3.1), (-4.0, 0.0), (0.3, -6.2)])
def test_a_straight_way_has_its_exact_mean(way_px, row_s):
    planned = plan_moving(shot_of(across(*way_px)), rolling(HEIGHT, TIME_S, row_s))
    assert planned.optics.motion.method == "swept" and planned.optics.sweeps_shift()
    assert np.abs(moving_light(planned) - dense(way_px, row_s * np.arange(HEIGHT), 512)).max() < 2e-5


def test_a_shutter_that_opens_slowly_weighs_instants():
    opens, way_px = 1e-4 * np.arange(HEIGHT), (9.3, 3.1)
    ramps = opens + 0.6 * TIME_S, opens + 0.6 * TIME_S, opens + TIME_S
    planned = plan_moving(shot_of(across(*way_px)), LineTimes("rows", opens, *ramps, np.ones(HEIGHT)))
    assert planned.optics.sweeps_shift() and planned.optics.motion.path.straight_shift() is None
    shares = (np.arange(512) + 0.5) / 512
    weights = np.where(shares < 0.6, shares / 0.6, (1.0 - shares) / 0.4)
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    truth = np.zeros(PICTURE.shape)
    for share, weight in zip(shares, weights / weights.sum(), strict=True):
        come = opens[:, None] / TIME_S + share
        truth += weight * map_coordinates(PICTURE, (y - come * way_px[1], x - come * way_px[0]), order=1, mode="nearest")
    error = np.abs(moving_light(planned) - truth)
    assert np.quantile(error, 0.999) < planned.optics.motion.error


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_colours_are_those_of_single_planes_and_a_crop_has_the_bits_of_the_frame(row_s):
    planned = plan_moving(shot_of(across(9.3, 3.1), "RGGB"), rolling(HEIGHT, TIME_S, row_s))
    found = moving_light(planned)
    for row, column, plane in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        alone = moving_light(replace(planned, optics=planned.optics.in_one_color(plane)))
        assert np.array_equal(found[row::2, column::2], alone[row::2, column::2])
    part = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 90, 12)))
    assert planned.optics.sweeps_shift() and np.array_equal(moving_light(part), found[5:17, 17:107])


def test_a_camera_that_moves_before_a_wall_shifts_its_image_and_one_that_turns_does_not():
    aside = plan_moving(shot_of(Motion(camera=SteadyMotion(right_m_per_s=2.0)), depth_m=5.0))
    assert aside.optics.sweeps_shift()
    way_px = aside.optics.motion.length.longest_px
    error = moving_light(aside) - dense((-way_px, 0.0), np.zeros(HEIGHT), 512)
    assert way_px > 3.0 and np.abs(error).max() < 2e-5
    for turned in (SteadyMotion(roll_deg_per_s=200.0), SteadyMotion(pan_deg_per_s=40.0)):
        assert not plan_moving(shot_of(Motion(camera=turned))).optics.sweeps_shift()


def test_taps_read_what_instants_read():
    rng = np.random.default_rng(4)
    places, weights = rng.uniform(-3.0, 9.0, (3, 40, 2)), rng.random((3, 40))
    picture = rng.random((40, 40))
    for own, y, x, light in zip(path_taps(places, weights), *np.moveaxis(places[..., ::-1], -1, 0), weights, strict=True):
        read = picture[20 + own["row"], 20 + own["column"]], picture[20 + own["row"], 21 + own["column"]]
        expected = (light * map_coordinates(picture, (20 + y, 20 + x), order=1)).sum()
        assert (own["left"] * read[0] + own["right"] * read[1]).sum() == pytest.approx(expected, rel=1e-5)
