"""Levels, range and noise of combined readings follow closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.hdr_bench import DUAL_GAIN, HIGH, SHOT_NOISE, TWO_EXPOSURES, combined_codes, hdr_plan
from helpers.randomness import accept, variance_p

from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.hdr_readout import Companding, HdrReadout
from simulator.sensor.hdr_plan import plan_readings
from simulator.sensor.sensor_plan import plan_sensor
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.full_well import FullWell


@pytest.mark.parametrize("readout", [DUAL_GAIN, TWO_EXPOSURES])
def test_sixteen_times_the_range_gives_sixteen_bits_and_24_dB(device, readout):
    """20 lg(4031 * 16 DN / sigma_dark), 24.1 dB more than one reading; the file's levels say it in linear terms."""
    sensor, plain = hdr_plan(readout, 64, 64), hdr_plan(None, 64, 64)
    assert (sensor.unit_dn, sensor.black_level_dn, sensor.white_level_dn()) == (1, 64.0, 64 + 16 * 4031)
    assert sensor.gain_dn_per_e() == pytest.approx(1.28) and sensor.electrons_at_white() == pytest.approx(16 * 4031 / 1.28)
    assert sensor.noise_profile() == pytest.approx((1.28 / (16 * 4031), (4.0 + 1 / 12) / (16 * 4031) ** 2))
    dark, white = (combined_codes(device, sensor, np.full((64, 64), e)) for e in (0.0, 1e6))
    assert (white == sensor.white_level_dn()).all()
    accept({"dark": variance_p(dark, 4.0 + 1 / 12)})

    def decibels(plan):
        return 20.0 * math.log10(plan.full_scale_dn() / math.sqrt(plan.moments(0.0).variance))

    assert decibels(sensor) == pytest.approx(20.0 * math.log10(16 * 4031 / math.sqrt(4.0 + 1 / 12)))
    assert decibels(sensor) - decibels(plain) == pytest.approx(20.0 * math.log10(16.0))


def test_the_signal_to_noise_ratio_dips_where_the_next_reading_takes_over():
    """Dual gain: E / sqrt(E + read noise^2), 1.6 e- below the switch point and 16.7 e- above. Exposures: / sqrt(16 E) above."""
    switch_e = (0.9 * 4031) / 1.28
    for readout, after in ((DUAL_GAIN, switch_e + (1.3**2 + 1 / 12) / 0.08**2), (TWO_EXPOSURES, 16.0 * switch_e + 256 * 2.49)):
        sensor = hdr_plan(readout, 8, 8)
        for share, variance_e2 in ((0.999, switch_e + 2.49), (1.001, after)):
            moments = sensor.moments(share * switch_e)
            expected = share * switch_e / math.sqrt(variance_e2)
            found = (moments.mean - 64.0) / math.sqrt(moments.variance)
            assert found == pytest.approx(expected, rel=2e-3), (readout, share)


def test_a_range_beyond_sixteen_bits_takes_a_larger_unit_and_keeps_a_whole_black():
    sensor = hdr_plan(TWO_EXPOSURES, 8, 8, bit_depth=14, black_level_dn=500.0, iso_table={1600: HIGH})
    assert (sensor.unit_dn, sensor.black_level_dn) == (4, 125.0)
    assert sensor.white_level_dn() == 125 + 15883 * 4
    assert sensor.readings[1].factor == pytest.approx(4.0)


def test_the_switch_point_lies_below_a_full_well_that_fills_before_the_adc():
    well = {"full_well": FullWell(2000.0), **SHOT_NOISE}  # 2624 DN of 4095
    sensor = hdr_plan(TWO_EXPOSURES, 8, 8, stages=well)
    assert sensor.readings[0].switch_dn == math.floor(64 + 0.9 * 2560)
    assert sensor.white_level_dn() == 64 + 16 * 2560


def test_a_full_well_that_ends_both_gains_alike_is_refused():
    with pytest.raises(PhotositeError, match="ends no farther than the one before it"):
        hdr_plan(DUAL_GAIN, 8, 8, stages={"full_well": FullWell(2500.0)})


def test_gains_that_were_not_measured_are_refused_with_the_iso():
    camera = replace(load_camera("sony_a7s2"), hdr_readout=HdrReadout(gains=(1.0, 0.25)))
    plain = plan_sensor(camera, (Integration(0.01, 1.0),), 100, 0.01)
    with pytest.raises(PhotositeError, match="exposure.iso = 25.*has the gain 0.25 at ISO 100"):
        plan_readings(plain, 100)


def test_a_camera_without_readings_keeps_its_plan():
    plain = plan_sensor(load_camera("ideal"), (Integration(0.01, 1.0),), 100, 0.01)
    assert plan_readings(plain, 100) is plain


def test_companding_adds_the_rounding_of_its_steps_to_the_dark_noise():
    """Whole codes in steps of 3 DN err by 0 or 1: variance (3^2 - 1) / 12."""
    spec = replace(DUAL_GAIN, companding=Companding(14, ((3000.0, 1000.0),)))
    sensor = hdr_plan(spec, 8, 8)
    assert sensor.stored_bits == 14 and sensor.decoding.size == 2**14
    assert sensor.moments(0.0).variance == pytest.approx(4.0 + 1 / 12 + 8 / 12, rel=0.02)


def test_another_iso_and_time_plans_all_readings_again():
    table = {iso: IsoSetting(1.28 * iso / 1600, 2.0) for iso in (100, 400, 1600)}
    sensor = hdr_plan(HdrReadout(gains=(1.0, 0.25)), 8, 8, iso_table=table)
    assert sensor.camera.isos == (400, 1600)
    other = sensor.at(400, 0.5)
    assert [one.gain_dn_per_e() for one in other.plans] == pytest.approx([0.32, 0.08])
    assert [one.exposure.time_s for one in other.plans] == [0.5, 0.5]


def test_dark_current_grows_with_the_time_of_each_exposure():
    """100 e-/s for 10 s and for 0.625 s: the same signal after scaling, 16 times the variance in the short one."""
    sensor = hdr_plan(TWO_EXPOSURES, 8, 8, time_s=10.0, stages={"dark_current": DarkCurrent(100.0)})
    long, short = (plan.moments(0.0) for plan in sensor.plans)
    assert (long.mean, short.mean) == pytest.approx((64 + 1280.0, 64 + 80.0))
    assert (long.variance, short.variance) == pytest.approx((1000 * 1.28**2 + 4.0 + 1 / 12, 62.5 * 1.28**2 + 4.0 + 1 / 12))
