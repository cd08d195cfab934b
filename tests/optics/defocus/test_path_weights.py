"""Small circles of a picture of one pixel per photosite that moves, against light between pixels in float64."""

import numpy as np
import pytest
from audit.shot_truth import run, z_scores
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene
from scipy.ndimage import correlate

from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import disk_weights, photosite_weights
from simulator.optics.defocus.path_weights import path_weights, pixel_weights
from simulator.optics.defocus.photosite_area import PhotositeArea, ReadPath
from simulator.optics.pupil.pupil import Pupil
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot

SIDE, TIME_S, REACH = 40, 0.001, 6


def exact_weights(radius_px, way_px, points=200, instants=40):
    """Weights of pixels between which light is linear, by points of a disk and instants: (2 REACH + 1, ...)."""
    line = (np.arange(points) + 0.5) / points * 2.0 - 1.0
    inside = np.hypot(line[:, None], line) <= 1.0
    pixels, found = np.arange(-REACH, REACH + 1), np.zeros((2 * REACH + 1, 2 * REACH + 1))
    for share in (np.arange(instants) + 0.5) / instants:
        down, right = (np.maximum(1.0 - np.abs(radius_px * line[:, None] + share * way - pixels), 0.0) for way in way_px[::-1])
        found += down.T @ inside @ right
    return found / found.sum()


def straight(way_px, reach, **settings):
    shares = (np.arange(32) + 0.5) / 32
    return ReadPath(tuple((float(share * way_px[0]), float(share * way_px[1]), 1 / 32) for share in shares), reach, **settings)


def moving_shot(light, radius_px, way_px, **settings):
    speed = Speed(way_px[0] / TIME_S, "px/s"), Speed(way_px[1] / TIME_S, "px/s")
    scene = band_scene(light, float(depth_of(radius_px)), **settings)
    camera = small_camera(SIDE, SIDE)
    return Shot(scene, LENS, Exposure(TIME_S), camera, motion=Motion(layers={0: LayerMotion(speed)}), tolerance=0.1)


@pytest.mark.parametrize("way_px", [(0.3, 0.2), (1.0, 0.0), (-0.6, 0.4), (2.7, 1.1)])
@pytest.mark.parametrize("radius_px", [0.45, 1.0, 1.5, 2.4])
def test_weights_of_a_path_are_nearer_to_the_truth_than_even_squares(radius_px, way_px):
    path = straight(way_px, 3)
    found, exact = pixel_weights(disk_weights, radius_px, path)
    weights = path_weights(disk_weights, radius_px, path)
    assert weights.sum() == pytest.approx(1.0) and exact.sum() == pytest.approx(1.0)
    left, squares = np.linalg.norm(found - exact), np.zeros_like(exact)
    read = pixel_weights(disk_weights, 1e-3, ReadPath(path.places, 1))[1]  # light of the path alone
    middle, disk = len(read) // 2, disk_weights(radius_px)
    for (down, right), weight in np.ndenumerate(disk):
        moved = np.roll(read, (down - len(disk) // 2, right - len(disk) // 2), (0, 1))
        wide = len(exact) // 2 - middle
        squares += weight * (np.pad(moved, wide) if wide >= 0 else moved[-wide:wide, -wide:wide])
    assert left < 0.5 * np.linalg.norm(squares - exact) and left < 0.017


def test_beside_lamps_no_weight_is_negative():
    for way_px in ((0.6, 0.4), (2.7, 1.1)):
        weights = [path_weights(disk_weights, 1.0, straight(way_px, 3, is_positive=sign)) for sign in (False, True)]
        assert weights[0].min() < 0.0 <= weights[1].min()
        assert weights[1].sum() == pytest.approx(1.0)


def test_samples_behind_other_circles_stay_even_squares():
    area = PhotositeArea(path=straight((1.0, 0.3), 3))
    for radius_px, over in ((0.0, 1), (2.6, 1), (1.0, 2)):
        assert np.array_equal(photosite_weights(Pupil(), radius_px, over, area), photosite_weights(Pupil(), radius_px, over))
    assert not np.array_equal(photosite_weights(Pupil(), 1.0, 1, area), photosite_weights(Pupil(), 1.0, 1))


@pytest.mark.parametrize(
    ("radius_px", "way_px", "most_told"),
    [(0.45, (0.3, 0.2), 0.1), (1.0, (1.0, 0.0), 0.1), (1.0, (2.7, 1.1), 2.0)],
)
def test_random_pixels_that_move_keep_what_is_told(radius_px, way_px, most_told, device):
    """Even squares left 20, 7.7 and 5.7 sigma, where 84, 4.9 and 4.8 were told."""
    light = np.random.default_rng(7).random((SIDE, SIDE))
    shot = moving_shot(light, radius_px, way_px)
    planned = measure(plan(shot), device)
    found, inside = run(planned, shot, device), (slice(8, -8), slice(8, -8))
    true = correlate(light, exact_weights(radius_px, (-way_px[0], -way_px[1])), mode="nearest")
    true *= found[inside].sum() / true[inside].sum()
    z = np.quantile(np.abs(z_scores(found, true, planned))[inside], 0.999)
    told = planned.error_budget.predicted_sigma
    assert z <= told <= most_told


def test_what_is_at_rest_finer_or_of_many_radii_keeps_its_weights():
    light = np.random.default_rng(7).random((SIDE, SIDE))
    tilted = depth_of(np.linspace(0.9, 1.1, SIDE * SIDE).reshape(SIDE, SIDE))
    at_rest = Shot(band_scene(light, float(depth_of(1.0))), LENS, Exposure(TIME_S), small_camera(SIDE, SIDE))
    finer = moving_shot(np.kron(light, np.ones((2, 2))), 1.0, (1.0, 0.3))
    sloped = Shot(band_scene(light, tilted), LENS, Exposure(TIME_S), small_camera(SIDE, SIDE), motion=finer.motion)
    for shot in (at_rest, finer, sloped):
        defocus = plan(shot).optics.defocus
        assert defocus is not None and defocus.area.path is None
