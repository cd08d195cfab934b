"""High conversion gain makes noise that follows count less in electrons."""

import numpy as np
import pytest
from helpers.randomness import accept, variance_p

from simulator.errors import PhotositeError
from simulator.sensor.stages.conversion_gain import ConversionGain
from simulator.sensor.stages.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.sensor.stages.stage import Moments


def test_multiplies_the_signal(bench):
    assert bench.sensor(np.array([[0.0, 10.0, 1000.0]]), ConversionGain(3.0), gain=2.0).tolist() == [[0, 60, 6000]]


def test_read_noise_behind_it_is_not_multiplied(bench):
    codes = bench.sensor(np.full((512, 512), 500.0), ConversionGain(4.0), ReadNoiseBeforeGain(12.0))
    accept({"variance": variance_p(codes, 144.0 + 1 / 12)})


@pytest.mark.parametrize("ratio", [0.5, 0.0, float("inf")])
def test_a_ratio_below_one_is_refused(ratio):
    with pytest.raises(PhotositeError, match="conversion_gain.ratio"):
        ConversionGain(ratio)


def test_moments_scale():
    assert ConversionGain(2.0).moments(Moments(5.0, 1.0, 3.0)) == Moments(10.0, 4.0, 12.0)
