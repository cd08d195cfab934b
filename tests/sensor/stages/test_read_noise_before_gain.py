"""Read noise before the gain is Gaussian in electrons and grows with the gain."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats
from scipy.special import polygamma

from simulator.errors import PhotositeError
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((512, 512))


def test_variance_in_codes_is_gain_squared_sigma_squared_plus_rounding(bench):
    checks = {}
    for seed, (gain, sigma) in enumerate([(1.0, 3.0), (4.0, 3.0), (0.5, 20.0)], start=1):
        codes = bench.sensor(DARK, ReadNoiseBeforeGain(sigma), gain=gain, black=1000.0, frame_seed=seed)
        variance = (gain * sigma) ** 2 + 1 / 12
        checks[gain, "mean"] = mean_p(codes, 1000.0, variance)
        checks[gain, "variance"] = variance_p(codes, variance)
    accept(checks)


def test_shape_is_gaussian(bench):
    codes = bench.sensor(DARK, ReadNoiseBeforeGain(500.0), black=30000.0)
    accept({"shape": stats.kstest((codes.ravel() - 30000.0) / 500.0, "norm").pvalue})  # steps of 1/500 sigma do not matter


def test_is_independent_of_shot_noise_and_of_read_noise_after_the_gain(bench):
    before = bench.sensor(DARK, ReadNoiseBeforeGain(30.0), black=1000.0).astype(float)
    after = bench.sensor(DARK, ReadNoiseAfterGain(30.0), black=1000.0).astype(float)
    shot = bench.sensor(DARK + 900.0, PhotonShotNoise()).astype(float)
    few = bench.sensor(DARK + 4.0, PhotonShotNoise()).astype(float)
    accept(
        {
            "after the gain": correlation_p(before, after),
            "squares": correlation_p((before - 1000) ** 2, (after - 1000) ** 2),
            "shot noise": correlation_p(before, shot),
            "few photons": correlation_p(before, few),
            "few, after": correlation_p(after, few),
        }
    )


def test_switching_another_noise_on_leaves_the_pattern(bench):
    alone = bench.sensor(DARK, ReadNoiseBeforeGain(40.0), black=1000.0).astype(int)
    both = bench.sensor(DARK + 9.0, ReadNoiseBeforeGain(40.0), PhotonShotNoise(), black=1000.0).astype(int)
    shot = bench.sensor(DARK + 9.0, PhotonShotNoise(), black=1000.0).astype(int) - 1000
    assert np.abs(both - alone - shot).max() <= 1  # rounding of a sum against the sum of roundings


def test_a_negative_sigma_is_refused():
    with pytest.raises(PhotositeError, match="read_noise_before_gain.sigma"):
        ReadNoiseBeforeGain(-1.0)


def test_moments_add_sigma_squared():
    assert ReadNoiseBeforeGain(3.0).moments(Moments(5.0, 1.0)) == Moments(5.0, 10.0)


def test_with_a_spread_each_photosite_has_a_sigma_of_its_own_and_the_mean_square_stays(bench):
    noise = ReadNoiseBeforeGain(200.0, spread=0.3)
    stack = np.stack([bench.sensor(DARK, noise, black=20000.0, frame_seed=k) for k in range(16)]) - 20000.0
    squares = stack**2
    fourth = 3.0 * 200.0**4 * np.exp(4 * 0.3**2)  # E[z^4] E[sigma^4], sigma log-normal
    own = np.log(squares.mean(axis=0)) / 2  # of sigma; 16 frames scatter by sqrt(trigamma(8)) / 2
    checks = {
        "mean square": mean_p(squares[0], 200.0**2, fourth - 200.0**4),
        "spread": variance_p(own, 0.3**2 + polygamma(1, 8.0) / 4, excess_kurtosis=0.05),
        "neighbours": correlation_p(own[:, 1:], own[:, :-1]),
    }
    accept(checks)


def test_the_spread_belongs_to_the_body(bench):
    noise = ReadNoiseBeforeGain(200.0, spread=0.8)
    first, second = (np.abs(bench.sensor(DARK, noise, black=30000.0, frame_seed=k) - 30000.0) for k in (1, 2))
    other = np.abs(bench.sensor(DARK, noise, black=30000.0, frame_seed=3, body_seed=9) - 30000.0)
    assert correlation_p(np.log1p(first), np.log1p(second)) < 1e-9
    accept({"another body": correlation_p(np.log1p(first), np.log1p(other))})
