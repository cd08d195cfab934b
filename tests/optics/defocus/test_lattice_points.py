"""Lattice points: each coordinate is even, and periodic integrands are integrated with the error that theory gives."""

import numpy as np
import pytest

from simulator.optics.defocus.lattice_points import MULTIPLIERS, lattice_points
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
