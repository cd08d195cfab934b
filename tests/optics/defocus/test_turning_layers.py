"""Layers that turn behind a defocused lens: points of aperture and time turn to those of each photosite."""

import dataclasses
import warnings

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import case_shot, with_accuracy
from helpers.moving_frame import rolling
from helpers.moving_layers import bars_before_a_wall, dense_turned_picture, moving_picture, moving_plan

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion
from simulator.exposure.shutter import RollingShutter
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_samples import move_samples
from simulator.pipeline.planner import plan

SPIN = LayerMotion(spin_deg_per_s=2.0, centre_px=(64.0, 48.0))


def accelerated(rows: int, last_s: float, time_s: float) -> LineTimes:
    """Rows that open one after the other, each a little sooner after the last, as behind a curtain that is accelerated."""
    opens = last_s * np.sqrt(np.arange(rows) / rows + 0.25)
    return LineTimes("rows", opens, opens, opens + time_s, opens + time_s, np.ones(rows))


@pytest.mark.parametrize(
    ("lines", "wider"),
    [(rolling(96, 1.0, 0.5), 1), (rolling(96, 1.0, 0.5), 2), (accelerated(96, 20.0, 1.0), 1), (rolling(96, 1.0, 0.0), 1)],
)
def test_points_turn_to_those_of_each_photosite(lines, wider):
    """A layer has turned by 100 degrees and turns on from row to row; a cell has the points of each of its places."""
    case = bars_before_a_wall(-4.0, 3.0)
    motion = moving_plan(case, None, (SPIN, None), lines, start_s=50.0).optics.defocus.motion
    motion = motion.on_wider_photosites() if wider == 2 else motion
    cells = motion.cells(32, 8)
    assert cells.points == "places" and cells.error_px <= 0.01
    samples, shares = np.zeros((1, 64, 5), np.float32), np.linspace(0.01, 0.99, 64)
    rng = np.random.default_rng(1)
    x, y = rng.integers(0, 128 // wider, 40), rng.integers(0, 96 // wider, 40)
    _, middles = motion.cells_of(x, y, cells)
    turned = move_samples(samples, shares, motion, middles, cells)
    right, down = (np.column_stack([x, y]) + 0.5 - middles).T[:, :, None, None, None].astype(np.float32)
    found = turned[..., :4] + right * turned[..., 5:9] + down * (turned[..., 9:13] + right * turned[..., 13:])
    exact = motion.at(np.column_stack([x, y]) + 0.5, shares)
    assert np.abs(found - exact).max() < cells.error_px + 0.001


def roll_of(camera: SteadyMotion, layer: LayerMotion | None, start_s: float):
    """Angles of two layers in the picture at times after the release, counter-clockwise [rad]; a roll turns both back."""
    speeds = np.array([[0.0 if layer is None else layer.spin_deg_per_s], [0.0]]) - camera.roll_deg_per_s
    return lambda times_s: np.radians(speeds * (start_s + times_s))


@pytest.mark.parametrize(
    ("radii_px", "camera", "layer", "start_s", "line_s"),
    [
        pytest.param(  # 100 to 200 degrees, a degree from row to row
            (-4.0, 3.0), SteadyMotion(), SPIN, 50.0, 0.5, marks=pytest.mark.slow
        ),
        pytest.param((-4.0, 3.0), SteadyMotion(), SPIN, 100.0, 0.0, marks=pytest.mark.slow),  # 200 degrees, all rows at once
        (
            (5.0, 0.3),
            SteadyMotion(),
            dataclasses.replace(SPIN, spin_deg_per_s=40.0),
            0.0,
            0.0,
        ),  # by 40 degrees while it is open
        ((-5.0, 4.0), SteadyMotion(roll_deg_per_s=0.9), None, 0.0, 0.0),  # photosites of a block read beside the same samples
        pytest.param((-5.0, 4.0), SteadyMotion(roll_deg_per_s=3.0), SPIN, -1.0, 0.05, marks=pytest.mark.slow),
    ],
)
def test_what_turns_is_seen_where_each_photosite_looks(radii_px, camera, layer, start_s, line_s):
    case = bars_before_a_wall(*radii_px)
    lines = rolling(96, 1.0, line_s) if line_s else None
    moving = camera if camera.roll_deg_per_s else None
    planned = moving_plan(case, moving, (layer, None), lines, start_s=start_s)
    assert planned.optics.defocus.motion.cells(32, 8).points == "places"
    truth = dense_turned_picture(case, roll_of(camera, layer, start_s), line_s)
    found = statistics(z_scores(moving_picture(case, planned), truth, 2000.0))
    assert found.p99_9 < 0.15 and abs(found.mean) < 0.01


@pytest.mark.slow
def test_rays_see_what_turns_where_each_photosite_looks():
    case = bars_before_a_wall(-4.0, 3.0)
    planned = moving_plan(case, None, (SPIN, None), rolling(96, 1.0, 0.5), start_s=50.0, tolerance=0.0)
    planned = with_accuracy(planned, Accuracy, rays=1024)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # 8192 rays do not reach the reference's own promise
        found = moving_picture(case, planned)
    truth = dense_turned_picture(case, roll_of(SteadyMotion(), SPIN, 50.0), 0.5)
    error = statistics(z_scores(found, truth, 2000.0))
    assert error.p99_9 < 0.2 and abs(error.mean) < 0.01


def test_points_follow_a_path_that_bends():
    """A roll by half a turn in a second: at the sensor's corners straight pieces stay within 0.003 photosites of the path."""
    case = bars_before_a_wall(-4.0, 3.0)
    motion = moving_plan(case, SteadyMotion(roll_deg_per_s=180.0), lines=rolling(96, 0.5, 0.002)).optics.defocus.motion
    middles, shares = np.array([[0.5, 0.5], [127.5, 95.5]]), np.random.default_rng(2).random(300)
    found = motion.at(middles, shares)
    for number, (middle, line) in enumerate(zip(middles, (0, 95), strict=True)):
        times = motion.quantiles(np.array([float(line)]), shares)[0]
        numbers = motion.image.pose_numbers(motion.path.start_s + times)
        exact = motion.shifts(numbers, middle[None])[:, :, 0] - np.pad(motion.rest_px, ((0, 0), (2, 0)))[:, None]
        assert np.abs(found[number] - exact).max() < 0.003


@pytest.mark.parametrize("spin_deg_per_s", [pytest.param(spin, marks=pytest.mark.slow) for spin in (90.0, 250.0)])
def test_turns_since_the_clock_was_zero_keep_the_tolerance(spin_deg_per_s):
    shot = case_shot(bars_before_a_wall(-4.0, 3.0))
    by_rows = dataclasses.replace(shot.exposure, start_s=1.0, shutter=RollingShutter(0.5))
    planned = plan(
        dataclasses.replace(shot, exposure=by_rows, motion=Motion(layers={0: LayerMotion(spin_deg_per_s=spin_deg_per_s)}))
    )
    assert planned.optics.motion.method == "joint"
    assert sum(term.sigma for term in planned.error_budget.terms if "edges of layers" not in term.cause) < 0.15
