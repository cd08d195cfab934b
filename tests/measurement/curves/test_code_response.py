"""Moments of the code against closed forms, and against the codes of frames."""

import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.hdr_bench import DUAL_GAIN, SHOT_NOISE, combined_codes, hdr_plan
from helpers.randomness import accept, mean_p, variance_p

from simulator.color.spectra import WAVELENGTHS_NM, illuminant
from simulator.measurement.curves.code_response import code_moments, electrons_below_white, electrons_per_lx_s, sensor_alone
from simulator.sensor.camera.camera import IsoSetting

GAIN, READ_DN = 0.25, 3.0
BODY = {"iso_table": {100: IsoSetting(GAIN, READ_DN)}, "stages": SHOT_NOISE, "black_level_dn": 500.0}


def test_the_moments_of_shot_and_read_noise_are_the_closed_form():
    electrons = np.geomspace(1.0, 1e5, 50)
    signal = code_moments(sensor_alone(small_camera(**BODY), 100, 0.01), electrons)
    assert signal.mean == pytest.approx(500.0 + GAIN * electrons, rel=1e-12)
    assert signal.variance == pytest.approx(GAIN**2 * electrons + READ_DN**2 + 1.0 / 12.0, rel=1e-9)


def test_an_hdr_read_out_has_the_moments_of_its_codes(device):
    """Far below, near and above the switch to the reading of low gain."""
    electrons = np.array([200.0, 2800.0, 2834.0, 20000.0])
    sensor = hdr_plan(DUAL_GAIN, 256, 256)
    signal = code_moments(sensor, electrons)
    checks = {}
    for mean_e, mean, variance in zip(electrons, signal.mean, signal.variance, strict=True):
        codes = combined_codes(device, sensor, np.full((256, 256), mean_e))
        checks[f"variance at {mean_e:g} e-"] = variance_p(codes, variance, excess_kurtosis=1.0)
        if mean_e != 2834.0:  # near the switch the mean is that of one reading
            checks[f"mean at {mean_e:g} e-"] = mean_p(codes, mean, variance)
    accept(checks)


def test_curves_end_where_noise_begins_to_clip_at_white():
    sensor = sensor_alone(small_camera(**BODY), 100, 0.01)
    electrons = electrons_below_white(sensor, 0.1, 200)
    signal = code_moments(sensor, electrons)
    reach = (sensor.white_level_dn() - signal.mean) / np.sqrt(signal.variance)
    assert reach.min() >= 4.0 and reach[-1] < 40.0
    assert electrons[0] == pytest.approx(0.1) and len(electrons) == 200


def test_a_sensor_that_dark_current_fills_has_no_curve():
    from simulator.sensor.stages.dark_current import DarkCurrent

    stages = {**SHOT_NOISE, "dark_current": DarkCurrent(1e6, 3600.0)}
    assert electrons_below_white(sensor_alone(small_camera(**BODY | {"stages": stages}), 100, 3600.0), 0.1, 20).size == 0


def test_electrons_of_a_lux_second_of_daylight():
    """A camera that sees 550 nm alone: 25 um^2 * integral of the light * lambda / (h c) over its band, per 683 lm/W * V."""
    import colour

    daylight = illuminant("D55")
    band = np.interp(WAVELENGTHS_NM, [540.0, 550.0, 560.0], [0.0, 1.0, 0.0])
    photons = np.trapezoid(daylight * band * WAVELENGTHS_NM * 1e-9, WAVELENGTHS_NM) / (6.62607015e-34 * 299792458.0)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"]
    visible = np.interp(WAVELENGTHS_NM, observer.wavelengths, observer.values[:, 1])
    lux = 683.0 * np.trapezoid(daylight * visible, WAVELENGTHS_NM)
    found = electrons_per_lx_s(sensor_alone(green_camera(**BODY), 100, 0.01))
    assert found == pytest.approx(25e-12 * photons / lux, rel=2e-3)  # trapezoids of 5 nm against sums of 1 nm
    assert not math.isnan(found)
