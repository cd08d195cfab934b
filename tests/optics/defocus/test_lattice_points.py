"""Lattice points: each coordinate is even, and periodic integrands are integrated with the error that theory gives."""

import math
from functools import cache

import numpy as np
import pytest
from scipy.stats import qmc

from simulator.optics.defocus.aperture_samples import disk_of_square
from simulator.optics.defocus.edge_laws import LITS
from simulator.optics.defocus.joint_errors import moving_points_error, sampled_detail
from simulator.optics.defocus.lattice_points import MULTIPLIERS, lattice_points
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.optics.defocus.sobol_points import sobol_points


def figure_p2(points: np.ndarray) -> float:
    """P_2, the largest error of a periodic integrand whose Fourier coefficients fall as 1 / h^2 in each dimension.

    Sum over the dual lattice, by Bernoulli's polynomial B_2 (Sloan and Joe, Lattice Methods, 1994, 4.2).
    """
    bernoulli = points**2 - points + 1.0 / 6.0
    return float(np.prod(1.0 + 2.0 * np.pi**2 * bernoulli, axis=1).mean() - 1.0)


@pytest.mark.parametrize("count", MULTIPLIERS)
def test_each_coordinate_takes_each_place_once(count):
    places = lattice_points(count, 6) * count - 0.5
    for coordinate in places.T:
        np.testing.assert_allclose(np.sort(coordinate), np.arange(count), atol=1e-6)


@pytest.mark.parametrize("count", [count for count in MULTIPLIERS if count >= 256])
def test_products_are_integrated_better_than_by_random_points(count):
    """In three dimensions, beside the root mean square of 20 draws."""
    points = lattice_points(count, 3) - 0.5 / count
    rng = np.random.default_rng(count)
    by_chance = [figure_p2((rng.random((count, 3)) - rng.random(3)) % 1.0) for _ in range(20)]
    assert 0.0 < figure_p2(points) < 0.25 * float(np.sqrt(np.mean(np.square(by_chance))))


@pytest.mark.parametrize("count", [256, 1024, 2048])
def test_a_pattern_over_aperture_and_time_is_twice_as_exact_as_by_sobol_points(count):
    """Root mean square over waves of few cycles in three dimensions."""
    waves = np.stack(np.meshgrid(*[np.arange(-4, 5)] * 3), axis=-1).reshape(-1, 3)
    waves = waves[np.any(waves != 0, axis=1)]

    def error(points: np.ndarray) -> float:
        means = np.abs(np.exp(2j * np.pi * points[:, :3] @ waves.T).mean(axis=0))
        return float(np.sqrt(np.mean(means**2 / np.prod(np.maximum(np.abs(waves), 1), axis=1) ** 2)))

    assert error(lattice_points(count, 3)) < 0.5 * error(sobol_points(count))


PLACES, SIDE, BORDER = 60, 90, 50  # photosites that are looked at, and of the scene
SPOTS = (  # radii of a nearer layer and of one behind it, 0: of a picture; way of the nearer one [photosites]
    ((-5.0, 6.0), (5.0, -19.0)),
    ((-5.0, 6.0), (19.0, 6.245)),
    ((-5.0, 0.0), (30.0, -8.0)),
)


def means_of(points: np.ndarray) -> np.ndarray:
    """Light of PLACES behind moving disks, (spots, places), of squares of 5 px with light up to 1. points: (n, 3) float64."""
    first, second, share = points.T
    y, x = disk_of_square(first, second)
    rng = np.random.default_rng(7)
    near, cover, far = (np.kron(one, np.ones((5, 5))).ravel() for one in rng.random((3, (SIDE + 2 * BORDER) // 5, 38)))
    cover = np.round(cover)

    def read(plane: np.ndarray, across: np.ndarray, down: np.ndarray) -> np.ndarray:
        column, row = np.floor(across).astype(int), np.floor(down).astype(int)
        right, corner = across - column, 190 * row + column
        above, below = (plane[at] + right * (plane[at + 1] - plane[at]) for at in (corner, corner + 190))
        return above + (down - row) * (below - above)

    middles = rng.integers(BORDER, BORDER + SIDE, (2, PLACES, 1))
    found = []
    for (front, behind), (right, down) in SPOTS:
        hiding = cover if behind else np.ones_like(cover)
        own = middles[0] + front * x - share * right, middles[1] + front * y - share * down
        hides = read(hiding, *own)
        seen = hides * read(near, *own) + (1.0 - hides) * read(far, middles[0] + behind * x, middles[1] + behind * y)
        found.append(seen.mean(axis=1))
    return np.array(found)


@cache
def dense_means() -> np.ndarray:
    """The same of many random Sobol' points."""
    return means_of(qmc.Sobol(3, seed=5).random(16384))


@pytest.mark.parametrize("count", [256, 512, 1024, 1536, 2048, 4096])
def test_layers_out_of_focus_that_move_are_more_exact_than_by_sobol_points(count):
    """Of 1536 points beside those of 1024, whose error falls as N^-0.8."""
    power = 2 ** int(math.log2(count))
    ours, theirs = (means_of(one[:, :3]) - dense_means() for one in (lattice_points(count, 3), sobol_points(power)))
    assert np.sqrt(np.mean(ours**2)) < 0.9 * np.sqrt(np.mean(theirs**2)) * (power / count) ** 0.8


@pytest.mark.parametrize("count", [32, 64, 256, 512, 1024, 1536, 2048, 4096])
def test_the_law_of_points_of_aperture_and_time_bounds_layers_that_move(count):
    """As a share of the brightest light: 0.0044 of 1024 points of another lattice were found where 0.0027 were told."""
    left = np.abs(means_of(lattice_points(count, 3)) - dense_means())
    for own, (radii_px, path_px) in zip(left, SPOTS, strict=True):
        law = moving_points_error(count, max(np.abs(radii_px)), math.hypot(*path_px))
        assert 0.15 * law < np.quantile(own, 0.995) < law


def test_edges_in_the_dark_count_in_the_noise_of_what_a_photosite_gets_of_them():
    """An edge of the brightest light before black, read noise of 2 e-: most where an eighth of it is seen."""
    edges = [math.sqrt(1004.0 / (1000.0 * lit + 4.0)) for lit in LITS]
    seen = [edge * 2.0 * math.sqrt(lit * (1.0 - lit)) for edge, lit in zip(edges, LITS, strict=True)]
    contrast = SceneContrast(texture=0.3, edges=tuple(edges))
    assert sampled_detail(contrast, has_edges=True) == pytest.approx(max(seen)) and 1.7 < max(seen) < 2.0
    assert sampled_detail(contrast, has_edges=False) == pytest.approx(1.3 * math.sqrt(0.3))
