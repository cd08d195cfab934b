"""Row noise is normal, common to a row, and new in each frame."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.row_noise import RowNoise
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((20000, 3))


def rows(bench, frame_seed=1, sigma=300.0):
    codes = bench.sensor(DARK, RowNoise(sigma), black=20000.0, frame_seed=frame_seed)
    assert (codes == codes[:, :1]).all()
    return codes[:, 0] - 20000.0


def test_rows_are_normal_and_independent_of_each_other_and_of_other_frames(bench):
    first, second = rows(bench), rows(bench, 2)
    variance = 300.0**2 + 1 / 12
    accept(
        {
            "mean": mean_p(first, 0.0, variance),
            "variance": variance_p(first, variance),
            "shape": stats.kstest(first / 300.0, "norm").pvalue,
            "neighbours": correlation_p(first[1:], first[:-1]),
            "frames": correlation_p(first, second),
        }
    )


def test_a_row_has_its_noise_wherever_the_frame_is_cut(bench):
    whole = bench.sensor(np.zeros((101, 40)), RowNoise(50.0), black=1000.0)
    assert np.array_equal(bench.sensor(np.zeros((44, 9)), RowNoise(50.0), black=1000.0, x=11, y=23), whole[23:67, 11:20])


def test_a_negative_sigma_is_refused():
    with pytest.raises(PhotositeError, match="row_noise.sigma = -2 DN"):
        RowNoise(-2.0)


def test_moments_add_sigma_squared():
    assert RowNoise(3.0).moments(Moments(5.0, 1.0, 2.0)) == Moments(5.0, 10.0, 2.0)
