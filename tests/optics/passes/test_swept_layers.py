"""Layers that move apart without a turn: composited at each instant, against the same sums and dense means in float64."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.layer_truth import dense_layers, exact_layers
from helpers.moving_frame import moving_light, plan_moving, rolling, without_edges
from helpers.scene_builders import FixedScene, band_scene
from scipy.ndimage import map_coordinates
from scipy.stats import qmc

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import LineTimes
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_samples import disk_of_square, moving_samples, sample_count
from simulator.optics.geometry.motion_cost import sweep_cost_ms
from simulator.optics.geometry.rows_between import PHASES
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.error_budget import error_budget
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera import Window

LENS, TIME_S = ThinLens(50.0, 8.0, cos4=False), 0.01
WIDTH, HEIGHT = 150, 24  # two spans of a row
DISTANCE_PX = LENS.image_distance_mm / 0.04
RNG = np.random.default_rng(8)
LIGHT = RNG.random((5, HEIGHT, WIDTH))
COVERAGE = np.round(np.kron(RNG.random((5, HEIGHT // 6, WIDTH // 6)), np.ones((6, 6))) * 1.4, 1).clip(0.0, 1.0)
COVERAGE[:, :, ::2] *= 0.9  # and hard edges between
EVEN = np.full_like(COVERAGE, 0.6)  # no edge crosses a photosite
WAYS = {"front": ((9.3, 3.1), None), "apart": ((9.3, 3.1), (-4.2, 6.7)), "between": (None, (0.3, -6.2), None, (7.0, 0.0), None)}


def shot_of(ways_px, cfa="MONO", coverage=COVERAGE, **settings) -> Shot:
    """Layers, the last one opaque, that move by ways to the right and down in the exposure [px]; None: at rest."""
    bands = np.ones(1) if cfa == "MONO" else np.array([1.0, 0.7, 0.4])
    planes = [(LIGHT[n] * coverage[n])[..., None] * bands for n in range(len(ways_px) - 1)] + [LIGHT[4][..., None] * bands]
    depths = 2000.0 + 400.0 * np.arange(len(ways_px))
    behind = [
        Layer(plane.astype(np.float32), depth, None if plane is planes[-1] else own.astype(np.float32))
        for plane, depth, own in zip(planes[1:], depths[1:], coverage[1:], strict=False)
    ]
    scene = band_scene(planes[0], depths[0], coverage=coverage[0].astype(np.float32), behind=tuple(behind))
    moves = {n: LayerMotion(tuple(Speed(way / TIME_S, "px/s") for way in own)) for n, own in enumerate(ways_px) if own}
    camera = small_camera(WIDTH, HEIGHT, cfa=cfa, pixel_pitch_um=40.0)
    return Shot(scene, LENS, Exposure(TIME_S), camera, motion=Motion(layers=moves), tolerance=0.05, **settings)


def dense(ways_px, opens_s: np.ndarray, instants: int, weights: np.ndarray | None = None, borders=None) -> np.ndarray:
    """Mean over so many instants of layers that are read bilinearly and composited front to back, float64.

    borders: of intervals with an instant in the middle, as shares of the exposure; None: even ones.
    """
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    borders = np.linspace(0.0, 1.0, instants + 1) if borders is None else borders
    total, weights = np.zeros(x.shape), np.diff(borders) if weights is None else weights

    def read(plane: np.ndarray, way_px: tuple[float, float] | None, share: float) -> np.ndarray:
        come = opens_s[:, None] / TIME_S + share
        across, down = way_px or (0.0, 0.0)
        return map_coordinates(plane, (y - come * down, x - come * across), order=1, mode="nearest")

    for share, weight in zip(0.5 * (borders[1:] + borders[:-1]), weights / weights.sum(), strict=True):
        through = np.full(x.shape, weight)
        for n, way in enumerate(ways_px):
            is_last = n + 1 == len(ways_px)
            total += through * read(LIGHT[4] if is_last else LIGHT[n] * COVERAGE[n], way, share)
            if not is_last:
                through *= 1.0 - read(COVERAGE[n], way, share)
    return total


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
@pytest.mark.parametrize("ways_px", [WAYS["front"], WAYS["apart"], WAYS["between"][:3]], ids=["front", "apart", "between"])
def test_layers_are_composited_at_each_instant(ways_px, row_s):
    planned = plan_moving(shot_of(ways_px), rolling(HEIGHT, TIME_S, row_s))
    assert planned.optics.motion.method == "swept" and planned.optics.sweeps_shifted_layers()
    found, opens, count = moving_light(without_edges(planned)), row_s * np.arange(HEIGHT), planned.optics.motion.count
    borders = planned.optics.motion.path.borders(count)
    assert np.abs(found - dense(ways_px, opens, count, borders=borders)).max() < 5e-6
    assert np.quantile(np.abs(found - dense(ways_px, opens, 4 * count)), 0.999) < planned.optics.motion.error


def test_a_shutter_that_opens_slowly_weighs_instants():
    opens, ways_px = 1e-4 * np.arange(HEIGHT), WAYS["apart"]
    ramps = opens + 0.6 * TIME_S, opens + 0.6 * TIME_S, opens + TIME_S
    planned = plan_moving(shot_of(ways_px), LineTimes("rows", opens, *ramps, np.ones(HEIGHT)))
    assert planned.optics.sweeps_shifted_layers() and planned.optics.motion.path.straight_shift(1) is None
    shares = (np.arange(256) + 0.5) / 256
    truth = dense(ways_px, opens, 256, np.where(shares < 0.6, shares / 0.6, (1.0 - shares) / 0.4))
    assert np.quantile(np.abs(moving_light(without_edges(planned)) - truth), 0.999) < planned.optics.motion.error


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_colours_are_those_of_single_planes_and_a_crop_has_the_bits_of_the_frame(row_s):
    planned = plan_moving(shot_of(WAYS["apart"], "RGGB"), rolling(HEIGHT, TIME_S, row_s))
    found = moving_light(without_edges(planned))
    for row, column, plane in ((0, 0, 0), (0, 1, 1), (1, 0, 1), (1, 1, 2)):
        alone = moving_light(without_edges(replace(planned, optics=planned.optics.in_one_color(plane))))
        assert np.array_equal(found[row::2, column::2], alone[row::2, column::2])
    part = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 90, 12)))
    assert planned.optics.sweeps_shifted_layers() and np.array_equal(moving_light(without_edges(part)), found[5:17, 17:107])


@pytest.mark.slow
def test_more_layers_than_one_launch_composites_are_swept_one_by_one():
    planned = plan_moving(shot_of(WAYS["between"]))
    assert planned.optics.covering_layers == 5 and not planned.optics.sweeps_shifted_layers()
    truth = dense(WAYS["between"], np.zeros(HEIGHT), planned.optics.motion.count)
    assert np.abs(moving_light(planned) - truth).max() < 3e-5


def test_a_camera_that_moves_before_layers_shifts_each_by_its_distance_and_one_that_turns_does_not():
    shot = shot_of((None, None))
    aside = plan_moving(replace(shot, motion=Motion(camera=SteadyMotion(right_m_per_s=800.0))))
    assert aside.optics.sweeps_shifted_layers()
    own = aside.optics.motion.path
    ways = [tuple(np.diff(own.straight_shift(n), axis=0)[0, 0]) for n in range(2)]
    assert ways[0][0] == pytest.approx(1.2 * ways[1][0], rel=1e-6)  # at 2000 m and at 2400 m
    count = aside.optics.motion.count
    truth = dense([(-x, -y) for x, y in ways], np.zeros(HEIGHT), count, borders=own.borders(count))
    assert abs(ways[0][0]) > 3.0 and np.abs(moving_light(without_edges(aside)) - truth).max() < 5e-6
    turned = plan_moving(replace(shot, motion=Motion(camera=SteadyMotion(pan_deg_per_s=40.0))))
    assert turned.optics.motion.method == "swept" and not turned.optics.sweeps_shifted_layers()


def panned(cfa="MONO") -> Shot:
    """Layers that move apart under a pan, which shifts photosites by 6 to 6.04 photosites and turns rows."""
    camera = SteadyMotion(
        pan_deg_per_s=math.degrees(6.0 / DISTANCE_PX) / TIME_S, tilt_deg_per_s=math.degrees(4.0 / DISTANCE_PX) / TIME_S
    )
    shot = shot_of((WAYS["front"][0], None), cfa)
    return replace(shot, motion=replace(shot.motion, camera=camera))


def dense_pan(weights: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """Mean over instants (rows or 1, instants) of what rays through the lens see of the layers of `panned`, float64."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] + 0.5 - np.array([HEIGHT, WIDTH])[:, None, None] / 2.0
    total = np.zeros(x.shape)
    for weight, time_s in zip(weights.T, times_s.T, strict=True):
        pan, tilt = (np.broadcast_to(way / DISTANCE_PX * time_s / TIME_S, HEIGHT)[:, None] for way in (6.0, 4.0))
        up, back = -y * np.cos(tilt) + DISTANCE_PX * np.sin(tilt), y * np.sin(tilt) + DISTANCE_PX * np.cos(tilt)
        right, back = x * np.cos(pan) - back * np.sin(pan), x * np.sin(pan) + back * np.cos(pan)
        column, row = (DISTANCE_PX * place / back + side / 2.0 - 0.5 for place, side in ((right, WIDTH), (-up, HEIGHT)))
        come = np.broadcast_to(time_s / TIME_S, HEIGHT)[:, None]
        (across, down), seen = WAYS["front"][0], {"order": 1, "mode": "nearest"}
        at = row - come * down, column - come * across
        cover = map_coordinates(COVERAGE[0], at, **seen)
        light = map_coordinates(LIGHT[0] * COVERAGE[0], at, **seen) + (1.0 - cover) * map_coordinates(
            LIGHT[4], (row, column), **seen
        )
        total += np.broadcast_to(weight, HEIGHT)[:, None] * light
    return total


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_layers_that_drift_along_rows_are_composited_at_each_instant(row_s):
    planned = plan_moving(panned(), rolling(HEIGHT, TIME_S, row_s))
    optics = planned.optics
    assert optics.sweeps_drifting_layers and not optics.sweeps_shifted_layers() and max(optics.motion.slopes) > 1e-4
    instants = optics.motion.window_instants(optics.window)
    truth = dense_pan(instants.weights, instants.times_s)
    assert np.abs(moving_light(planned) - truth).max() < 1e-5


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_a_crop_of_layers_that_drift_has_the_bits_of_the_frame(row_s):
    planned = plan_moving(panned("RGGB"), rolling(HEIGHT, TIME_S, row_s))
    part = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 90, 12)))
    assert part.optics.sweeps_drifting_layers and np.array_equal(moving_light(part), moving_light(planned)[5:17, 17:107])


def test_layers_before_diffraction_are_swept_in_all_colours():
    """Swept once and blurred once is the sum of the images at the instants of the sweep."""
    shot = replace(shot_of(WAYS["apart"], "RGGB"), lens=replace(LENS, f_number=64.0, diffraction=True), tolerance=0.1)
    planned = plan_moving(shot)
    motion = planned.optics.motion
    assert motion.method == "swept_first" and planned.optics.sweeps_shifted_layers(motion.blur.samples_per_axis)
    found = moving_light(planned)
    many = replace(motion, count=4 * motion.count)
    truth = moving_light(replace(planned, optics=replace(planned.optics, motion=many)))
    assert np.quantile(np.abs(found - truth), 0.999) < motion.error


def test_layers_behind_the_last_that_moves_are_predicted_to_be_read_once():
    """Of two layers three planes are read at each instant, or two if the far one is at rest."""
    costs = []
    for ways_px in (((7.0, 7.0), None), ((7.0, 7.0), (-7.0, 7.0))):
        cost_ms = next(one.cost_ms for one in plan(shot_of(ways_px, coverage=EVEN)).passes if one.name == "motion")
        costs.append(cost_ms - sweep_cost_ms("shifting layers", 0))
    assert costs[1] == pytest.approx(1.5 * costs[0])


@pytest.mark.parametrize("ways_px", [((9.3, 3.1), (0.0, 0.0)), ((0.0, 0.0), (-4.2, 6.7))], ids=["front", "back"])
def test_one_layer_that_varies_within_photosites_errs_by_no_edges(ways_px):
    """The other is even in each photosite, so that mean coverage hides just the light that it does. Both means in float64."""
    optics = plan_moving(shot_of([way if any(way) else None for way in ways_px])).optics
    layers = [
        (light[..., 0].astype(float), cover) for light, cover in ((one.planes, one.coverage) for one in optics.scene.layers)
    ]
    held = optics.scene, optics.projection, ways_px, np.zeros(HEIGHT), WIDTH, 7
    assert np.abs(dense_layers(*held) - exact_layers(layers, *held[1:])).max() < 1e-6
    assert optics.varies_in_one_layer


def test_edges_of_a_layer_that_spins_err_where_what_is_behind_varies_within_photosites():
    shot, spin, aside = shot_of(WAYS["front"]), LayerMotion(spin_deg_per_s=200.0), LayerMotion((Speed(700.0, "px/s"),) * 2)
    rest, moves = (plan_moving(replace(shot, motion=Motion(layers=own))).optics for own in ({0: spin}, {0: spin, 1: aside}))
    between = replace(rest, projection=replace(rest.projection, offset_x=0.5))
    assert rest.varies_in_one_layer and not moves.varies_in_one_layer and not between.varies_in_one_layer
    far = plan_moving(replace(shot, motion=Motion(layers={0: LayerMotion(spin_deg_per_s=2000.0)}))).optics  # by 20 degrees
    plans = rest, moves, between, far
    told = [any("edges of layers" in term.cause for term in error_budget(optics).terms) for optics in plans]
    assert told == [False, True, True, True]


BLURRED = ThinLens(50.0, 1.4, 2.0, cos4=False, transmittance=4.7e-4)  # the brightest light gives some 2000 e-


def blurred_shot(cfa="MONO") -> Shot:
    """Two layers before and behind the plane in focus, each with a way of its own."""
    shot = shot_of(WAYS["apart"], cfa)
    near = shot.scene.load()
    (far,) = near.behind
    scene = FixedScene(replace(near, depth_m=1.6, behind=(replace(far, depth_m=2.6),)))
    return replace(shot, scene=scene, lens=BLURRED, tolerance=1.0)


def dense_blur(radii_px, points: np.ndarray, opens_s: np.ndarray, rows: int = 0) -> np.ndarray:
    """Mean of the layers over points x, y of the aperture [pupil radii] and shares of the time, (points, 3), float64.

    rows: places per row, of which each point reads the nearest; 0: at its own.
    """
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    total = np.zeros(x.shape)
    for right, below, share in points:
        come, at = opens_s[:, None] / TIME_S + share, []
        for radius_px, (across, down) in zip(radii_px, WAYS["apart"], strict=True):
            there = y + radius_px * below - come * down
            at.append((np.rint(rows * there) / rows if rows else there, x + radius_px * right - come * across))
        near, cover = (
            map_coordinates(plane, at[0], order=1, mode="nearest") for plane in (LIGHT[0] * COVERAGE[0], COVERAGE[0])
        )
        total += near + (1.0 - cover) * map_coordinates(LIGHT[4], at[1], order=1, mode="nearest")
    return total / len(points)


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_layers_out_of_focus_are_composited_at_points_of_aperture_and_time(row_s):
    """The same sums in float64, and many more points, which are at random."""
    planned, opens = plan_moving(blurred_shot(), rolling(HEIGHT, TIME_S, row_s)), row_s * np.arange(HEIGHT)
    optics = planned.optics
    blur = optics.moving_blur
    assert optics.motion.method == "joint" and optics.samples_shifted_layers and min(map(abs, blur.radii_px)) > 1.0
    found = moving_light(without_edges(planned))
    points = moving_samples(blur.pupil, int(sample_count(np.array([blur.largest_px]), blur)[0]), 1)
    samples = points[:, [0, 1, 5]].astype(np.float64)
    rounded, exact = (dense_blur(blur.radii_px, samples, opens, rows) for rows in (PHASES, 0))
    assert optics.reads_rows and np.abs(found - rounded).max() < 3e-6
    assert 0.1 * optics.rows_error < np.quantile(np.abs(rounded - exact), 0.999) < optics.rows_error
    sobol = qmc.Sobol(3, seed=77).random(1 << 11)
    y, x = disk_of_square(sobol[:, 0], sobol[:, 1])
    truth = dense_blur(blur.radii_px, np.stack([x, y, sobol[:, 2]], axis=-1), opens)
    assert np.quantile(np.abs(found - truth), 0.999) < optics.motion.error


@pytest.mark.parametrize("row_s", [0.0, 3e-4], ids=["global", "rolling"])
def test_a_crop_of_layers_out_of_focus_has_the_bits_of_the_frame(row_s):
    planned = plan_moving(blurred_shot("RGGB"), rolling(HEIGHT, TIME_S, row_s))
    part = replace(planned, optics=replace(planned.optics, window=Window(17, 5, 90, 12)))
    assert part.optics.samples_shifted_layers
    assert np.array_equal(moving_light(part), moving_light(planned)[5:17, 17:107])


def test_a_layer_in_focus_is_read_between_four_pixels():
    """Its rows are seen at places of their own, not spread over a circle."""
    shot = blurred_shot()
    near = shot.scene.load()
    shot = replace(shot, scene=FixedScene(replace(near, behind=(replace(near.behind[0], depth_m=2.001),))))
    planned = plan_moving(shot)
    optics = planned.optics
    blur = optics.moving_blur
    assert optics.samples_shifted_layers and not optics.reads_rows and abs(blur.radii_px[1]) < 0.1
    points = moving_samples(blur.pupil, optics.shifted_points, 1)[:, [0, 1, 5]].astype(np.float64)
    truth = dense_blur(blur.radii_px, points, np.zeros(HEIGHT))
    assert np.abs(moving_light(without_edges(planned)) - truth).max() < 3e-6


def test_edges_of_a_dark_layer_before_a_bright_one_count_in_the_noise_of_the_dark():
    """Neither layer has such an edge by itself."""
    rng, way = np.random.default_rng(5), (-6.0, -6.0)
    dark, cover = 0.001 + 1e-4 * rng.random((HEIGHT, WIDTH)), np.round(rng.random((HEIGHT, WIDTH))).astype(np.float32)
    behind = (Layer(np.ones((HEIGHT, WIDTH, 1), np.float32), 2400.0, None),)
    scene = band_scene(dark * cover, 2000.0, coverage=cover, behind=behind)
    moves = {0: LayerMotion((Speed(way[0] / TIME_S, "px/s"), Speed(way[1] / TIME_S, "px/s")))}
    shot = replace(shot_of(WAYS["front"]), scene=scene, motion=Motion(layers=moves), tolerance=0.1)
    electrons = electrons_per_light(plan_moving(shot))
    planned = plan_moving(replace(shot, lens=replace(LENS, transmittance=592.0 / electrons)))
    truth = dense_layers(scene.load(), planned.optics.projection, [way, None], np.zeros(HEIGHT), WIDTH, 200)
    found_e, truth_e = (592.0 * one for one in (moving_light(without_edges(planned)), truth))
    assert electrons_per_light(planned) == pytest.approx(592.0, rel=1e-3)
    error = np.abs(found_e - truth_e) / np.sqrt(truth_e + 1.0)
    assert np.quantile(error, 0.999) < 0.1


def electrons_per_light(planned) -> float:
    """Electrons of a photosite of light 1."""
    return float(planned.optics.accuracy.electrons_per_radiance * planned.optics.weights.sum())


def test_what_a_layer_shows_as_it_moves_counts_with_its_edges():
    """A dark layer hides at rest all that is bright behind it; where it moves up its edge lies before that."""
    dark, far = np.full((HEIGHT, WIDTH), 0.01, np.float32), np.full((HEIGHT, WIDTH), 0.02, np.float32)
    cover = (np.arange(HEIGHT)[:, None] < 12) * np.ones(WIDTH, np.float32)
    far[:12] = np.linspace(0.1, 0.02, 12)[:, None]
    scene = band_scene(dark * cover, 2000.0, coverage=cover, behind=(Layer(far[..., None], 2400.0, None),))
    counts = []
    for down in (-8.0, 8.0):
        moves = {0: LayerMotion((Speed(0.0, "px/s"), Speed(down / TIME_S, "px/s")))}
        planned = plan_moving(replace(shot_of(WAYS["front"]), scene=scene, motion=Motion(layers=moves), tolerance=0.1))
        counts.append(planned.optics.motion.count)
    assert counts[0] > 1.2 * counts[1]  # it shows the bright half, or hides what is dark
