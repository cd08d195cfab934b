"""Read noise after the gain is Gaussian in codes, whatever the gain."""

import math

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import integrate, stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.stage import Moments
from simulator.sensor.stages.tukey_lambda_polynomial import (
    GREATEST_LAMBDA,
    LEAST_LAMBDA,
    REACH,
    least_squares,
    tukey_lambda_deviation,
    tukey_polynomial,
)

DARK = np.zeros((512, 512))


def test_variance_in_codes_does_not_depend_on_the_gain(bench):
    checks = {}
    for gain in (0.25, 1.0, 16.0):
        codes = bench.sensor(DARK, ReadNoiseAfterGain(5.0), gain=gain, black=500.0, frame_seed=int(gain * 4))
        checks[gain, "mean"] = mean_p(codes, 500.0, 25.0 + 1 / 12)
        checks[gain, "variance"] = variance_p(codes, 25.0 + 1 / 12)
    accept(checks)


def test_frames_are_independent(bench):
    first, second = (bench.sensor(DARK, ReadNoiseAfterGain(20.0), black=500.0, frame_seed=seed) for seed in (1, 2))
    accept({"frames": correlation_p(first, second), "neighbours": correlation_p(first[:, 1:], first[:, :-1])})


def test_a_negative_sigma_is_refused():
    with pytest.raises(PhotositeError, match="read_noise_after_gain.sigma"):
        ReadNoiseAfterGain(-0.1)


def test_moments_add_sigma_squared():
    assert ReadNoiseAfterGain(2.0).moments(Moments(5.0, 1.0)) == Moments(5.0, 5.0)


SHAPES = [LEAST_LAMBDA, -0.14, -1e-3, 0.0, 1e-3, 0.13, GREATEST_LAMBDA]


@pytest.mark.parametrize("shape", SHAPES)
def test_tukey_lambda_has_the_sigma_and_the_shape_given(bench, shape):
    codes = bench.sensor(DARK, ReadNoiseAfterGain(400.0, shape), black=30000.0, frame_seed=6).ravel() - 30000.0
    scale = 400.0 / stats.tukeylambda.std(shape)  # the scale of such a fit is not its sigma
    kurtosis = float(stats.tukeylambda.stats(shape, moments="k")) if shape > -0.24 else None  # infinite from -1/4 down
    checks = {"shape": stats.kstest(codes, stats.tukeylambda(shape, scale=scale).cdf).pvalue}
    if kurtosis is not None:
        checks["variance"] = variance_p(codes, 400.0**2, excess_kurtosis=kurtosis)
    accept(checks)


@pytest.mark.parametrize("shape", SHAPES)
def test_the_polynomial_is_within_2e_5_of_the_distribution_and_within_1e_4_of_its_variance(shape):
    """Total variation distance in float64: each normal number's share goes where the polynomial sends it."""
    z = np.linspace(-REACH, REACH, 100_001)
    value = z * np.polynomial.polynomial.polyval(z * z, tukey_polynomial(shape)) * stats.tukeylambda.std(shape)
    assert (np.diff(value[np.abs(z) < 6.0]) > 0).all()
    found, exact = np.diff(stats.norm.cdf(z)), np.diff(stats.tukeylambda.cdf(value, shape))
    assert 0.5 * np.abs(found - exact).sum() < 2e-5
    variance = np.sum(0.25 * (value[1:] + value[:-1]) ** 2 * found) / stats.tukeylambda.var(shape)
    assert abs(variance - 1.0) < (1e-4 if shape > LEAST_LAMBDA else 3e-3)  # its tail beyond 6.7 normal sigmas is cut


def test_the_fit_of_the_polynomial_is_that_of_numpys_least_squares():
    rng = np.random.default_rng(4)
    matrix = np.polynomial.chebyshev.chebvander(np.linspace(-1, 1, 500), 8) * np.exp(rng.normal(0, 2, (500, 1)))
    wanted = rng.normal(0, 1, 500)
    expected = np.linalg.lstsq(matrix, wanted, rcond=None)[0]
    np.testing.assert_allclose(least_squares(matrix, wanted), expected, rtol=1e-10)


def test_a_shape_that_was_not_fitted_is_refused():
    with pytest.raises(PhotositeError, match="tukey_lambda = -0.5: give -0.3 to 0.25"):
        ReadNoiseAfterGain(1.0, -0.5)


@pytest.mark.parametrize(
    "shape", [LEAST_LAMBDA, -0.1, -0.0051, -0.0049, -1e-9, 0.0, 1e-300, 1e-5, 0.0049, 0.0051, 0.14, GREATEST_LAMBDA]
)
def test_the_deviation_of_tukeys_lambda_is_that_of_its_quantiles(shape):
    def quantile(p):
        return math.log(p / (1 - p)) if abs(shape) < 1e-6 else (p**shape - (1 - p) ** shape) / shape

    variance, _ = integrate.quad(
        lambda t: 2 * quantile(math.exp(-t)) ** 2 * math.exp(-t), math.log(2), 700, epsrel=1e-12, limit=500
    )
    assert tukey_lambda_deviation(shape) == pytest.approx(math.sqrt(variance), rel=1e-8 if abs(shape) < 1e-6 else 3e-11)
