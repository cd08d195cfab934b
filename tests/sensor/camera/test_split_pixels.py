"""Two photodiodes under one lens: each has its own light, full well, dark current and fixed pattern, and they join evenly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.hdr_bench import SHOT_NOISE, TWO_PHOTODIODES, combined_codes, hdr_plan
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from helpers.scene_builders import band_scene

from simulator.config import load_camera
from simulator.config.warnings import shot_warnings
from simulator.exposure.settings import Exposure
from simulator.measurement.curves.code_response import code_moments
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.hdr_passes import read_noise_free_combined
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.hdr_variance import combined_variance
from simulator.sensor.readout import read_mean_electrons
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.prnu import Prnu

# Of 2500 e-, before the ADC's 3149, and of 1000 e- behind a twentieth of the light: they end at 2460 and 19800 e- of light.
SPLIT = HdrReadout(light=(1.0, 0.05), full_wells=(1.0, 0.4), dark_currents=(1.0, 0.25))
STAGES = {"full_well": FullWell(2500.0), "dark_current": DarkCurrent(40.0), **SHOT_NOISE}
BLACK_DN = 64.0 + 1.28 * 40.0
WHOLE = Window(2000, 1000, 120, 90)
LEVELS_E = np.array([0.0, 100.0, 1500.0, 2600.0, 6000.0, 16000.0])


def clean_codes(device, sensor, electrons):
    return read_noise_free_combined(device, sensor, [device.upload(np.ascontiguousarray(electrons, np.float32))])


def test_the_join_between_the_diodes_has_no_step(device):
    """Dark electrons 40 and 10 e- count for 40 and 200 e- of light: the second is brought to the first's, codes are linear."""
    means = np.linspace(0.0, 19000.0, 4096)[None, :]
    sensor = hdr_plan(SPLIT, 4096, 1, stages=STAGES)
    np.testing.assert_allclose(clean_codes(device, sensor, means), BLACK_DN + 1.28 * means, rtol=2e-6)
    switch_e = (sensor.readings[0].switch_dn - BLACK_DN) / 1.28
    assert 2000.0 < switch_e < 2400.0 and sensor.readings[1].black_dn == pytest.approx(64.0 + 1.28 * (10.0 - 2.0))


def test_each_diode_ends_at_its_own_full_well(device):
    """The second holds 1000 e-: 990 e- of light, and what its dark current leaves."""
    sensor = hdr_plan(SPLIT, 64, 64, stages=STAGES)
    hushed = {1600: IsoSetting(1.28, 1e-6)}  # with 0 it needs a build of its own
    quiet = hdr_plan(SPLIT, 64, 64, stages=STAGES, iso_table=hushed)
    white_dn = 64.0 + 1.28 * (1000.0 - 8.0) / 0.05
    assert sensor.white_level_dn() == round(white_dn) and sensor.unit_dn == 1
    assert sensor.electrons_at_white() == pytest.approx(990.0 / 0.05, rel=1e-4)
    assert [one.white_level_dn() for one in sensor.plans] == [64 + 3200, 64 + 1280]
    assert (combined_codes(device, quiet, np.full((64, 64), 1e6)) == sensor.white_level_dn()).all()


def test_levels_fit_sixteen_bits_with_the_dark_current_that_the_second_diode_lacks():
    """64 + 16 * 4031 DN and 1280 DN of dark current are more than 65535 DN."""
    dark = {"dark_current": DarkCurrent(1000.0)}
    sensor = hdr_plan(replace(TWO_PHOTODIODES, dark_currents=(1.0, 0.0)), 8, 8, stages=dark)
    assert (sensor.unit_dn, sensor.white_level_dn()) == (2, 32 + (16 * 4031 + 1280) // 2)


def test_another_diode_in_another_exposure_has_the_share_of_both(device):
    """A quarter of the light in a quarter of the time: the second holds E / 16, of which the truth knows."""
    sensor = hdr_plan(HdrReadout(exposures=(1.0, 0.25), light=(1.0, 0.25)), 4, 1)
    light = device.upload(np.full((1, 4), 20000.0, np.float32))
    electrons = [read_mean_electrons(device, part, light) for part in sensor.exposures]
    assert [float(one[0, 0]) for one in electrons] == [20000.0, 1250.0]
    expected = 256.0 * (1.28**2 * 1250.0 + 4.0 + 1 / 12) + 1 / 12
    assert combined_variance(sensor, electrons)[0, 0] == pytest.approx(expected, rel=1e-3)
    assert code_moments(sensor, np.array([20000.0])).variance[0] == pytest.approx(expected, rel=1e-3)
    again = sensor.at(1600, 0.5)
    assert isinstance(again, HdrSensorPlan) and again.plans[1].exposure.time_s == 0.125
    assert again.plans[1].exposure.collecting_area_um2 == 0.25


def test_mean_and_variance_are_those_of_the_diode_that_is_read(device):
    """First: 1.28^2 (E + 40 + 2^2 / 1.28^2) + 1/12. Second: 20^2 times as of E / 20 + 10 electrons."""
    sensor = hdr_plan(SPLIT, 4096, len(LEVELS_E), stages=STAGES)
    means = np.repeat(LEVELS_E[:, None], 4096, axis=1)
    codes = combined_codes(device, sensor, means).astype(np.float64)
    truth = combined_variance(sensor, [means[:, :1].astype(np.float32)])[:, 0]
    curve = code_moments(sensor, LEVELS_E)
    checks = {}
    for row, level, found, mean, variance in zip(codes, LEVELS_E, truth, curve.mean, curve.variance, strict=True):
        diode, scale = (level, 1.0) if level < 2000.0 else (0.05 * level, 20.0)
        dark_e = 40.0 if scale == 1.0 else 10.0
        expected = scale**2 * (1.28**2 * (diode + dark_e) + 4.0 + 1 / 12) + (1 / 12 if scale > 1.0 else 0.0)
        assert found == pytest.approx(expected, rel=1e-3) and variance == pytest.approx(expected, rel=1e-3)
        assert mean == pytest.approx(BLACK_DN + 1.28 * level, rel=1e-6)
        checks[level, "mean"] = mean_p(row, BLACK_DN + 1.28 * level, expected)
        checks[level, "variance"] = variance_p(row, expected)
    accept(checks)


def test_diodes_have_fixed_patterns_of_their_own_and_columns_read_both(device):
    """The mean of frames: photo response of two diodes is independent, offsets of columns are those of one amplifier."""
    shape, only = (64, 128), {"prnu": Prnu(0.05)}
    for stages, level_e, is_common in ((only, 1500.0, False), ({"column_offset": ColumnOffset(40.0)}, 1500.0, True)):
        patterns = []
        for switch_at in (0.9, 0.1):  # at 0.1 the second diode is read, whose DN are 16
            sensor = hdr_plan(replace(TWO_PHOTODIODES, switch_at=switch_at), *shape[::-1], stages=stages)
            patterns.append(combined_codes(device, sensor, np.full(shape, level_e)).astype(float))
        if is_common:
            columns = [pattern.mean(axis=0) - pattern.mean() for pattern in patterns]
            assert np.corrcoef(*columns)[0, 1] > 0.98
        else:
            sigma_dn = 1.28 * level_e * 0.05
            read_dn2 = [4.0 + 1 / 12, 256.0 * (4.0 + 1 / 12)]
            checks = {"independent": correlation_p(*patterns)}
            for place, (pattern, own) in enumerate(zip(patterns, read_dn2, strict=True)):
                checks[f"variance {place}"] = variance_p(pattern, sigma_dn**2 + own)
            accept(checks)


def test_hot_photosites_are_those_of_each_diode(device):
    hot = {"hot_pixels": HotPixels(0.02, 2000.0), "dark_current": DarkCurrent(0.0)}
    found = []
    for readout in (TWO_PHOTODIODES, replace(TWO_PHOTODIODES, dark_currents=(1.0, 0.5), switch_at=0.1)):
        sensor = hdr_plan(readout, 128, 128, stages=hot)
        codes = combined_codes(device, sensor, np.full((128, 128), 1000.0)).astype(float)
        found.append(codes > np.median(codes) + 1200.0)
    both, each = float((found[0] & found[1]).mean()), [float(one.mean()) for one in found]
    assert min(each) > 0.004 and both < 0.25 * min(each)


def test_a_window_has_the_codes_of_the_whole(device):
    means, stages = np.random.default_rng(2).uniform(0.0, 19000.0, (40, 48)), STAGES
    whole = combined_codes(device, hdr_plan(SPLIT, 48, 40, stages=stages), means)
    part = hdr_plan(SPLIT, 48, 40, stages=stages, window=Window(5, 7, 32, 30))
    np.testing.assert_array_equal(combined_codes(device, part, means[7:37, 5:37]), whole[7:37, 5:37])


def split_shot(time_s=0.01, window=WHOLE, **settings) -> Shot:
    camera = replace(load_camera("illustrative/split_pixels"), window=window)
    light = np.where(np.arange(600) < 206, 0.1, 1.0)  # an edge at column 2060
    scene = band_scene(np.broadcast_to(light[None, :, None], (400, 600, 3)), math.inf)
    return Shot(scene, ThinLens(50.0, 8.0, cos4=False), Exposure(time_s, 100), camera, Seeds(frame=5), **settings)


def test_the_illustrative_camera_gains_the_range_that_its_small_diode_has():
    """0.5 of the well over 1/9 of the light: 4.5 times the electrons of light; truth and strips know of both diodes."""
    sensor = plan(split_shot()).sensor
    assert sensor.electrons_at_white() == pytest.approx(4.5 * 87000.0, rel=1e-3)
    assert (
        "2 readings of 1 exposure by 2 photodiodes"
        in next(one for one in plan(split_shot()).passes if one.name == "sensor").method
    )
    assert "light 0.1111" in next(one for one in plan(split_shot()).steps if one.stage == "hdr read-out").why
    assert not shot_warnings(split_shot())
    dim = simulate(split_shot(1e-3))
    time_s = 1e-3 * 3.0 * 87000.0 / float(dim.mean_electrons.max())
    whole = simulate(split_shot(time_s, truth=("variance",)))
    strips = simulate(split_shot(time_s, truth=("variance",)), strip_px=2000)
    for name in ("dn", "mean_electrons", "noise_free_dn"):
        np.testing.assert_array_equal(getattr(strips, name), getattr(whole, name))
    np.testing.assert_array_equal(strips.truth["variance"], whole.truth["variance"])
    part = simulate(split_shot(time_s, window=Window(2016, 1010, 64, 50), truth=("variance",)))
    np.testing.assert_array_equal(part.dn, whole.dn[10:60, 16:80])
    np.testing.assert_array_equal(part.truth["variance"], whole.truth["variance"][10:60, 16:80])
    deviation = (whole.dn.astype(float) - whole.noise_free_dn) / np.sqrt(whole.truth["variance"])
    switch_dn = sensor.combined_dn(sensor.readings[0], sensor.readings[0].switch_dn)
    far = np.abs(whole.noise_free_dn - switch_dn) > 8.0 * np.sqrt(whole.truth["variance"])
    below = whole.noise_free_dn < switch_dn
    assert min((far & below).sum(), (far & ~below).sum()) > 500
    accept(
        {
            (name, what): check
            for name, mask in (("first", far & below), ("second", far & ~below))
            for what, check in (("mean", mean_p(deviation[mask], 0.0, 1.0)), ("variance", variance_p(deviation[mask], 1.0)))
        }
    )
