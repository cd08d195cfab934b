"""Motion behind a defocused lens: aperture and time together, against dense sums over both in float64."""

import dataclasses
import warnings

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import case_shot, depth_of, with_accuracy
from helpers.lens_truths import Case
from helpers.moving_frame import rolling, without_edges
from helpers.moving_layers import (
    MARGIN,
    bars_before_a_wall,
    dense_picture,
    image_distance_px,
    light_texture,
    moving_picture,
    moving_plan,
)
from helpers.tilted_surfaces import plane, shifted_plan, surface_case, surface_error
from helpers.tilted_surfaces import texture as smooth_and_hard

from simulator.device import open_device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.optics.defocus.accuracy import LAMP_PEAK, Accuracy
from simulator.optics.defocus.aperture_samples import move_samples
from simulator.optics.defocus.defocus import Method
from simulator.optics.defocus.joint_motion import Cells
from simulator.optics.defocus.predicted_error import LAYERS, error_terms, predicted_error
from simulator.optics.passes.tile_plan import plan_tiles
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera_sections import Window

CAMERA = SteadyMotion(right_m_per_s=0.003, up_m_per_s=0.001)


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
        pytest.param((-3.0, 10.0), SteadyMotion(right_m_per_s=0.002, up_m_per_s=0.002), (12.0, -3.0), marks=pytest.mark.slow),
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


@pytest.mark.parametrize(
    ("slope", "way", "start_s", "middle_px"),
    [
        ((0.05, 0.0), (-1.7, 0.0), 0.0, 3.0),
        pytest.param((0.09, -0.04), (1.0, 0.3), 3.0, 0.0, marks=pytest.mark.slow),  # slope times shift 0.5
        pytest.param((0.02, 0.0), (8.0, 0.5), 0.5, -2.0, marks=pytest.mark.slow),
    ],
)
def test_a_tilted_picture_shows_its_parallax(slope, way, start_s, middle_px):
    """Near and far parts of one picture move by different amounts when the camera moves aside."""
    case = surface_case(smooth_and_hard(np.random.default_rng(1), 0), plane(middle_px, np.array(slope)))
    error = surface_error(case, np.array(way), middle_px, start_s, 1 << 11, steps=1)
    assert error.p99_9 < 0.12 and abs(error.mean) < 0.005


def random_surface(number: int) -> tuple[Case, np.ndarray, float, float]:
    """A case of any slope, radius and detail, the camera's shift in a second, the radius that rests, and when it begins."""
    rng = np.random.default_rng(1000 + number)
    light, (slope, lean) = smooth_and_hard(rng, number % 4), rng.uniform((0.01, 0.05), (0.12, 0.6))
    shift = min(max(lean / slope - 1.0, 0.1), 10.0, 30.0 / (100.0 * slope))
    start_s, way = [(0.0, shift), (-0.5, 2.0 * shift), (3.0, 0.25 * shift)][rng.integers(3)]
    toward = [np.array([np.cos(angle), np.sin(angle)]) for angle in rng.uniform(0.0, 2.0 * np.pi, 2)]
    middle_px = rng.uniform(-7.0, 7.0)
    return surface_case(light, plane(middle_px, slope * toward[0])), way * toward[1], middle_px, start_s


@pytest.mark.parametrize("number", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (*range(1, 36), 40))])
def test_the_predicted_error_of_tilted_surfaces_is_not_below_what_is_found(number):
    case, way, pivot_px, start_s = random_surface(number)
    found = surface_error(case, way, pivot_px, start_s, 1 << 11, steps=1).p99_9
    optics = shifted_plan(case, way, pivot_px, start_s).optics
    assert found <= predicted_error(optics.defocus, optics.contrast)


def test_no_cause_takes_from_the_error_of_others():
    """Lamps of which the border of the scene has fewer than the rest, whose texture is above the curvature of all of it."""
    optics = shifted_plan(*random_surface(27)).optics
    assert optics.contrast.texture > optics.contrast.curvature
    assert min(term.sigma for term in error_terms(optics.defocus, optics.contrast)) >= 0.0


def test_each_row_of_a_rolling_shutter_has_its_own_instants():
    """A layer that moves 12 photosites while a row is open, and as many while the shutter rolls over 48 rows."""
    radii_px, way_px = (-4.0, 3.0), (12.0, 0.0)
    case = bars_before_a_wall(*radii_px)
    rows = case.colour.shape[1]
    planned = moving_plan(case, None, (way_px, None), rolling(rows, 1.0, 1.0 / 48.0))
    motion, way = planned.optics.defocus.motion, ways_px(radii_px, SteadyMotion(), way_px)
    assert motion.cells(32, 8).points == "places"
    found = moving_picture(case, planned)
    for row in (0, 13, 30):
        began = (MARGIN + row) / 48.0
        truth = dense_picture(case, lambda share, began=began: (began + share) * way, 1 << 12)[row]
        assert np.abs(z_scores(found[row], truth, 2000.0)).max() < 0.12


def test_points_grow_over_the_rows_of_a_block():
    """A layer that moves 12 photosites while a row is open, and 1/16 from row to row; the sensor ends within a block."""
    radii_px, way_px, line_s = (-5.0, 0.0), (12.0, 0.0), 1.0 / 192.0
    case = bars_before_a_wall(*radii_px, rows=101)
    rows = case.colour.shape[1]
    planned = moving_plan(case, None, (way_px, None), rolling(rows, 1.0, line_s))
    motion, way = planned.optics.defocus.motion, ways_px(radii_px, SteadyMotion(), way_px)
    cells = motion.cells(32, 8)
    assert cells.rows == 8 and cells.points == "rows"
    found = moving_picture(case, planned)
    for row in (5, rows - 2 * MARGIN - 1):
        began = (MARGIN + row) * line_s
        truth = dense_picture(case, lambda share, began=began: (began + share) * way, 1 << 11)[row]
        assert np.abs(z_scores(found[row], truth, 2000.0)).max() < 0.15  # 0.03 photosites from the middle of two rows


@pytest.mark.parametrize(
    ("camera", "way_px", "points"),
    [
        (None, (12.0, 0.0), "rows"),
        pytest.param(SteadyMotion(roll_deg_per_s=0.5), (2.0, 0.0), "places", marks=pytest.mark.slow),
    ],
)
def test_light_beside_a_lamp_is_not_below_that_of_the_scene(camera, way_px, points):
    """Of photosites that look a little beyond their block's samples, beside a pixel ten thousand times as bright."""
    case = bars_before_a_wall(-5.0, 0.0, rows=101)
    case.colour[0, 50, 64] = 1e4
    least = float(np.where(case.coverage[0] > 0.0, case.colour[0], case.colour[1]).min())
    planned = moving_plan(case, camera, (way_px, None), rolling(101, 1.0, 1.0 / 192.0))
    assert planned.optics.defocus.motion.cells(32, 8).points == points
    found = moving_picture(case, planned)
    assert found.min() > 0.999 * least and found.max() > 1.0


@pytest.mark.parametrize("way_px", [(12.0, 9.0), (-12.0, -9.0)])
def test_rows_beside_a_lamp_miss_no_hole_that_lies_between_their_samples(way_px):
    """Few holes in a layer before another of the same light: none is dark, since rows know of each that they read."""
    case = bars_before_a_wall(-5.0, 0.0, rows=165)
    case.coverage[0] = np.random.default_rng(8).random(case.coverage[0].shape) > 0.002
    case.colour[0], case.colour[1] = case.coverage[0], 1.0
    planned = moving_plan(case, None, (way_px, None), rolling(165, 1.0, 1.0 / 256.0))
    planned = with_accuracy(planned, Accuracy, peak=LAMP_PEAK)
    assert planned.optics.defocus.motion.cells(32, 8).points == "rows"
    found = moving_picture(case, planned)
    assert found.min() > 1.0 - 1e-5 and found.max() < 1.0 + 1e-4


def test_a_lamp_leaves_nothing_where_a_photosite_begins_its_sums():
    """Sums begin at the sample that lies half of the frame's path aside, which a row that is open early does not see."""
    case = bars_before_a_wall(-0.4, 5.0, rows=101)
    dark = moving_plan(case, None, ((12.0, 0.0), None), rolling(101, 1.0, 0.05))
    expected, (across, _) = moving_picture(case, dark), dark.optics.defocus.motion.rest_px[0]
    case.colour[0, 35, 40] = 1e9
    found = moving_picture(case, moving_plan(case, None, ((12.0, 0.0), None), rolling(101, 1.0, 0.05)))
    place = 35 - MARGIN, 40 - across - MARGIN
    assert found[place] == pytest.approx(expected[place], rel=1e-5)
    assert found[place[0]].max() > 1e6


def test_points_grow_to_those_of_the_next_rows():
    """The points of each pair of rows are those of a cell of two rows, also where the sensor ends within a block."""
    case = bars_before_a_wall(-4.0, 3.0, rows=101)
    motion = moving_plan(case, SteadyMotion(roll_deg_per_s=2.0), lines=rolling(101, 1.0, 0.005)).optics.defocus.motion
    samples, shares = np.random.default_rng(1).random((1, 64, 5)).astype(np.float32), np.linspace(0.01, 0.99, 64)
    grown = move_samples(samples, shares, motion, np.array([[16.0, 20.0], [16.0, 100.0]]), Cells(32, 8, "rows", 0.0))
    for number, middle in enumerate((20.0, 100.0)):
        for pair in range(4 if number == 0 else 2):
            y = middle + 2.0 * pair - 3.0
            exact = move_samples(samples, shares, motion, np.array([[16.0, y]]), Cells(32, 2, "even", 0.0))[0]
            place = grown[number, ..., :4] + (pair - 1.5) * grown[number, ..., 5:]
            assert np.abs(place - exact[..., :4]).max() < 0.003  # photosites: straight pieces of paths are 0.002 beside them


def test_a_crop_has_the_bits_of_the_frame():
    case = bars_before_a_wall(-4.0, 3.0)
    planned = moving_plan(case, SteadyMotion(right_m_per_s=0.002, roll_deg_per_s=3.0), lines=rolling(96, 1.0, 0.01))
    device = open_device()
    whole = device.download(expose(measure(planned, device), device), (96, 128), np.float32)
    window = Window(37, 21, 50, 40)
    part = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=window), strips=())
    cropped = device.download(expose(measure(part, device), device), (40, 50), np.float32)
    assert np.array_equal(cropped, whole[21:61, 37:87])
    assert planned.optics.defocus.motion.cells(32, 8).points == "places"


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


@pytest.mark.slow
def test_layers_that_move_apart_are_planned_as_joint_samples():
    """The same picture as from hand-made paths, its error told, and one layer alone swept before it is blurred."""
    case, way_px = bars_before_a_wall(-4.0, 3.0), (12.0, 3.0)
    shot = case_shot(case)
    time_s = shot.exposure.time_s
    speeds = tuple(Speed(way / time_s, "px/s") for way in way_px)
    moving = dataclasses.replace(shot, motion=Motion(layers={0: LayerMotion((speeds[0], speeds[1]))}))
    planned = plan(moving)
    assert planned.optics.motion.method == "joint"
    assert 0.0 < planned.optics.accuracy.in_sigma(planned.optics.motion.error) < 0.1
    expected = moving_picture(case, moving_plan(case, None, (way_px, None)))
    means = without_edges(planned)  # as the hand-made one
    assert np.abs(z_scores(moving_picture(case, means), expected, 2000.0)).max() < 0.01
    flat = dataclasses.replace(case, colour=case.colour[1:], coverage=case.coverage[1:], radius_px=case.radius_px[1:])
    turned = dataclasses.replace(case_shot(flat), motion=Motion(camera=SteadyMotion(roll_deg_per_s=5.0 / time_s)))
    assert plan(turned).optics.motion.method == "swept_first"


def test_a_stopped_down_picture_with_depth_shows_its_parallax():
    """Blur circles that are left out at rest: the picture still moves by its distances."""
    rows, columns = 96, 128
    y, x = np.mgrid[:rows, :columns]
    radius = (0.004 * (x - 64))[None]
    truth = np.zeros((rows - 2 * MARGIN, columns - 2 * MARGIN))
    light = light_texture(np.random.default_rng(1), rows, columns)[None]
    case = Case("deep", light, np.ones((1, rows, columns)), radius, truth, MARGIN, 1, False)
    shot = case_shot(case)
    assert plan(shot).optics.defocus is None
    camera = SteadyMotion(right_m_per_s=0.003 / shot.exposure.time_s)
    planned = plan(dataclasses.replace(shot, motion=Motion(camera=camera)))
    assert planned.optics.motion.method == "joint" and planned.optics.defocus is not None
    assert np.ptp(moving_picture(case, planned)) > 0.1


def box_before_a_wall() -> tuple[Case, Case]:
    """A textured box before an even wall, as layers and as one picture with depth, with hidden wall behind the box."""
    case = bars_before_a_wall(-1.0, 1.5)
    near = np.zeros_like(case.coverage[0])
    near[36:60, 44:84] = 1.0
    case = dataclasses.replace(
        case, colour=np.stack([case.colour[1] * near, np.full(near.shape, 0.8)]), coverage=np.stack([near, np.ones_like(near)])
    )
    flat = np.where(near > 0.0, case.colour[0], 0.8), np.where(near > 0.0, case.radius_px[0], case.radius_px[1])
    return case, dataclasses.replace(case, colour=flat[0][None], coverage=case.coverage[1:], radius_px=flat[1][None])


def around_the_focus(shot: Shot) -> Shot:
    """The shot from a camera that moves aside by 8 cm while it is open, and turns so that what is in focus rests."""
    time_s = shot.exposure.time_s
    camera = SteadyMotion(right_m_per_s=0.08 / time_s, pan_deg_per_s=np.degrees(np.arctan(0.04)) / time_s)
    return dataclasses.replace(shot, motion=Motion(camera=camera))


def test_hidden_background_that_parallax_shows_is_continued_as_far_as_it_shows():
    """The camera uncovers eleven photosites of the wall, four times as many as the lens sees of it at rest."""
    layers, flat = box_before_a_wall()
    aside = ways_px((-1.0, 1.5), SteadyMotion(right_m_per_s=0.08), (0.0, 0.0))
    turn = np.array([image_distance_px(), 0.0])
    truth = dense_picture(layers, lambda share: share * aside - turn * np.tan(share * np.arctan(0.04)), 1 << 12)
    assert abs(aside[0, 0] - aside[1, 0]) > 11.0
    found = {}
    for name, case, hidden in (("layers", layers, "none"), ("extend", flat, "extend"), ("none", flat, "none")):
        planned = plan(around_the_focus(case_shot(case, hidden=hidden)))
        assert planned.optics.motion.method == "joint"
        found[name] = statistics(z_scores(moving_picture(case, planned), truth, 2000.0)).p99
    assert found["layers"] < 0.1 and found["extend"] < 0.6 < 3.0 < found["none"]


def test_hidden_background_that_parallax_shows_is_told_as_a_limit_of_the_input():
    """A texture behind the edges that the picture does not show: not the method, but layers help."""
    _, flat = box_before_a_wall()
    flat = dataclasses.replace(flat, colour=light_texture(np.random.default_rng(8), *flat.colour.shape[1:])[None])
    warnings = plan(around_the_focus(case_shot(flat, hidden="extend"))).warnings()
    (warning,) = (one for one in warnings if "is not met" not in one)  # that of the method stands apart
    assert "background behind edges, which the scene does not show" in warning and LAYERS in warning
    even = dataclasses.replace(flat, radius_px=np.full_like(flat.radius_px, 2.0))
    assert not any("background" in one for one in plan(around_the_focus(case_shot(even))).warnings())
