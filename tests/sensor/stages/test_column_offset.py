"""Column offsets are normal, common to a column, and belong to the body."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((3, 20000))


def test_offsets_are_normal_and_the_same_in_every_row_whatever_the_gain(bench):
    codes = bench.sensor(DARK, ColumnOffset(300.0), black=20000.0, gain=5.0)
    assert (codes == codes[0]).all()
    found = codes[0] - 20000.0
    variance = 300.0**2 + 1 / 12
    accept(
        {
            "mean": mean_p(found, 0.0, variance),
            "variance": variance_p(found, variance),
            "shape": stats.kstest(found / 300.0, "norm").pvalue,
            "neighbours": correlation_p(found[1:], found[:-1]),
        }
    )


def test_they_belong_to_the_body_and_to_the_place_on_the_sensor(bench):
    first = bench.sensor(DARK, ColumnOffset(9.0), black=100.0)
    assert np.array_equal(bench.sensor(DARK, ColumnOffset(9.0), black=100.0, frame_seed=5), first)
    assert np.array_equal(bench.sensor(DARK[:, :900], ColumnOffset(9.0), black=100.0, x=333, y=7), first[:, 333:1233])
    accept({"another body": correlation_p(bench.sensor(DARK, ColumnOffset(9.0), black=100.0, body_seed=9)[0], first[0])})


def test_a_negative_sigma_is_refused():
    with pytest.raises(PhotositeError, match="column_offset.sigma = -2 DN"):
        ColumnOffset(-2.0)


def test_moments_add_a_fixed_variance():
    assert ColumnOffset(3.0).moments(Moments(5.0, 1.0, 2.0)) == Moments(5.0, 1.0, 11.0)
