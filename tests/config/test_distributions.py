"""Distributions draw what their names say: against SciPy's distributions, by Kolmogorov-Smirnov and chi-square."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from simulator.config.distributions import Choice, LogUniform, Normal, Table, Uniform, draw, support_of, weighted_index
from simulator.errors import PhotositeError

SHARES = np.random.default_rng(20).random(20_000)

CONTINUOUS = {
    "uniform": (Uniform((100.0, 300.0)), stats.uniform(100.0, 200.0)),
    "log-uniform": (LogUniform((0.1, 30.0)), stats.loguniform(0.1, 30.0)),
    "normal": (Normal((2.0, 0.5)), stats.norm(2.0, 0.5)),
    "normal, cut off": (Normal((2.0, 0.5), (1.8, 4.0)), stats.truncnorm(-0.4, 4.0, 2.0, 0.5)),
    "table": (Table(((0.0, 0.0), (1.0, 0.25), (5.0, 1.0))), None),
}


def test_continuous_draws_follow_their_distribution():
    p_values = {}
    for name, (distribution, reference) in CONTINUOUS.items():
        drawn = [draw(distribution, share) for share in SHARES]
        known = reference.cdf if reference else lambda x: np.interp(x, [0.0, 1.0, 5.0], [0.0, 0.25, 1.0])
        p_values[name] = stats.kstest(drawn, known).pvalue
    accept(p_values)


def test_a_choice_is_made_by_its_weights():
    distribution = Choice((100.0, 200.0, 400.0, 800.0), (1.0, 0.0, 5.0, 2.0))
    drawn = np.array([draw(distribution, share) for share in SHARES])
    counts = np.array([(drawn == iso).sum() for iso in (100.0, 400.0, 800.0)])
    assert counts.sum() == SHARES.size
    accept({"chi-square": stats.chisquare(counts, np.array([1.0, 5.0, 2.0]) / 8.0 * SHARES.size).pvalue})


def test_a_plain_number_is_itself():
    assert draw(250.0, 0.3) == 250.0 and draw(2, 0.9) == 2.0


def test_draws_hide_the_last_digits_of_a_logarithm():
    assert draw(1.0 / 3.0, 0.5) == 0.333333333


@pytest.mark.parametrize("distribution, least, greatest", [(7.0, 7.0, 7.0), (LogUniform((1.0, 300.0)), 1.0, 300.0)])
def test_ends_are_the_least_and_greatest_draw(distribution, least, greatest):
    assert support_of(distribution) == (least, greatest)


def test_the_last_place_of_weight_takes_the_end():
    assert weighted_index((1.0, 1.0, 0.0), 1.0) == 1
    assert weighted_index((0.0, 1.0), 0.0) == 1


@pytest.mark.parametrize(
    "make, names",
    [
        (lambda: Uniform((3.0, 1.0)), "uniform"),
        (lambda: LogUniform((0.0, 1.0)), "logarithm"),
        (lambda: Normal((0.0, 0.0)), "normal"),
        (lambda: Normal((0.0, 1.0), (40.0, 41.0)), "within"),
        (lambda: Choice(()), "choice"),
        (lambda: Choice((1.0, 2.0), (1.0,)), "weights"),
        (lambda: Choice((1.0,), (-1.0,)), "weights"),
        (lambda: Table(((0.0, 0.1), (1.0, 1.0))), "table"),
    ],
)
def test_impossible_distributions_are_refused(make, names):
    with pytest.raises(PhotositeError, match=names):
        make()
