"""Circles of a picture of one pixel per photosite that moves, or lies aside, against light between pixels in float64."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from audit.shot_truth import run, z_scores
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import FixedScene, band_scene
from scipy.ndimage import correlate

from simulator.device import open_device
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.defocus.aperture_kernel import disk_weights, photosite_weights
from simulator.optics.defocus.path_weights import fit_weights, lattices, path_weights, pixels_of, skewed_pixels
from simulator.optics.defocus.photosite_area import PhotositeArea, ReadPath
from simulator.optics.defocus.scene_contrast import steep_radii
from simulator.optics.path_planning import EVERY
from simulator.optics.pupil.pupil import Pupil
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer

SIDE, TIME_S, REACH = 40, 0.001, 6


def exact_weights(radius_px, way_px, points=200, instants=40, reach=REACH):
    """Weights of pixels between which light is linear, by points of a disk and instants: (2 reach + 1, ...)."""
    line = (np.arange(points) + 0.5) / points * 2.0 - 1.0
    inside = np.hypot(line[:, None], line) <= 1.0
    pixels, found = np.arange(-reach, reach + 1), np.zeros((2 * reach + 1, 2 * reach + 1))
    for share in (np.arange(instants) + 0.5) / instants:
        down, right = (np.maximum(1.0 - np.abs(radius_px * line[:, None] + share * way - pixels), 0.0) for way in way_px[::-1])
        found += down.T @ inside @ right
    return found / found.sum()


def straight(way_px, beside=1, inside=EVERY, **settings):
    shares = (np.arange(32) + 0.5) / 32
    way = tuple((float(share * way_px[0]), float(share * way_px[1]), 1 / 32) for share in shares)
    return ReadPath((way,), beside, inside, **settings)


def moving_shot(light, radius_px, way_px, **settings):
    speed = Speed(way_px[0] / TIME_S, "px/s"), Speed(way_px[1] / TIME_S, "px/s")
    scene = band_scene(light, float(depth_of(radius_px)), **settings)
    camera = small_camera(SIDE, SIDE)
    return Shot(scene, LENS, Exposure(TIME_S), camera, motion=Motion(layers={0: LayerMotion(speed)}), tolerance=0.1)


def left_by(weights, pair):
    return np.linalg.norm(pixels_of(weights, pair[0]) - pair[1])


@pytest.mark.parametrize("way_px", [(0.3, 0.2), (1.0, 0.0), (-0.6, 0.4), (2.7, 1.1)])
@pytest.mark.parametrize(("radius_px", "beside"), [(0.45, 3), (1.0, 2), (1.5, 2), (2.4, 1), (5.0, 2)])
def test_weights_of_a_path_are_nearer_to_the_truth_than_even_squares(radius_px, beside, way_px):
    path = straight(way_px, beside)
    (pair,) = lattices(disk_weights, radius_px, path.ways)
    weights = path_weights(disk_weights, radius_px, path)
    assert weights.sum() == pytest.approx(1.0) and pair[1].sum() == pytest.approx(1.0)
    left = left_by(weights, pair)
    assert left < 0.5 * left_by(disk_weights(radius_px), pair) and left < 0.017


@pytest.mark.parametrize("way_px", [(0.5, 0.0), (1.3, 0.4), (-0.6, 3.0)])
@pytest.mark.parametrize("radius_px", [0.45, 1.0, 2.4, 5.0])
def test_exact_weights_are_those_of_points_of_the_disk_and_of_time(radius_px, way_px):
    path = straight((-way_px[0], -way_px[1]))
    (_, exact) = lattices(disk_weights, radius_px, path.ways)[0]
    reach = len(exact) // 2
    moved = tuple(int(-round(np.mean([place[axis] for place in path.ways[0]]))) for axis in (1, 0))
    points = exact_weights(radius_px, (-way_px[0], -way_px[1]), points=240, instants=32, reach=reach + 3)
    inside = np.roll(points, moved, (0, 1))[3:-3, 3:-3]
    assert np.abs(inside - exact).sum() < 1e-3


@pytest.mark.parametrize("radius_px", [1e-4, 0.003, 0.02, 0.03])
def test_exact_weights_of_tiny_circles_take_little_memory(radius_px):
    """Light bends at the pixels alone: 4 r / (3 pi) of the second difference along each axis is what a circle shows there."""
    tracemalloc.start()
    (_, exact), (read, aside) = lattices(disk_weights, radius_px, (((0.0, 0.0, 1.0),), ((0.5, 0.0, 1.0),)))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert most < 1e8
    reach = len(exact) // 2
    true = exact_weights(radius_px, (0.0, 0.0), points=400, instants=1, reach=reach)
    assert exact == pytest.approx(true, abs=0.02 * radius_px)
    bends = 4.0 * radius_px / (3.0 * np.pi)
    assert exact[reach, reach - 1] == pytest.approx(0.5 * bends, rel=0.03)
    across = 0.5 * np.abs(aside - read).sum()  # between two pixels light bends across the other axis
    assert across == pytest.approx(bends, rel=0.1)


def test_rings_of_their_own_leave_the_others_alike():
    """Running sums then read a large circle as quickly as one of even squares; more rings come nearer to the truth."""
    path = straight((7.0, 2.3))
    (pair,) = lattices(disk_weights, 8.0, path.ways)
    squares, before = disk_weights(8.0), np.inf
    for beside, inside in ((0, 0), (0, 1), (1, 1), (1, 2)):
        weights = path_weights(disk_weights, 8.0, replace(path, beside=beside, inside=inside))
        assert len(weights) == len(squares) + 2 * beside
        values, counts = np.unique(weights, return_counts=True)
        assert counts.max() > 0.5 * (squares == squares.max()).sum()
        assert values[counts.argmax()] == pytest.approx(squares.max(), 0.01)
        left = left_by(weights, pair)
        assert left < 0.999 * before
        before = left
    assert before < 0.35 * left_by(squares, pair)


def test_one_kernel_is_nearest_to_all_paths_of_a_sensor():
    """Lines that open one after the other read at other parts of a pixel."""
    ways = [straight((0.6, 0.3)).ways[0], tuple((x + 0.5, y + 0.2, share) for x, y, share in straight((0.6, 0.3)).ways[0])]
    pairs = lattices(disk_weights, 3.0, ways)
    image, path = disk_weights(3.0), ReadPath(tuple(ways), 1, EVERY)
    both = [left_by(fit_weights(image, pairs, path), pair) for pair in pairs]
    first = [left_by(fit_weights(image, pairs[:1], path), pair) for pair in pairs]
    squares = [left_by(image, pair) for pair in pairs]
    assert first[0] < both[0] and np.linalg.norm(both) < min(np.linalg.norm(first), 0.7 * np.linalg.norm(squares))


def test_beside_lamps_no_weight_is_negative():
    for way_px in ((0.6, 0.4), (2.7, 1.1)):
        weights = [path_weights(disk_weights, 1.0, straight(way_px, 2, is_positive=sign)) for sign in (False, True)]
        assert weights[0].min() < 0.0 <= weights[1].min()
        assert weights[1].sum() == pytest.approx(1.0)


def test_samples_behind_other_circles_stay_even_squares():
    area = PhotositeArea(path=straight((1.0, 0.3)))
    for radius_px, over in ((0.0, 1), (24.1, 1), (1.0, 2)):
        assert np.array_equal(photosite_weights(Pupil(), radius_px, over, area), photosite_weights(Pupil(), radius_px, over))
    assert not np.array_equal(photosite_weights(Pupil(), 1.0, 1, area), photosite_weights(Pupil(), 1.0, 1))


@pytest.mark.parametrize(
    ("radius_px", "way_px", "most_told"),
    [(0.45, (0.3, 0.2), 0.1), (1.0, (1.0, 0.0), 0.1), (1.0, (2.7, 1.1), 2.0), (4.0, (0.6, 0.2), 0.1)],
)
def test_random_pixels_that_move_keep_what_is_told(radius_px, way_px, most_told, device):
    """Even squares left 20, 7.7, 5.7 and 0.8 sigma, where 84, 4.9, 4.8 and 1.4 were told."""
    light = np.random.default_rng(7).random((SIDE, SIDE))
    shot = moving_shot(light, radius_px, way_px)
    planned = measure(plan(shot), device)
    found, inside = run(planned, shot, device), (slice(10, -10), slice(10, -10))
    true = correlate(light, exact_weights(radius_px, (-way_px[0], -way_px[1]), points=600), mode="nearest")
    true *= found[inside].sum() / true[inside].sum()
    z = np.quantile(np.abs(z_scores(found, true, planned))[inside], 0.999)
    told = planned.error_budget.predicted_sigma
    assert z <= told + 0.01 and told <= most_told  # points of the disk leave 0.006 of the truth


def test_a_slope_that_moves_near_the_focus_states_its_largest_circles(device):
    """Circles of 0.05 to 0.4 photosites, of which even squares leave more the larger they are: 13 sigma, 3.7 told."""
    light, way_px = np.random.default_rng(7).random((SIDE, SIDE)), (0.3, 0.2)
    radii_px = np.linspace(0.05, 0.4, SIDE)
    still = moving_shot(light, 1.0, way_px)
    shot = replace(still, scene=band_scene(light, depth_of(radii_px[None].repeat(SIDE, 0))))
    planned = measure(plan(shot), device)
    found, inside = run(planned, shot, device), (slice(3, -3), slice(3, -3))
    weights = [exact_weights(radius_px, (-way_px[0], -way_px[1]), points=400, reach=2) for radius_px in radii_px]
    true = np.stack([correlate(light, own, mode="nearest")[:, column] for column, own in enumerate(weights)], axis=1)
    true *= found[inside].sum() / true[inside].sum()
    left = np.quantile(np.abs(z_scores(found, true, planned))[inside], 0.999)
    told = max(term.sigma for term in planned.error_budget.terms if term.cause.startswith("means"))
    assert 0.2 * told < left <= told, (left, told)


def shot_between_pixels(light, radius_px):
    """Of a row more than the sensor has: each photosite lies in the middle between two of its pixels."""
    assert light.shape == (SIDE + 1, SIDE)
    scene = band_scene(light, float(depth_of(radius_px)))
    return Shot(scene, LENS, Exposure(TIME_S), small_camera(SIDE, SIDE), tolerance=0.1)


def left_between_pixels(shot, light, radius_px):
    """p99.9 of abs(z), and what is told."""
    device, planned = open_device(), plan(shot)
    found, inside = run(measure(planned, device), shot, device), (slice(10, -10), slice(10, -10))
    exact = exact_weights(radius_px, (0.0, 1.0), points=600, instants=1)
    true = correlate(light, exact, mode="nearest")[:SIDE]
    true *= found[inside].sum() / true[inside].sum()
    return np.quantile(np.abs(z_scores(found, true, planned))[inside], 0.999), planned.error_budget.predicted_sigma


@pytest.mark.parametrize("radius_px", [0.27, 1.0, 3.0])
def test_random_pixels_between_photosites_keep_what_is_told(radius_px):
    """Even squares left 16, 8.1 and 1.5 sigma, where 31, 4.8 and 0.8 were told."""
    light = np.random.default_rng(7).random((SIDE + 1, SIDE))
    left, told = left_between_pixels(shot_between_pixels(light, radius_px), light, radius_px)
    assert left <= told + 0.01 and told <= 0.1


@pytest.mark.parametrize("radius_px", [0.27, pytest.param(1.0, marks=pytest.mark.slow)])
def test_rays_see_light_between_pixels_as_weights_do(radius_px, device):
    """At rest and in motion, in dim light: circles inside a photosite did not blur for rays, which left 4 sigma."""
    light, way_px = 0.02 * np.random.default_rng(7).random((SIDE + 1, SIDE)), (0.3, 0.2)
    left, told = left_between_pixels(replace(shot_between_pixels(light, radius_px), tolerance=0.0), light, radius_px)
    assert left < 0.1 and told < 0.1  # rays have a standard error of 0.015
    moving = moving_shot(light[:SIDE], radius_px, way_px)
    swept, rays = (run(measure(plan(one), device), one, device) for one in (moving, replace(moving, tolerance=0.0)))
    assert np.quantile(np.abs(z_scores(swept, rays, plan(moving)))[10:-10, 10:-10], 0.999) < 0.2


def test_surfaces_between_photosites_are_gathered_as_even_squares(device):
    """A wall that tilts through the focus, in dim light, and one before another: rays differed by 4 sigma."""
    light, camera = 0.02 * np.random.default_rng(7).random((SIDE + 1, SIDE)), small_camera(SIDE, SIDE)
    tilted = depth_of(np.linspace(0.2, 1.4, SIDE)[None, :].repeat(SIDE + 1, 0)).astype(np.float32)
    cover = np.indices(light.shape)[1] < SIDE // 2
    wall = Layer(light[::-1, :, None].astype(np.float32), float(depth_of(2.0)))
    layers = band_scene(light * cover, float(depth_of(0.6)), coverage=cover.astype(np.float32), behind=(wall,))
    for scene in (band_scene(light, tilted), layers):
        shot = Shot(scene, LENS, Exposure(TIME_S), camera, tolerance=0.1)
        fast, rays = (run(measure(plan(one), device), one, device) for one in (shot, replace(shot, tolerance=0.0)))
        left = np.quantile(np.abs(z_scores(fast, rays, plan(shot)))[10:-10, 10:-10], 0.999)
        assert left < plan(shot).error_budget.predicted_sigma + 0.1 < 1.0


def test_what_is_at_rest_finer_or_of_many_radii_keeps_its_weights():
    light = np.random.default_rng(7).random((SIDE, SIDE))
    tilted = depth_of(np.linspace(0.9, 1.1, SIDE * SIDE).reshape(SIDE, SIDE))
    at_rest = Shot(band_scene(light, float(depth_of(1.0))), LENS, Exposure(TIME_S), small_camera(SIDE, SIDE))
    finer = moving_shot(np.kron(light, np.ones((2, 2))), 1.0, (1.0, 0.3))
    sloped = Shot(band_scene(light, tilted), LENS, Exposure(TIME_S), small_camera(SIDE, SIDE), motion=finer.motion)
    for shot in (at_rest, finer, sloped):
        defocus = plan(shot).optics.defocus
        assert defocus is not None and defocus.area.path is None


def test_rows_at_times_of_their_own_are_weighed_as_they_are_read():
    """Samples of a rolling shutter, each row swept by a way of its own, against sums over rows and columns of samples."""
    weights, (way,), skew_px, half = np.arange(1.0, 26.0).reshape(5, 5) / 325.0, straight((1.3, 0.4)).ways, (0.21, -0.15), 8
    pixels, true = np.arange(-half, half + 1), np.zeros((2 * half + 1, 2 * half + 1))
    x, y, shares = np.array(way).T
    x = x - round(x.mean())  # the middle of y rounds to 0
    for (row, column), weight in np.ndenumerate(weights):
        down, right = row - 2, column - 2
        tall = np.maximum(1.0 - np.abs(down * (1.0 + skew_px[1]) + y[:, None] - pixels), 0.0)
        wide = np.maximum(1.0 - np.abs(right + down * skew_px[0] + x[:, None] - pixels), 0.0)
        true += weight * (tall * shares[:, None]).T @ wide
    assert np.allclose(skewed_pixels(weights, way, skew_px, half), true, atol=1e-12)
    read = lattices(disk_weights, 1.0, (way,))[0][0]
    assert np.allclose(skewed_pixels(weights, way, (0.0, 0.0), len(read) // 2), pixels_of(weights, read), atol=1e-12)


def test_a_rolling_shutter_has_weights_of_its_paths():
    """Rows read at all parts of a pixel: one kernel comes nearest to all of them."""
    light = np.random.default_rng(7).random((SIDE, SIDE))
    shot = moving_shot(light, 1.0, (7.3, -3.2))
    rolling = replace(shot, exposure=replace(shot.exposure, shutter=RollingShutter(TIME_S)))
    optics = plan(rolling).optics
    assert optics.motion.blur.followed is not None and len(optics.defocus.area.path.ways) == 5
    left = rows_left(rolling, light, (7.3, -3.2))
    assert left <= plan(rolling).error_budget.predicted_sigma < 1.7


def rows_left(shot, light, way_px):
    """p99.9 of abs(z) of rows that open one after the other, each against the exact weights of its own path."""
    device, planned = open_device(), plan(shot)
    found = run(measure(planned, device), shot, device)
    begin, end = planned.optics.motion.path.of_lines(np.arange(SIDE)).straight_shift()
    true, pixels = np.zeros_like(found), np.arange(SIDE)
    for row in range(10, SIDE - 10):
        shares = (np.arange(80) + 0.5) / 80
        way = tuple((float(x), float(y), 1 / 80) for x, y in begin[row] + shares[:, None] * (end[row] - begin[row]))
        exact = lattices(disk_weights, 1.0, (way,))[0][1]
        moved, around = np.round(np.mean(way, axis=0)[:2]).astype(int), np.arange(len(exact)) - len(exact) // 2
        rows = np.clip(row + moved[1] + around, 0, SIDE - 1)
        columns = np.clip(pixels[:, None] + moved[0] + around, 0, SIDE - 1)
        true[row] = np.einsum("rxc,rc->x", light[rows][:, columns], exact)
    inside = slice(10, -10), slice(10, -10)
    true *= found[inside].sum() / true[inside].sum()
    return np.quantile(np.abs(z_scores(found, true, planned))[inside], 0.999)


def test_what_paths_leave_drives_no_plan_of_the_scene_out():
    """Each of six sets of rings is measured, of which a scene keeps eight results."""
    squares = np.kron(np.random.default_rng(4).random((SIDE // 5, SIDE // 5)), np.ones((5, 5)))
    moving = moving_shot(0.05 + 0.9 * squares, 5.0, (19.0, 6.245))
    scene = moving.scene.load()
    for array in scene.arrays():
        array.flags.writeable = False  # what could change is not kept
    moving = replace(moving, scene=FixedScene(scene))
    rest, rolling = (
        replace(moving, motion=None),
        replace(moving, exposure=replace(moving.exposure, shutter=RollingShutter(TIME_S))),
    )
    kept = plan(rest).optics.accuracy
    for shot in (moving, rolling):
        plan(shot)
    assert plan(rest).optics.accuracy is kept


@pytest.mark.parametrize("least_px", [0.2, 0.7, 1.54, 2.3])
@pytest.mark.parametrize("way", [((0.0, 0.0, 1.0),), tuple((0.1 * n, 0.1 * n, 1.0 / 11.0) for n in range(11))])
def test_radii_that_are_looked_at_find_what_squares_leave_at_all_larger_ones(least_px, way):
    """On random squares; what is left comes and goes with the radius, by a period of a pixel."""
    light = np.random.default_rng(1).integers(0, 2, (64, 64)).astype(float)

    def left(radius_px: float) -> float:
        ((read, exact),) = lattices(disk_weights, radius_px, [way])
        lacked = pixels_of(disk_weights(radius_px), read)
        size = max(len(lacked), len(exact))
        wide = [np.pad(one, (size - len(one)) // 2) for one in (lacked, exact)]
        return float(np.quantile(np.abs(correlate(light, wide[0] - wide[1], mode="wrap")), 0.999))

    every = [left(float(radius_px)) for radius_px in np.arange(least_px, 4.5, 0.05)]
    assert max(every) < 1.1 * max(left(radius_px) for radius_px in steep_radii(least_px, 4.5))
    assert steep_radii(least_px, least_px + 0.1) == [least_px, least_px + 0.1]
