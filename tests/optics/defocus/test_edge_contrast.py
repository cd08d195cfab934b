"""What a lens sees behind depth edges: closed laws against points of the aperture in float64."""

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from audit.shot_truth import run, z_scores
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene
from scipy.ndimage import distance_transform_edt

from simulator import load_shot
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.edge_contrast import BESIDE, hidden_share, share_past_small
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer

GRID = (np.arange(800) + 0.5) / 400 - 1.0
ACROSS = np.broadcast_to(GRID, (800, 800))[GRID**2 + GRID[:, None] ** 2 < 1.0]  # u of points of the aperture


@pytest.mark.parametrize(("near_px", "far_px"), [(-5.0, 3.0), (-4.0, 0.0), (1.0, 6.0), (3.0, 6.0), (-6.0, -5.0)])
def test_a_straight_edge_hides_from_as_much_of_the_aperture_as_rays_find(near_px, far_px):
    places = np.linspace(-8.0, 8.0, 401)
    found = np.array([np.mean((x + near_px * ACROSS > 0.0) & (x + far_px * ACROSS < 0.0)) for x in places])
    assert found.max() == pytest.approx(float(hidden_share(np.array(near_px), np.array(far_px))), abs=0.02)
    assert found.sum() * (places[1] - places[0]) == pytest.approx(BESIDE * (far_px - near_px), rel=0.02)


def test_past_things_smaller_than_their_circles_more_than_half_is_seen():
    rows, columns = np.mgrid[-30:31, -30:31]
    disk, ends = rows**2 + columns**2 < 4.0**2, (np.full(61 * 61, -10.0), np.full(61 * 61, 1.0))
    everywhere = np.ones((61, 61), bool)
    found = share_past_small(np.where(disk, -10.0, 1.0), everywhere, *ends, 1.0).reshape(61, 61)
    assert found[30, 30] == pytest.approx(1.0 - 0.4**2, abs=0.04)  # rays pass the disk, and meet the wall behind it
    half_plane = share_past_small(np.where(columns < 0, -10.0, 1.0), everywhere, *ends, 1.0).reshape(61, 61)
    assert half_plane[20:41, 20:41].max() < 0.56


def random_picture(rng, side):
    """Disks before a wall of noise, stripes or a slope: light of both (side, side), and where disks are."""
    rows, columns = np.mgrid[:side, :side]
    is_near = np.zeros((side, side), bool)
    for y, x, size in zip(*rng.uniform(0, side, (2, 7)), rng.uniform(1.0, 7.0, 7), strict=True):
        is_near |= (rows - y) ** 2 + (columns - x) ** 2 < size**2
    walls = rng.uniform(0.05, 1.0, (side, side)), 0.05 + 0.95 * (columns // rng.integers(3, 9) % 2), 0.05 + columns / side
    far = walls[rng.integers(3)]
    return np.where(rng.integers(2), rng.uniform(0.05, 1.0), rng.uniform(0.05, 1.0, (side, side))), far, is_near


def waves_behind(rng, side, length_px):
    """`random_picture` before waves of this length in any direction."""
    near, _, is_near = random_picture(rng, side)
    rows, columns = np.mgrid[:side, :side]
    angle = rng.uniform(0.0, np.pi)
    waves = np.sin(2.0 * np.pi * (np.cos(angle) * columns + np.sin(angle) * rows) / length_px)
    return near, 0.55 + 0.45 * waves, is_near


def seen_past(near, far, is_near, near_px, far_px, points=600, leaves_out=False):
    """Light through points of the aperture past the nearer light, in float64: (side, side).

    leaves_out: whether what is hidden behind the nearer light is left out, so that the mean is that of the rest.
    """
    number, places, light, met = np.arange(points), np.indices(far.shape), np.zeros(far.shape), np.zeros(far.shape)
    turns = number * np.pi * (3.0 - np.sqrt(5.0))
    for way in (np.sqrt((number + 0.5) / points) * np.stack([np.sin(turns), np.cos(turns)])).T:
        there = [np.rint(places + radius_px * way[:, None, None]).astype(int) for radius_px in (near_px, far_px)]
        (nearer, farther) = (tuple(np.clip(one, 0, len(far) - 1)) for one in there)
        is_seen = is_near[nearer] | ~(leaves_out & is_near[farther])
        light += is_seen * np.where(is_near[nearer], near[nearer], far[farther])
        met += is_seen
    return light / np.maximum(met, 1.0)


def error_over_stated(scene, brightest, found, true):
    """Quantile 0.999 of the error in the noise of the light, over what the plan states of what is hidden."""
    optics = plan(Shot(scene, LENS, Exposure(1e-3), small_camera(64, 64))).optics
    accuracy = optics.accuracy
    noise_e = np.sqrt(np.maximum(true / brightest * accuracy.electrons + accuracy.read_noise_e**2, 1.0))
    error = np.quantile(np.abs(found - true) / brightest * accuracy.electrons / noise_e, 0.999)
    return error / accuracy.in_sigma(optics.contrast.hidden)


@pytest.mark.parametrize(
    ("near_px", "far_px"),
    [(-4.0, 2.0), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in ((-5.0, -1.0), (-2.0, 4.0), (1.0, 6.0)))],
)
def test_what_is_hidden_behind_random_disks_is_bounded(near_px, far_px):
    """Behind disks lies what is there, or the light of the wall's nearest place that is seen."""
    ratios = []
    for seed in range(10):
        near, far, is_near = random_picture(np.random.default_rng(seed), 64)
        assumed = far[tuple(distance_transform_edt(is_near, return_distances=False, return_indices=True))]
        true, found = (seen_past(near, wall, is_near, near_px, far_px) for wall in (far, assumed))
        picture = np.where(is_near, near, far)
        scene = band_scene(picture, depth_of(np.where(is_near, near_px, far_px)))
        ratios.append(error_over_stated(scene, np.quantile(picture, 0.999), found, true))
    assert 0.3 < max(ratios) <= 1.02  # edges along stripes reach it; points are off by a hundredth


@pytest.mark.parametrize(
    ("near_px", "far_px"), [(0.0, 11.0), *(pytest.param(*pair, marks=pytest.mark.slow) for pair in ((1.0, 6.0), (-5.0, -1.0)))]
)
def test_waves_as_long_as_the_circle_behind_disks_are_bounded_whatever_is_assumed(near_px, far_px):
    """What is there, the light of the nearest place that is seen, or none: no two differ by more than is stated."""
    ratios = []
    for seed in range(6):
        near, far, is_near = waves_behind(np.random.default_rng(seed), 64, 1.2 * max(abs(near_px), abs(far_px)))
        ends, picture = (near_px, far_px), np.where(is_near, near, far)
        assumed = far[tuple(distance_transform_edt(is_near, return_distances=False, return_indices=True))]
        true, continued = (seen_past(near, wall, is_near, *ends) for wall in (far, assumed))
        rest = seen_past(near, far, is_near, *ends, leaves_out=True)
        scene = band_scene(picture, depth_of(np.where(is_near, *ends)))
        brightest = np.quantile(picture, 0.999)
        ratios += [error_over_stated(scene, brightest, *pair) for pair in ((continued, true), (rest, true), (rest, continued))]
    assert 0.3 < max(ratios) <= 1.02


def test_dark_parts_of_a_layer_count_in_the_noise_of_what_is_behind():
    """A dark veil with holes before a bright wall: its edges lie in the wall's noise, not in that of its own light."""
    cover = (np.indices((48, 64)).sum(axis=0) % 12 < 6).astype(np.float32)
    wall = Layer(np.ones((48, 64, 1), np.float32), float(depth_of(3.0)), None)
    scene = band_scene(0.4 * cover, float(depth_of(-3.0)), coverage=cover, behind=(wall,))
    contrast = plan(Shot(scene, LENS, Exposure(1e-3), small_camera(64, 48))).optics.contrast
    assert 0.3 < contrast.curvature < 1.0


def test_light_beside_a_step_in_the_same_block_states_what_points_leave(tmp_path, device):
    """Seed 7701, shot 32: an edge of light that means have exactly where no block samples the aperture."""
    path = draw_shot(7701, 32).write(tmp_path)
    shot = load_shot(path)
    planned = measure(plan(shot), device)
    depth = np.load(tmp_path / "depth_0.npy")
    np.save(tmp_path / "depth_0.npy", np.full_like(depth, depth[0, -1]))
    found, means = (run(one, shot, device) for one in (planned, measure(plan(load_shot(path)), device)))
    left = float(np.abs(z_scores(found, means, planned))[:35].max())  # above the step
    points = [term.sigma for term in planned.error_budget.terms if "points of the aperture" in term.cause]
    assert 0.3 < left < sum(points) < 1.0
