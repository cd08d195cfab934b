"""K, read noise and saturation from pairs of frames of a NumPy sensor whose numbers are known."""

import math

import numpy as np
import pytest
from helpers.numpy_sensor import NumpySensor
from helpers.randomness import accept
from scipy import stats

from simulator.errors import PhotositeError
from simulator.measurement.statistics.photon_transfer import (
    DarkNoise,
    TransferPoint,
    dark_noise,
    dynamic_range,
    gain,
    gain_without_dark,
    points_below_saturation,
    read_noise_e,
    saturation_index,
    transfer_point,
)
from simulator.measurement.statistics.temporal_noise import pair_noise

LEVELS_E = (500, 2000, 5000, 8000)


def measure(sensor, levels_e=LEVELS_E, row_noise=True):
    dark = dark_noise([pair_noise(*sensor.frames(0.0, 2))], row_noise)
    pairs = [pair_noise(*sensor.frames(level, 2)) for level in levels_e]
    return [transfer_point(pair, dark.mean_dn, row_noise) for pair in pairs], dark


def unbiased(intervals, truth):
    """p-values that estimates scatter about the truth as widely as their standard errors say."""
    z = np.array([(one.value - truth) / one.standard_error for one in intervals])
    chi2 = float(np.sum(z**2))
    wide = 2 * min(stats.chi2.cdf(chi2, z.size), stats.chi2.sf(chi2, z.size))
    return {"mean": float(2 * stats.norm.sf(abs(z.mean()) * math.sqrt(z.size))), "width": wide}


def test_a_line_without_noise_is_found_exactly():
    points = [TransferPoint(x, 4.0 + 0.25 * x, 1.0) for x in (10.0, 100.0, 3000.0)]
    assert gain(points, DarkNoise(64.0, 4.0, 0.1)).value == pytest.approx(0.25, rel=1e-12)
    assert gain_without_dark(points).value == pytest.approx(0.25, rel=1e-12)


@pytest.mark.parametrize("row_noise", [True, False])
def test_k_and_its_interval_are_right_with_and_without_row_noise(row_noise):
    p_values = {}
    for k, read_e, row_e in ((0.25, 5.0, 0.0), (4.0, 2.0, 1.0), (0.25, 5.0, 10.0)):
        sensor = NumpySensor(k, read_e, 4096.0, 16, row_e, shape=(60, 80), prnu=(0.0, 0.0, 0.01), dsnu_e=(0.0, 0.0, 3.0))
        found = [gain(*measure(sensor, row_noise=row_noise)) for _ in range(60)]
        p_values |= {(k, row_e, name): p for name, p in unbiased(found, k).items()}
    accept(p_values)


def test_without_row_noise_the_read_noise_is_the_photosites_own():
    sensor = NumpySensor(2.0, 5.0, 500.0, 14, row_noise_e=5.0, shape=(400, 300))
    pairs = [pair_noise(*sensor.frames(0.0, 2)) for _ in range(20)]
    own, all_of_it = dark_noise(pairs, row_noise=False), dark_noise(pairs)
    p_values = {}
    for name, dark, truth in (("own", own, 25.0), ("all", all_of_it, 50.0)):
        z = (dark.variance_dn2 - 1 / 12 - 4.0 * truth) / dark.error_dn2
        p_values[name] = float(2 * stats.norm.sf(abs(z)))
    accept(p_values)
    assert read_noise_e(own, 2.0) == math.sqrt(own.variance_dn2 - 1 / 12) / 2.0


def test_rounding_alone_is_no_read_noise():
    assert read_noise_e(DarkNoise(64.0, 0.07, 0.001), 0.1) == 0.0


def test_a_camera_without_pedestal_is_measured_without_its_clipped_dark():
    """As on a Nikon D3: black at code 0 cuts the dark in half, which bends a line through the dark point."""
    sensor = NumpySensor(8.0, 3.0, 0.0, 14, shape=(60, 80), prnu=(0.0, 0.0, 0.01))
    levels = (40, 200, 600, 1200)
    found, wrong = [], []
    for _ in range(60):
        pairs = [pair_noise(*sensor.frames(level, 2)) for level in levels]
        found.append(gain_without_dark([transfer_point(pair, 0.0) for pair in pairs]))
        points, dark = measure(sensor, levels)
        wrong.append(gain(points, dark))
    accept(unbiased(found, 8.0))
    assert unbiased(wrong, 8.0)["mean"] < 1e-6


def test_saturation_is_where_the_variance_turns():
    sensor = NumpySensor(0.25, 5.0, 64.0, 12, full_well_e=12000.0)
    levels = np.arange(1000, 15000, 500)
    points, dark = measure(sensor, levels)
    assert levels[saturation_index(points)] in (11500, 12000)
    saturation_dn = points[saturation_index(points)].signal_dn
    kept = points_below_saturation(points, saturation_dn)
    assert kept and max(point.signal_dn for point in kept) <= 0.7 * saturation_dn
    accept(unbiased([gain(kept, dark)], 0.25))


def test_dynamic_range_by_hand():
    # sqrt(4) / 0.5 = 4 electrons of dark noise, and half an electron more where SNR is 1
    assert dynamic_range(9000.0, DarkNoise(64.0, 4.0, 0.0), 0.5) == 2000.0


def test_frames_that_tell_no_gain_are_refused():
    with pytest.raises(PhotositeError, match="no pair of dark frames"):
        dark_noise([])
    with pytest.raises(PhotositeError, match="no flat pair is brighter"):
        gain([TransferPoint(-1.0, 4.0, 0.1)], DarkNoise(64.0, 4.0, 0.1))
    with pytest.raises(PhotositeError, match="two or more levels"):
        gain_without_dark([TransferPoint(5.0, 4.0, 0.1)] * 2)
