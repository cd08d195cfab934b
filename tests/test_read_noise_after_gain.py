"""Read noise after the gain is Gaussian in codes, whatever the gain."""

import numpy as np
import pytest
from randomness import accept, correlation_p, mean_p, variance_p

from simulator.errors import PhotositeError
from simulator.sensor.read_noise_after_gain import ReadNoiseAfterGain
from simulator.stage import Moments

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
