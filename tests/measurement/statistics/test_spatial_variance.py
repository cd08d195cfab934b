"""Temporal noise of pairs and fixed pattern of stacks, against sensors made in float64 NumPy with known variances."""

import numpy as np
import pytest
from helpers.randomness import accept, mean_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.measurement.statistics.spatial_variance import spatial_variance, stack_of
from simulator.measurement.statistics.temporal_noise import mean_of_pair, pair_noise


def scatter_p(estimates, truth):
    """Two-sided t-test that independent estimates are unbiased."""
    return float(stats.ttest_1samp(estimates, truth).pvalue)


def test_temporal_variance_of_a_pair_by_hand():
    first, second = np.array([[3, 5], [7, 9]], np.uint16), np.array([[4, 4], [10, 8]], np.uint16)
    # differences -1, 1, -3, 1: mean square 3, mean -0.5
    assert pair_noise(first, second).variance_dn2 == 0.5 * (3 - 0.25)
    assert mean_of_pair(first, second) == 6.25


def test_fixed_pattern_and_a_change_of_light_leave_no_trace():
    random = np.random.default_rng(1)
    body = random.integers(0, 60000, (40, 50), dtype=np.uint16)
    brighter = pair_noise(body, body + np.uint16(300))
    assert brighter.variance_dn2 == 0.0 and brighter.row_variance_dn2 == 0.0


def test_row_and_pixel_noise_come_apart():
    random, p_values = np.random.default_rng(2), {}
    for row_sd, pixel_sd in ((0.0, 4.0), (3.0, 2.0), (1.0, 20.0)):
        shape = (200, 30, 40)

        def frames(row_sd=row_sd, pixel_sd=pixel_sd, shape=shape):
            return random.normal(0, row_sd, (shape[0], shape[1], 1)) + random.normal(0, pixel_sd, shape)

        found = [pair_noise(a, b) for a, b in zip(frames(), frames(), strict=True)]
        p_values[row_sd, pixel_sd, "row"] = scatter_p([noise.row_variance_dn2 for noise in found], row_sd**2)
        p_values[row_sd, pixel_sd, "pixel"] = scatter_p([noise.pixel_variance_dn2 for noise in found], pixel_sd**2)
        for name in ("pixel_variance", "variance"):
            error = np.mean([getattr(noise, f"{name}_error_dn2") for noise in found])
            spread = np.var([getattr(noise, f"{name}_dn2") for noise in found], ddof=1) / error**2
            p_values[row_sd, pixel_sd, name] = 2 * min(stats.chi2.cdf(199 * spread, 199), stats.chi2.sf(199 * spread, 199))
    accept(p_values)


def test_rows_columns_and_photosites_of_a_fixed_pattern_come_apart():
    random, estimates = np.random.default_rng(3), []
    truth = {"row_dn2": 4.0, "column_dn2": 9.0, "pixel_dn2": 25.0, "total_dn2": 38.0}
    for _ in range(60):
        body = random.normal(0, 2, (30, 1)) + random.normal(0, 3, (1, 40)) + random.normal(500, 5, (30, 40))
        estimates.append(spatial_variance(stack_of(body + random.normal(0, 6, (30, 40)) for _ in range(8))))
    accept({name: scatter_p([getattr(one, name) for one in estimates], value) for name, value in truth.items()})


def test_a_stack_holds_the_temporal_variance_and_no_pattern_of_its_own():
    random = np.random.default_rng(4)
    stacks = [stack_of(random.poisson(1000.0, (30, 40)).astype(np.uint16) for _ in range(4)) for _ in range(50)]
    p_values = {"variance": scatter_p([stack.variance_dn2 for stack in stacks], 1000.0)}
    p_values["mean"] = mean_p([stack.mean_dn.mean() for stack in stacks], 1000.0, 1000.0 / (4 * 1200))
    p_values["pattern"] = scatter_p([spatial_variance(stack).total_dn2 for stack in stacks], 0.0)
    accept(p_values)


def test_frames_of_two_sizes_are_refused():
    with pytest.raises(PhotositeError, match="one size"):
        pair_noise(np.zeros((4, 5), np.uint16), np.zeros((5, 4), np.uint16))


def test_stacks_that_tell_nothing_are_refused():
    with pytest.raises(PhotositeError, match="two or more"):
        stack_of([np.zeros((4, 4), np.uint16)])
    with pytest.raises(PhotositeError, match="one size"):
        stack_of([np.zeros((4, 4), np.uint16), np.zeros((4, 5), np.uint16)])
    with pytest.raises(PhotositeError, match="too small"):
        spatial_variance(stack_of([np.zeros((2, 4), np.uint16)] * 2))
