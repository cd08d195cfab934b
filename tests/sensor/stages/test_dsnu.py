"""Dark signal nonuniformity is an offset that belongs to the body."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((512, 512))


def test_offsets_are_normal_with_sigma_in_electrons(bench):
    checks = {}
    for gain, sigma in ((1.0, 5.0), (4.0, 300.0)):
        found = bench.sensor(DARK, Dsnu(sigma), gain=gain, black=20000.0) - 20000.0
        variance = (gain * sigma) ** 2 + 1 / 12
        checks[gain, "mean"] = mean_p(found, 0.0, variance)
        checks[gain, "variance"] = variance_p(found, variance)
    checks["shape"] = stats.kstest(found.ravel() / 1200.0, "norm").pvalue
    accept(checks)


def test_it_belongs_to_the_body_and_not_to_light_or_frame(bench):
    first = bench.sensor(DARK, Dsnu(50.0), black=1000.0).astype(float)
    lit = bench.sensor(DARK + 5000.0, Dsnu(50.0), black=1000.0, frame_seed=8)
    apart = np.abs(lit - 5000.0 - first)
    assert apart.max() <= 1 and apart.mean() < 1e-3  # a sum near a half may round the other way
    accept({"another body": correlation_p(bench.sensor(DARK, Dsnu(50.0), black=1000.0, body_seed=7), first)})


def test_it_is_independent_of_the_photo_response_and_of_neighbours(bench):
    dark = bench.sensor(DARK, Dsnu(50.0), black=1000.0).astype(float)
    light = bench.sensor(DARK + 20000.0, Prnu(0.02)).astype(float)
    accept(
        {
            "prnu": correlation_p(dark, light),
            "squares": correlation_p((dark - 1000.0) ** 2, (light - 20000.0) ** 2),
            "columns": correlation_p(dark[:, 1:], dark[:, :-1]),
            "rows": correlation_p(dark[1:], dark[:-1]),
            "rows of one pair": correlation_p(dark[1::2], dark[::2]),
        }
    )


def test_a_negative_sigma_is_refused():
    with pytest.raises(PhotositeError, match="dsnu.sigma = -1 e-"):
        Dsnu(-1.0)


def test_moments_add_a_fixed_variance():
    assert Dsnu(3.0).moments(Moments(5.0, 1.0, 2.0)) == Moments(5.0, 1.0, 11.0)
