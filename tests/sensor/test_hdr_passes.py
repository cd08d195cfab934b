"""Combined codes: each reading has its own noise, readings of one charge share its shot noise, and the mean is the light's."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.hdr_bench import DUAL_GAIN, SHOT_NOISE, TWO_EXPOSURES, TWO_PHOTODIODES, combined_codes, hdr_plan
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.hdr_readout import Companding, HdrReadout
from simulator.sensor.hdr_passes import read_noise_free_combined, reading_seeds
from simulator.sensor.hdr_variance import combined_variance
from simulator.sensor.readout import read_out
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.full_well import FullWell

LEVELS_E = np.concatenate(
    [[0.0, 3.0, 100.0, 1500.0, 2700.0], np.linspace(2760.0, 2910.0, 6), [3000.0, 3500.0, 20000.0, 45000.0]]
)
COLUMNS = 4096
MEANS = np.repeat(LEVELS_E[:, None], COLUMNS, axis=1)


@pytest.mark.parametrize(
    "readout",
    [
        DUAL_GAIN,
        TWO_EXPOSURES,
        TWO_PHOTODIODES,
        HdrReadout(exposures=(1.0, 1.0, 0.125), gains=(1.0, 0.25, 0.25)),
        HdrReadout(gains=(1.0, 0.0625), companding=Companding(12, ((1024.0, 1024.0), (8192.0, 2048.0)))),
    ],
    ids=["dual gain", "two exposures", "two photodiodes", "three readings", "companded"],
)
def test_mean_and_variance_at_each_level_are_those_of_the_truth(device, readout):
    """Photon transfer: z-test of the means away from the switch points, and of the variances everywhere."""
    tables = {100: (0.08, 1.3), 400: (0.32, 1.5), 1600: (1.28, 2.0)}
    sensor = hdr_plan(readout, COLUMNS, len(LEVELS_E), iso_table={iso: IsoSetting(*line) for iso, line in tables.items()})
    codes = combined_codes(device, sensor, MEANS).astype(np.float64)
    light = [device.upload(MEANS.astype(np.float32))] * len(sensor.exposures)
    clean = read_noise_free_combined(device, sensor, light)
    black, gain = 64.0 / sensor.unit_dn, 1.28 / sensor.unit_dn
    np.testing.assert_allclose(clean, black + gain * MEANS, rtol=1e-6)
    shares = sensor.spec.exposure_shares
    variance = combined_variance(sensor, [share * MEANS[:, :1].astype(np.float32) for share in shares])[:, 0]
    switches = [sensor.combined_dn(one, float(one.switch_dn)) for one in sensor.readings[:-1]]
    checks = {}
    for row, truth, level in zip(codes, variance, LEVELS_E, strict=True):
        far = all(abs(switch - black - gain * level) > 8.0 * np.sqrt(truth) for switch in switches)
        if far:
            checks[level, "mean"] = mean_p(row - black - gain * level, 0.0, truth)
        checks[level, "variance"] = variance_p(row, truth, max(float(stats.kurtosis(row)), -1.0) or 1e-9)
    assert sum("mean" in check for check in checks) > 5
    accept(checks)


def test_below_the_switch_point_the_frame_is_that_of_one_reading(device):
    means = np.random.default_rng(1).uniform(0.0, 2000.0, (30, 64))
    plain = hdr_plan(None, 64, 30)
    once = read_out(device, plain, device.upload(means.astype(np.float32)), Seeds(2, 1))
    for readout in (DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES):
        np.testing.assert_array_equal(combined_codes(device, hdr_plan(readout, 64, 30), means), once)


@pytest.mark.parametrize(("readout", "shared"), [(DUAL_GAIN, True), (TWO_EXPOSURES, False), (TWO_PHOTODIODES, False)])
def test_only_readings_of_one_charge_share_its_shot_noise(device, readout, shared):
    """Both readings of one frame: the switch at 0.1 shows the second, one read once the first."""
    means = np.full((64, 256), 2000.0)
    first = combined_codes(device, hdr_plan(readout, 256, 64), means).astype(float)
    second = combined_codes(device, hdr_plan(replace(readout, switch_at=0.1), 256, 64), means).astype(float)
    if not shared:
        return accept({"independent": correlation_p(first, second)})
    covariance = np.cov(first.ravel(), second.ravel())
    expected = 1.28**2 * 2000.0 / np.sqrt((1.28**2 * 2000.0 + 4.1) * (256 * (0.08**2 * 2000.0 + 1.3**2 + 1 / 12)))
    found = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    spread = (np.arctanh(found) - np.arctanh(expected)) * np.sqrt(first.size)  # Fisher's transformation
    accept({"shared": 2.0 * float(stats.norm.sf(abs(spread)))})
    assert expected > 0.9


def test_seeds_of_later_readings_are_those_of_no_frame_nearby():
    seeds = [reading_seeds(Seeds(5, frame), place) for frame in range(100) for place in range(4)]
    assert len({one.frame for one in seeds}) == 400 and {one.body for one in seeds} == {5}
    assert reading_seeds(Seeds(5, 7), 0) == Seeds(5, 7)


@pytest.mark.parametrize("readout", [DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES], ids=["gains", "exposures", "photodiodes"])
def test_overfull_wells_of_the_last_reading_are_clipped_at_white(device, readout):
    """Half of the noise of their read-out lies above white, which no code does; nor does the noise-free signal."""
    level_e, columns = np.array([2.0e4, 3.9e4, 4.2e4, 1e6]), 30000
    capacity_e = 40005.9 if readout is DUAL_GAIN else 2505.7  # of the last reading a fraction of a code above its white level
    sensor = hdr_plan(readout, columns, len(level_e), stages=SHOT_NOISE | {"full_well": FullWell(capacity_e)})
    means = np.repeat(level_e[:, None], columns, axis=1)
    lights = [device.upload(means.astype(np.float32))] * len(sensor.exposures)
    clean = read_noise_free_combined(device, sensor, lights)
    assert clean.max() == sensor.white_level_dn()
    shares = sensor.spec.exposure_shares
    variance = combined_variance(sensor, [share * means[:, :1].astype(np.float32) for share in shares])[:, 0]
    codes = combined_codes(device, sensor, means).astype(float)
    assert (codes[-1] == sensor.white_level_dn()).mean() > 0.4
    found = zip(level_e, codes, variance, strict=True)
    accept({level: variance_p(row, truth, float(stats.kurtosis(row))) for level, row, truth in found})


def test_crosstalk_of_charge_comes_before_all_readings(device):
    means = np.zeros((33, 33))
    means[15, 15] = 30000.0
    settings = {"crosstalk": Crosstalk(electrical=0.05), "stages": {}}
    sensor = hdr_plan(DUAL_GAIN, 33, 33, **settings)
    clean = read_noise_free_combined(device, sensor, [device.upload(means.astype(np.float32))])
    assert clean[15, 15] == pytest.approx(64.0 + 1.28 * 0.8 * 30000.0, rel=1e-6)
    assert clean[15, 16] == pytest.approx(64.0 + 1.28 * 0.05 * 30000.0, rel=1e-6)
    codes = combined_codes(device, sensor, means)
    assert abs(float(codes[15, 15]) - clean[15, 15]) < 16 * 7


def test_parts_of_a_frame_are_those_of_the_whole(device):
    """A window reads the codes that the whole sensor has there, also from an odd row on."""
    means = np.random.default_rng(2).uniform(0.0, 9000.0, (40, 48))
    whole = combined_codes(device, hdr_plan(DUAL_GAIN, 48, 40), means)
    part = combined_codes(device, hdr_plan(DUAL_GAIN, 48, 40, window=Window(5, 7, 32, 30)), means[7:37, 5:37])
    np.testing.assert_array_equal(part, whole[7:37, 5:37])


def test_charge_that_is_binned_is_summed_before_all_readings(device):
    """Four photosites of 2000 e- fill the first reading: the second one gives 8000 e-, with the variance of their sum."""
    sensor = hdr_plan(DUAL_GAIN, 128, 128, binning=Binning(2))
    means = np.full((128, 128), 2000.0)
    clean = read_noise_free_combined(device, sensor, [device.upload(means.astype(np.float32))])
    np.testing.assert_allclose(clean, 64.0 + 1.28 * 8000.0, rtol=1e-6)
    truth = combined_variance(sensor, [np.full((1, 1), 8000.0, np.float32)], 4)[0, 0]
    assert truth == pytest.approx(1.28**2 * 8000.0 + 256.0 * (1.3**2 + 1 / 12), rel=2e-3)
    codes = combined_codes(device, sensor, means).astype(np.float64)
    accept({"mean": mean_p(codes, clean[0, 0], truth), "variance": variance_p(codes, truth)})
