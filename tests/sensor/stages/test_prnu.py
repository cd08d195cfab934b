"""Photo response nonuniformity belongs to the body, is normal, and scales with the light."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.stage import Moments

LIGHT = np.full((512, 512), 20000.0)


def pattern(bench, sigma=0.05, **seeds):
    return bench.sensor(LIGHT, Prnu(sigma), **seeds) / 20000.0 - 1.0


def test_the_response_is_normal_with_the_sigma_given(bench):
    checks = {}
    for sigma in (0.004, 0.05):
        found = pattern(bench, sigma)
        variance = sigma**2 + 1 / 12 / 20000.0**2
        checks[sigma, "mean"] = mean_p(found, 0.0, variance)
        checks[sigma, "variance"] = variance_p(found, variance)
    checks["shape"] = stats.kstest(found.ravel() / 0.05, "norm").pvalue  # codes are 1/1000 sigma apart
    accept(checks)


def test_it_belongs_to_the_body_not_to_the_frame(bench):
    first = pattern(bench)
    assert np.array_equal(pattern(bench, frame_seed=9), first)
    accept({"another body": correlation_p(pattern(bench, body_seed=3), first)})


def test_neighbours_are_independent(bench):
    found = pattern(bench)
    across = {"columns": correlation_p(found[:, 1:], found[:, :-1])}
    accept(across | {f"rows {k}": correlation_p(found[k:], found[:-k]) for k in (1, 2)})


def test_it_scales_with_the_light_and_is_never_negative(bench):
    bright, dim = (bench.sensor(LIGHT * scale, Prnu(0.2)).astype(float) for scale in (1.0, 0.25))
    assert np.abs(bright - 4.0 * dim).max() <= 2.5 + 1e-3  # roundings: 1/2 and 4 * 1/2
    assert (bench.sensor(np.zeros((64, 64)), Prnu(0.2)) == 0).all()


@pytest.mark.parametrize("sigma", [-0.01, 0.21, float("nan")])
def test_a_sigma_that_is_no_small_share_is_refused(sigma):
    with pytest.raises(PhotositeError, match="prnu.sigma"):
        Prnu(sigma)


def test_moments_add_a_fixed_variance():
    assert Prnu(0.1).moments(Moments(50.0, 3.0, 4.0)) == Moments(50.0, 3.0, 29.0)
