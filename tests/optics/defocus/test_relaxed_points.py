"""Relaxed points lie more evenly in the aperture than Sobol' points, however many of the first of them are taken."""

import numpy as np
import pytest

from simulator.optics.defocus.aperture_samples import MOST_OF_ALL, aperture_samples, disk_of_square
from simulator.optics.defocus.relaxed_points import FIRST, MOST, relax, relaxed_points
from simulator.optics.defocus.sobol_points import sobol_points
from simulator.optics.pupil.pupil import Pupil


def points_of_sobol(count: int) -> np.ndarray:
    y, x = disk_of_square(*sobol_points(count)[:, :2].T)
    return np.stack([x, y], axis=-1)


def in_half_planes(points: np.ndarray, edges: int, seed: int) -> np.ndarray:
    """Which points lie beyond edges of random angle and offset: (points, edges)."""
    rng = np.random.default_rng(seed)
    angle, offset = 2.0 * np.pi * rng.random(edges), rng.uniform(-1.0, 1.0, edges)
    return points @ np.stack([np.cos(angle), np.sin(angle)]) > offset


def covariances(points: np.ndarray, edges: int = 500) -> np.ndarray:
    one, other = (in_half_planes(points, edges, seed) for seed in (1, 2))
    return (one & other).mean(axis=0) - one.mean(axis=0) * other.mean(axis=0)


@pytest.fixture(scope="module")
def exact():
    """By a spiral of equal areas."""
    number = np.arange(40000) + 0.5
    radius, angle = np.sqrt(number / 40000), np.pi * (3.0 - 5.0**0.5) * number
    return covariances(np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1))


@pytest.mark.parametrize("count", [32, 64, 128, 256, 512, 1024])
def test_they_miss_less_of_edges_within_edges(count, exact):
    ours, theirs = (covariances(points) - exact for points in (relaxed_points(count), points_of_sobol(count)))
    assert np.sqrt(np.mean(ours**2)) < 0.95 * np.sqrt(np.mean(theirs**2))
    assert np.quantile(np.abs(ours), 0.999) < 0.75 * count**-0.75


def test_they_lie_evenly_in_the_aperture():
    points = relaxed_points(MOST)
    assert MOST == MOST_OF_ALL and np.hypot(*points.T).max() < 1.0
    for count in (32, 128, 512, 2048, 8192):
        assert np.abs(points[:count].mean(axis=0)).max() < 0.3 * count**-0.75
        assert np.mean(points[:count] ** 2) == pytest.approx(0.25, abs=0.3 * count**-0.75)


def test_they_are_sobol_points_that_moved():
    assert np.abs(relax(points_of_sobol(2 * FIRST)) - relaxed_points(2 * FIRST)).max() < 1e-3


def test_only_the_place_in_the_aperture_moves():
    usual, relaxed = (aperture_samples(Pupil(), 64, 2, relaxed=moved) for moved in (False, True))
    assert np.array_equal(usual[:, 2:], relaxed[:, 2:]) and (usual[:, :2] != relaxed[:, :2]).all()


def test_there_are_no_more():
    with pytest.raises(ValueError, match="8193 points; there are 8192"):
        relaxed_points(MOST + 1)
