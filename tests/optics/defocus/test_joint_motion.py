"""Motion behind a defocused lens: aperture and time together, against dense sums over both in float64."""

import dataclasses
import warnings

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import LENS, case_shot, depth_of, with_accuracy
from helpers.lens_truths import Case
from helpers.moving_layers import dense_picture, image_distance_px, moving_picture, moving_plan
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.stats import qmc

from simulator.device import open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Method
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.sensor.camera.camera_sections import Window

MARGIN = 32
CAMERA = SteadyMotion(right_m_per_s=0.003, up_m_per_s=0.001)


def texture(rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Light from 0.05 to 0.95 that varies over few photosites."""
    smooth = gaussian_filter(rng.random((rows, columns)), 1.0)
    return 0.05 + 0.9 * (smooth - smooth.min()) / np.ptp(smooth)


def bars_before_a_wall(near_px: float, far_px: float, rows: int = 96, columns: int = 128) -> Case:
    """Bright bars and a disk before a textured wall, each at one distance."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[:rows, :columns]
    near = (((x - 0.5 * columns) ** 2 + (y - 0.5 * rows) ** 2 < 100.0) | ((x // 9) % 4 == 0)) * 1.0
    light = np.stack([texture(rng, rows, columns) * near, texture(rng, rows, columns)])
    radius = np.stack([np.full(near.shape, near_px), np.full(near.shape, far_px)])
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    return Case("bars", light, np.stack([near, np.ones_like(near)]), radius, truth, MARGIN, 1, False)


def ways_px(radii_px: tuple[float, float], camera: SteadyMotion, way_px: tuple[float, float]) -> np.ndarray:
    """Way in a second of the place seen at rest, (layers, 2): parallax of the camera, less the first layer's own way."""
    dioptres = np.array([1.0 / float(depth_of(radius)) for radius in radii_px])
    way = image_distance_px() * dioptres[:, None] * [camera.right_m_per_s, -camera.up_m_per_s]
    way[0] -= way_px
    return way


@pytest.mark.parametrize(
    ("radii_px", "camera", "way_px"),
    [
        ((-5.0, 6.0), CAMERA, (0.0, 0.0)),
        ((-8.0, 0.0), SteadyMotion(), (15.0, 4.0)),
        ((-0.4, 0.0), SteadyMotion(), (20.0, 3.0)),
        ((-3.0, 10.0), SteadyMotion(right_m_per_s=0.002, up_m_per_s=0.002), (12.0, -3.0)),
    ],
)
def test_blur_motion_and_occlusion_are_one_mean(radii_px, camera, way_px):
    case, way = bars_before_a_wall(*radii_px), ways_px(radii_px, camera, way_px)
    planned = moving_plan(case, camera, (way_px, None))
    truth = dense_picture(case, lambda share: share * way)
    found = statistics(z_scores(moving_picture(case, planned), truth, 2000.0))
    assert found.p99_9 < 0.1 and abs(found.mean) < 0.01


def test_motion_before_the_blur_is_another_picture():
    """Bars and wall that move against each other: layers blurred by their motion alone do not say what covers what."""
    radii_px = -5.0, 6.0
    case, way = bars_before_a_wall(*radii_px), ways_px(radii_px, CAMERA, (36.0, 0.0))
    truth = dense_picture(case, lambda share: share * way, 1 << 12)
    apart = [
        np.mean(
            [np.roll(plane, (-round(share * y), -round(share * x)), (0, 1)) for share in np.linspace(0.01, 0.99, 99)], axis=0
        )
        for planes in (case.colour, case.coverage)
        for plane, (x, y) in zip(planes, way, strict=True)
    ]
    first = dataclasses.replace(case, colour=np.stack(apart[:2]), coverage=np.stack(apart[2:]))
    wrong = dense_picture(first, lambda share: 0.0 * way, 1 << 10)
    assert statistics(z_scores(wrong, truth, 2000.0)).p99 > 1.0


def test_a_tilted_picture_shows_its_parallax():
    """Near and far parts of one picture move by different amounts when the camera moves aside."""
    rows, columns, slope = 96, 128, np.array([0.03, 0.02])
    light = texture(np.random.default_rng(1), rows, columns)
    y, x = np.mgrid[:rows, :columns]
    radius = 3.0 + slope[0] * (x + 0.5 - 0.5 * columns) + slope[1] * (y + 0.5 - 0.5 * rows)
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    case = Case("tilted", light[None], np.ones((1, rows, columns)), radius[None], truth, MARGIN, 1, False)
    found = moving_picture(case, moving_plan(case, CAMERA))
    at_infinity, at_a_metre = (float(LENS.blur_radius_um(depth_m)) / 5.0 for depth_m in (np.inf, 1.0))
    shift = image_distance_px() * np.array([CAMERA.right_m_per_s, -CAMERA.up_m_per_s])  # per 1/m, in a second
    aside = -shift / (at_infinity - at_a_metre)  # R at + (place at R = 0): R is linear in 1/Z
    points = qmc.Sobol(3, seed=9).random(1 << 12)
    total, places = np.zeros(truth.shape), np.stack([x, y], axis=-1)[MARGIN:-MARGIN, MARGIN:-MARGIN] + 0.5
    for first, second, share in points:
        u = np.sqrt(first) * np.array([np.cos(2 * np.pi * second), np.sin(2 * np.pi * second)]) + share * aside
        start = places - share * at_infinity * aside
        met = (3.0 + (start - [0.5 * columns, 0.5 * rows]) @ slope) / (1.0 - slope @ u)
        seen = start + met[..., None] * u - 0.5
        total += map_coordinates(light, [seen[..., 1], seen[..., 0]], order=1)
    error = statistics(z_scores(found, total / len(points), 2000.0))
    assert error.p99_9 < 0.15 and abs(error.mean) < 0.01


def rolling(rows: int, line_s: float, time_s: float) -> LineTimes:
    """Rows that open one after the other."""
    opens = line_s * np.arange(rows)
    return LineTimes("rows", opens, opens, opens + time_s, opens + time_s, np.ones(rows))


def test_each_row_of_a_rolling_shutter_has_its_own_instants():
    """A layer that moves 12 photosites while a row is open, and as many while the shutter rolls over 48 rows."""
    radii_px, way_px = (-4.0, 3.0), (12.0, 0.0)
    case = bars_before_a_wall(*radii_px)
    rows = case.colour.shape[1]
    planned = moving_plan(case, None, (way_px, None), rolling(rows, 1.0 / 48.0, 1.0))
    motion, way = planned.optics.defocus.motion, ways_px(radii_px, SteadyMotion(), way_px)
    assert motion.cell_size(32, 8)[1] == 2
    found = moving_picture(case, planned)
    for row in (0, 13, 30):
        began = (MARGIN + row) / 48.0
        truth = dense_picture(case, lambda share, began=began: (began + share) * way, 1 << 12)[row]
        assert np.abs(z_scores(found[row], truth, 2000.0)).max() < 0.25  # 0.06 photosites from the middle of two rows


def test_a_crop_has_the_bits_of_the_frame():
    case = bars_before_a_wall(-4.0, 3.0)
    planned = moving_plan(case, SteadyMotion(right_m_per_s=0.002, roll_deg_per_s=3.0), lines=rolling(96, 0.01, 1.0))
    device = open_device()
    whole = device.download(expose(measure(planned, device), device), (96, 128), np.float32)
    window = Window(37, 21, 50, 40)
    part = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=window), strips=())
    cropped = device.download(expose(measure(part, device), device), (40, 50), np.float32)
    assert np.array_equal(cropped, whole[21:61, 37:87])
    assert planned.optics.defocus.motion.cell_size(32, 8)[0] == 32  # roll: cells differ


def test_a_lamp_draws_its_path_with_all_of_its_light():
    rows, columns, lamp = 96, 128, 4000.0
    light = np.full((rows, columns), 0.1)
    light[44, 60] += lamp
    shape = 1, rows, columns
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    case = Case("lamp", light[None], np.ones(shape), np.full(shape, 3.0), truth, MARGIN, 1, False)
    planned = moving_plan(case, None, ((16.0, 8.0),))
    found = moving_picture(case, planned) - 0.1
    assert abs(found.sum() / lamp - 1.0) < 1e-5
    y, x = np.mgrid[: truth.shape[0], : truth.shape[1]] + 0.5
    middle = [float((found * axis).sum() / found.sum()) for axis in (x, y)]
    assert np.allclose(middle, [60.5 - MARGIN + 8.0, 44.5 - MARGIN + 4.0], atol=0.02)
    spread = [float((found * (axis - at) ** 2).sum() / found.sum()) for axis, at in zip((x, y), middle, strict=True)]
    expected = (
        np.array([16.0**2, 8.0**2]) / 12.0 + 9.0 / 4.0 + 1.0 / 6.0
    )  # path, disk, and the photosite's square over the lamp's
    assert np.allclose(spread, expected, rtol=0.02)


def test_what_has_come_far_is_read_where_it_is():
    """A layer that has moved 500 photosites since the clock was 0 needs no margin of 500 photosites."""
    radii_px, way_px = (-3.0, 2.0), (10.0, 0.0)
    case = bars_before_a_wall(*radii_px, columns=704)
    planned = moving_plan(case, None, (way_px, None), start_s=50.0)
    defocus, way = planned.optics.defocus, ways_px(radii_px, SteadyMotion(), way_px)
    assert defocus.reach_px < 20 and defocus.aside_px(0)[0] == pytest.approx(-505, abs=1)
    part = dataclasses.replace(planned.optics, window=Window(560, MARGIN, 48, 32))
    device = open_device()
    planned = measure(dataclasses.replace(planned, optics=part, strips=()), device)
    found = device.download(expose(planned, device), (32, 48), np.float32) / planned.optics.weights.sum()
    seen = dataclasses.replace(
        case,
        colour=np.stack([case.colour[0][:, 60 - MARGIN : 108 + MARGIN], case.colour[1][:, 560 - MARGIN : 608 + MARGIN]]),
        coverage=np.stack([case.coverage[0][:, 60 - MARGIN : 108 + MARGIN], case.coverage[1][:, 560 - MARGIN : 608 + MARGIN]]),
        radius_px=case.radius_px[:, :, : 48 + 2 * MARGIN],
    )
    truth = dense_picture(seen, lambda share: share * way, 1 << 12)
    assert statistics(z_scores(found, truth, 2000.0)).p99_9 < 0.12


def test_moving_blocks_sample_the_aperture():
    planned = moving_plan(bars_before_a_wall(-4.0, 3.0), CAMERA)
    chosen = plan_tiles(planned.optics, open_device()).chosen
    assert set(chosen.blocks.methods[chosen.blocks.computed].tolist()) == {Method.OCCLUSION}


@pytest.mark.parametrize("radii_px", [(-5.0, 6.0), (0.0, 5.0)])
def test_rays_over_lens_and_time_see_the_same(radii_px):
    case = bars_before_a_wall(*radii_px, rows=72, columns=88)
    way_px = -8.0, 3.0
    way = ways_px(radii_px, CAMERA, way_px)
    planned = moving_plan(case, CAMERA, (way_px, None), tolerance=0.0)
    planned = with_accuracy(planned, Accuracy, rays=1024)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # 8192 rays do not reach the reference's own promise
        found = moving_picture(case, planned)
    truth = dense_picture(case, lambda share: share * way, 1 << 13)
    error = statistics(z_scores(found, truth, 2000.0))
    assert error.p99_9 < 0.2 and abs(error.mean) < 0.01


def test_rays_meet_one_picture_that_moves():
    """A wall at one distance, as a map of distances: the ray that is followed step by step meets it as one layer does."""
    case = bars_before_a_wall(-5.0, 4.0, rows=72, columns=88)
    flat = dataclasses.replace(case, colour=case.colour[1:], coverage=case.coverage[1:], radius_px=case.radius_px[1:].copy())
    flat.radius_px[0, 0, 0] = 4.02  # a map
    camera = SteadyMotion(right_m_per_s=0.08, pan_deg_per_s=np.degrees(np.arctan(0.04)))
    planned = with_accuracy(moving_plan(flat, camera, tolerance=0.0), Accuracy, rays=1024)
    assert planned.optics.defocus.motion.largest_aperture > 3.0
    way = ways_px((4.0, 4.0), camera, (0.0, 0.0))[:1] - [image_distance_px() * 0.04, 0.0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = moving_picture(flat, planned)
    truth = dense_picture(dataclasses.replace(flat, radius_px=np.full_like(flat.radius_px, 4.0)), lambda share: share * way)
    assert statistics(z_scores(found, truth, 2000.0)).p99 < 0.2


def test_layers_that_move_apart_are_planned_as_joint_samples():
    """The same picture as from hand-made paths, its error told, and rotation of one layer alone left to its instants."""
    case, way_px = bars_before_a_wall(-4.0, 3.0), (12.0, 3.0)
    shot = case_shot(case)
    time_s = shot.exposure.time_s
    speeds = tuple(Speed(way / time_s, "px/s") for way in way_px)
    moving = dataclasses.replace(shot, motion=Motion(layers={0: LayerMotion((speeds[0], speeds[1]))}))
    planned = plan(moving)
    assert planned.optics.motion.method == "joint"
    assert 0.0 < planned.optics.accuracy.in_sigma(planned.optics.motion.error) < 0.1
    expected = moving_picture(case, moving_plan(case, None, (way_px, None)))
    assert np.abs(z_scores(moving_picture(case, planned), expected, 2000.0)).max() < 0.01
    flat = dataclasses.replace(case, colour=case.colour[1:], coverage=case.coverage[1:], radius_px=case.radius_px[1:])
    turned = dataclasses.replace(case_shot(flat), motion=Motion(camera=SteadyMotion(roll_deg_per_s=5.0 / time_s)))
    assert plan(turned).optics.motion.method == "instants"


def test_a_stopped_down_picture_with_depth_shows_its_parallax():
    """Blur circles that are left out at rest: the picture still moves by its distances."""
    rows, columns = 96, 128
    y, x = np.mgrid[:rows, :columns]
    radius = (0.004 * (x - 64))[None]
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    light = texture(np.random.default_rng(1), rows, columns)[None]
    case = Case("deep", light, np.ones((1, rows, columns)), radius, truth, MARGIN, 1, False)
    shot = case_shot(case)
    assert plan(shot).optics.defocus is None
    camera = SteadyMotion(right_m_per_s=0.003 / shot.exposure.time_s)
    planned = plan(dataclasses.replace(shot, motion=Motion(camera=camera)))
    assert planned.optics.motion.method == "joint" and planned.optics.defocus is not None
    assert np.ptp(moving_picture(case, planned)) > 0.1
