"""The variance of the codes holds for any light: beyond every limit a photosite has the noise of what comes after the limit."""

import numpy as np
import pytest
from helpers.randomness import accept, mean_p, variance_p

from simulator.device import open_device
from simulator.sensor.code_variance import clipped_moments, code_variance
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack, frame_stack_moments
from simulator.sensor.kernel.kernel_program import signal_steps
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain

FULL = (PhotonShotNoise(), FullWell(20000.0), AnalogGain(0.25), ReadNoiseAfterGain(1.5), Adc(14, 256.0))
FULL_MEAN_DN, FULL_VARIANCE_DN2 = 256.0 + 0.25 * 20000.0, 1.5**2 + 1 / 12


def test_a_full_well_below_white_keeps_the_read_noise_however_bright_the_light():
    electrons = np.geomspace(21500.0, 1e12, 400)
    assert code_variance(signal_steps(FULL), electrons[None].astype(np.float32)) == pytest.approx(FULL_VARIANCE_DN2, rel=1e-6)
    found = clipped_moments(signal_steps(FULL), electrons)
    assert found.mean == pytest.approx(FULL_MEAN_DN, rel=1e-12)
    assert found.variance == pytest.approx(FULL_VARIANCE_DN2, rel=1e-12)


def test_frames_of_full_wells_scatter_as_they_are_said_to():
    light = np.repeat(np.float32([3e4, 1e5, 1e6, 1e9]), 30000).reshape(1, 4, -1)
    device, settings = open_device(), [FrameSetting(FULL)]
    codes = expose_frame_stack(device, light, settings)[0].astype(float)
    noise_free_dn, variance_dn2 = (array[0, :, 0].astype(float) for array in frame_stack_moments(device, light, settings))
    checks = {}
    for row, level, variance in zip(codes, noise_free_dn, variance_dn2, strict=True):
        checks |= {("mean", len(checks)): mean_p(row, level, variance), ("variance", len(checks)): variance_p(row, variance)}
    accept(checks)


def test_light_far_beyond_white_has_no_noise_and_the_white_level():
    found = clipped_moments(signal_steps((PhotonShotNoise(), AnalogGain(1.0), Adc(12, 64.0))), np.array([6e3, 1e6, 1e12]))
    assert (found.mean == 4095.0).all() and (found.variance == 0.0).all()
