"""The ADC rounds to nearest, keeps the black level, and never leaves 0 ... 2^n - 1."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.stage import Moments


@pytest.mark.parametrize("bits", range(8, 17))
def test_codes_stay_inside_the_range(bench, bits):
    codes = bench.sensor(np.array([[0.0, 2.0**bits - 2, 2.0**bits - 1.4, 2.0**bits, 1e9]]), bits=bits)
    top = 2**bits - 1
    assert codes.tolist() == [[0, top - 1, top, top, top]]  # reference number R17: code 2^n does not exist


def test_rounds_to_nearest_even(bench):
    signal = np.array([[0.5, 1.5, 2.5, 2.4999, 3.5001]])
    assert bench.sensor(signal, black=10.0).tolist() == [[10, 12, 12, 12, 14]]


def test_mean_is_not_shifted_and_variance_is_one_twelfth(bench):
    signal = (np.linspace(100.0, 1100.0, 1_000_000, endpoint=False) + 4.8828125e-4).reshape(1000, 1000)  # no ties
    error = bench.sensor(signal) - signal.astype(np.float32).astype(np.float64)
    assert abs(error.mean()) < 1e-4  # truncation would give -0.5
    assert abs(error.var() - 1 / 12) < 1e-4


def test_a_black_level_outside_the_codes_is_refused():
    with pytest.raises(PhotositeError, match="adc.black_level"):
        Adc(8, 300.0)
    with pytest.raises(PhotositeError, match="adc.bit_depth"):
        Adc(20, 0.0)


def test_moments_add_black_and_rounding():
    assert Adc(12, 64.0).moments(Moments(100.0, 1.0)) == Moments(164.0, 1.0 + 1 / 12)
