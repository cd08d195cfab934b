"""Banding is a sine over the rows whose phase is new in each frame."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.banding import Banding
from simulator.sensor.stages.stage import Moments


@pytest.mark.parametrize("period", [2.0, 17.3, 400.0])
def test_rows_follow_a_sine_of_the_amplitude_and_period_given(bench, period):
    codes = bench.sensor(np.zeros((800, 5)), Banding(1000.0, period), black=5000.0, frame_seed=3)
    assert (codes == codes[:, :1]).all()
    turns = np.arange(800) / period
    waves = np.stack([np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)], axis=1)
    fitted, *_ = np.linalg.lstsq(waves, codes[:, 0] - 5000.0, rcond=None)
    assert np.abs(codes[:, 0] - 5000.0 - waves @ fitted).max() < 0.5 + 0.15  # rounding, and float32 turns of up to 400
    if period > 2.0:  # at 2 rows a sine shows only its values at two phases
        assert abs(np.hypot(*fitted) - 1000.0) < 0.2


def test_phases_are_uniform_over_frames(bench):
    quarter = np.zeros((2, 2))
    first = np.array([bench.sensor(quarter, Banding(1000.0, 4.0), black=5000.0, frame_seed=k)[:, 0] for k in range(400)])
    phases = np.arctan2(first[:, 0] - 5000.0, first[:, 1] - 5000.0)  # sine and cosine, a quarter turn apart
    accept({"uniform": stats.kstest(phases / (2 * np.pi) + 0.5, "uniform").pvalue})


@pytest.mark.parametrize(("arguments", "message"), [((-1.0, 9.0), "amplitude"), ((1.0, 1.0), "period")])
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=f"banding.{message}"):
        Banding(*arguments)


def test_moments_add_half_the_squared_amplitude():
    assert Banding(4.0, 9.0).moments(Moments(5.0, 1.0)) == Moments(5.0, 9.0)
