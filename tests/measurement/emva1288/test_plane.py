"""EMVA 1288 of NumPy sensors in float64 whose every number is known."""

import math

import numpy as np
import pytest
from helpers.numpy_sensor import NumpySensor
from helpers.randomness import accept
from scipy import stats

from simulator.errors import PhotositeError
from simulator.measurement.emva1288.plane import LightStep, measure_plane
from simulator.measurement.statistics.dark_current import fit_slope_over_time
from simulator.measurement.statistics.linearity import linearity, responsivity
from simulator.measurement.statistics.photon_transfer import dark_noise
from simulator.measurement.statistics.spatial_variance import stack_of
from simulator.measurement.statistics.temporal_noise import pair_noise

EFFICIENCY = 0.5
SHARES = np.concatenate([np.linspace(0.04, 0.92, 12), np.linspace(0.94, 1.06, 7)])


def measured(sensor, saturation_e, efficiency=EFFICIENCY, shares=SHARES):
    steps = [LightStep(e / efficiency, pair_noise(*sensor.frames(e, 2))) for e in shares * saturation_e]
    dark_frames, light_frames = sensor.frames(0.0, 16), sensor.frames(0.5 * saturation_e, 16)
    dark = dark_noise([pair_noise(*dark_frames[i : i + 2]) for i in range(0, 16, 2)])
    return measure_plane(steps, dark, stack_of(dark_frames), stack_of(light_frames))


@pytest.fixture(scope="module")
def plane():
    sensor = NumpySensor(0.25, 5.0, 64.0, 12, dsnu_e=(1.0, 1.5, 3.0), prnu=(0.002, 0.003, 0.01), shape=(240, 320))
    return sensor, measured(sensor, 16000.0)


def z_p(interval, truth):
    return float(2 * stats.norm.sf(abs(interval.value - truth) / interval.standard_error))


def test_gain_efficiency_and_read_noise_lie_in_their_intervals(plane):
    _, found = plane
    checks = {"K": (found.gain, 0.25), "eta": (found.quantum_efficiency, 0.5), "sigma_d": (found.read_noise, 5.0)}
    accept({name: z_p(interval, truth) for name, (interval, truth) in checks.items()})
    assert found.responsivity_dn == pytest.approx(0.125, rel=2e-3)


def test_patterns_are_those_of_the_sensor_split_in_rows_columns_and_photosites(plane):
    """The patterns of this very sensor, not of its population: what a perfect measurement would give."""
    sensor, found = plane
    for pattern, truth, unit in ((found.dsnu, sensor.dark_pattern_e, 1.0), (found.prnu, sensor.light_pattern, 1.0)):
        rest = truth - truth.mean(axis=1, keepdims=True) - truth.mean(axis=0) + truth.mean()
        assert pattern.pixel == pytest.approx(rest.std() * unit, abs=5 * pattern.error)
        for part, axis in ((pattern.row, 1), (pattern.column, 0)):
            assert part == pytest.approx(truth.mean(axis=axis).std(), rel=0.05)
        assert pattern.total == pytest.approx(math.hypot(pattern.row, pattern.column, pattern.pixel), rel=1e-9)


def test_saturation_snr_and_dynamic_range(plane):
    _, found = plane
    # The ADC ends at (4095 - 64) / 0.25 electrons; four standard deviations below, PRNU of 1 % among them, nothing clips yet.
    assert 16128 * (1 - 4 * math.hypot(0.01, 1 / 127)) < found.saturation_e < 16128
    assert found.snr_max == math.sqrt(found.saturation_e)
    dark_e = math.sqrt(25.0 + 1 / 12 / 0.25**2)
    assert found.dynamic_range == pytest.approx(found.saturation_e / (dark_e + 0.5), rel=0.01)
    assert found.threshold_photons == pytest.approx((dark_e + 0.5) / EFFICIENCY, rel=0.01)
    assert found.snr(np.array([20000.0]))[0] == pytest.approx(10000 / math.sqrt(10000 + dark_e**2), rel=0.005)
    pattern = 1 + 2.25 + 9 + (0.002**2 + 0.003**2 + 0.01**2) * 1e8
    assert found.snr(np.array([20000.0]), True)[0] == pytest.approx(1e4 / math.sqrt(1e4 + dark_e**2 + pattern), rel=0.02)


def test_a_linear_sensor_has_no_linearity_error(plane):
    _, found = plane
    assert found.linearity.photons.min() >= 0.04 * 32000 and found.linearity.photons.max() <= 0.95 * 32256
    assert max(-found.linearity.least, found.linearity.greatest) < 4 * found.linearity_error < 0.0005


def test_row_noise_counts_once_a_row_in_the_linearity_error():
    """sigma^2 = (row^2 + pixel^2 / columns) / (2 rows) of a pair's mean, over the signal of the dimmest step."""
    found = measured(NumpySensor(row_noise_e=100.0, shape=(120, 160)), 16000.0)
    dimmest_e = found.linearity.photons.min() * EFFICIENCY
    expected = math.sqrt((100.0**2 + (25.0 + dimmest_e) / 160) / 240) / dimmest_e
    assert found.linearity_error == pytest.approx(expected, rel=0.3)  # the variance of 120 rows, of one step
    assert max(-found.linearity.least, found.linearity.greatest) < 4 * found.linearity_error


def test_a_bent_response_is_seen():
    photons = np.linspace(100.0, 10000.0, 60)
    bent = photons * (1.0 - 1e-6 * photons)
    found = linearity(photons, bent, bent[-1])
    inside = (bent >= 0.05 * bent[-1]) & (bent <= 0.95 * bent[-1])
    design = np.stack([1 / bent[inside], photons[inside] / bent[inside]])
    a, b = np.linalg.solve(design @ design.T, design.sum(axis=1))  # normal equations of the relative fit
    expected = bent[inside] / (a + b * photons[inside]) - 1
    np.testing.assert_allclose(found.deviation, expected, atol=1e-12)
    assert found.greatest - found.least > 1e-3
    assert responsivity(photons, 3.0 * photons) == pytest.approx(3.0)


def test_row_noise_is_temporal_and_leaves_only_its_share_in_the_stack():
    sensor = NumpySensor(0.5, 5.0, 200.0, 14, row_noise_e=5.0, shape=(240, 320))
    found = measured(sensor, 32000.0)
    assert found.read_noise.value == pytest.approx(math.sqrt(50.0), rel=0.05)
    # R4.0 takes off 1/L of the mean temporal variance from the photosites, but rows keep 5 e- / sqrt(16).
    assert found.dsnu.row == pytest.approx(5.0 / 4.0, rel=0.25)


def test_steps_that_never_saturate_are_refused():
    with pytest.raises(PhotositeError, match="beyond saturation"):
        measured(NumpySensor(shape=(40, 50)), 16000.0, shares=np.linspace(0.05, 0.7, 12))
    with pytest.raises(PhotositeError, match="fewer than three steps"):
        linearity(np.array([1.0, 2.0]), np.array([1.0, 2.0]), 100.0)


def test_dark_current_is_the_slope_over_time():
    times = np.array([0.0, 1.0, 2.0, 5.0, 10.0])
    sensor = NumpySensor(2.0, 3.0, 100.0, 14, shape=(200, 200))
    means = [np.mean([frame.mean() for frame in sensor.frames(12.5 * time, 2)]) for time in times]
    slope, start = fit_slope_over_time(times, np.array(means) / 2.0)
    assert slope.covers(12.5) and start.covers(50.0)
