"""Analog gain turns electrons into codes: K of EMVA 1288."""

import numpy as np
import pytest
from helpers.randomness import accept, mean_p, variance_p

from simulator.errors import PhotositeError
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Moments


def test_codes_are_gain_times_electrons(bench):
    assert bench.sensor(np.array([[0.0, 100.0, 1000.0]]), gain=0.5, black=64.0).tolist() == [[64, 114, 564]]


def test_photon_transfer_slope_is_the_gain(bench):
    """EMVA 1288: variance in codes = K * mean in codes + 1/12."""
    gain, electrons = 3.0, 5000.0
    codes = bench.sensor(np.full((512, 512), electrons), PhotonShotNoise(), gain=gain)
    variance = gain**2 * electrons  # gain 3 maps whole electrons to whole codes: no rounding error
    accept({"mean": mean_p(codes, gain * electrons, variance), "variance": variance_p(codes, variance, 1 / electrons)})


def test_a_gain_of_zero_is_refused():
    with pytest.raises(PhotositeError, match="analog_gain.gain"):
        AnalogGain(0.0)


def test_moments_scale_with_gain_and_its_square():
    assert AnalogGain(3.0).moments(Moments(2.0, 5.0)) == Moments(6.0, 45.0)
