"""The motion of a hand has the spectrum and the speed that it states."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.exposure.hand_tremor import LINES, HandTremor

SEEDS = range(200)


def rates_deg_per_s(tremor, times_s):
    return np.degrees(tremor.speeds(times_s).rotation_rad)


def test_the_speed_about_each_axis_is_normal_with_a_third_of_the_power():
    """Over seeds, at instants far apart, since a path is one draw."""
    found = np.array([rates_deg_per_s(HandTremor(3.0, seed=seed), np.array([0.0, 1e4])) for seed in SEEDS])
    checks = {}
    for axis in range(3):
        sample = found[:, :, axis].ravel()
        checks |= {
            (axis, "mean"): mean_p(sample, 0.0, 3.0),
            (axis, "variance"): variance_p(sample, 3.0),
            (axis, "normal"): stats.kstest(sample / np.sqrt(3.0), "norm").pvalue,
            (axis, "next axis"): correlation_p(sample, found[:, :, (axis + 1) % 3].ravel()),
        }
    accept(checks)


@pytest.mark.parametrize("slope", [0.0, -1.0, 2.0])
def test_the_power_lies_in_the_band_as_stated(slope):
    """Energy by frequency of 64 s; in an eighth of the band lie 16 sinusoids, whose energy is chi-square with 32 degrees."""
    count, seconds, bands = 2048, 64.0, 8
    times_s = np.arange(count) * seconds / count
    window = np.hanning(count)
    hertz = np.fft.rfftfreq(count, seconds / count)
    rates = np.concatenate([rates_deg_per_s(HandTremor(1.0, 2.0, 12.0, slope, seed=seed), times_s).T for seed in range(4)])
    power = np.abs(np.fft.rfft(rates * window, axis=1)) ** 2 / (0.5 * count * np.sum(window**2))
    ends = np.linspace(2.0, 12.0, bands + 1)
    shares = np.diff(np.log(ends) if slope == -1.0 else ends ** (slope + 1))
    shares /= shares.sum() * 3.0
    checks = {}
    for band, share in enumerate(shares):
        degrees = 2 * LINES // bands * len(rates)
        energy = power[:, (hertz >= ends[band]) & (hertz < ends[band + 1])].sum()
        chi2 = energy / (share * len(rates)) * degrees
        # Within a band of unequal powers the energy has a greater variance: the bound of equal powers is the stricter one.
        checks[band] = 2.0 * min(stats.chi2.cdf(chi2, degrees), stats.chi2.sf(chi2, degrees))
    accept(checks)
    outside = power[:, (hertz < 1.9) | (hertz > 12.1)].sum() / power.sum()
    assert outside < 1e-4  # the window's side lobes


def test_poses_are_the_integral_of_the_speeds_from_rest():
    tremor = HandTremor(2.0, location_rms_m_per_s=0.01, seed=7)
    times_s = np.linspace(0.0, 2.0, 4001)
    poses, speeds = tremor.poses(times_s), tremor.speeds(times_s)
    for kind in ("rotation_rad", "location_m"):
        path, speed = getattr(poses, kind), getattr(speeds, kind)
        assert not path[0].any() and path[-1].any()
        steps = 0.0005 / 6 * (speed[:-2:2] + 4 * speed[1::2] + speed[2::2]) * 2  # Simpson's rule
        np.testing.assert_allclose(path[2::2], np.cumsum(steps, axis=0), atol=1e-9)


def test_the_lens_moves_as_fast_as_stated():
    found = np.array([HandTremor(0.0, location_rms_m_per_s=0.3, seed=seed).speeds(np.zeros(1)).location_m[0] for seed in SEEDS])
    accept({axis: variance_p(found[:, axis], 0.03) for axis in range(3)})


def test_a_seed_is_a_path():
    times_s = np.linspace(0, 3600, 7)
    one, same, other = (HandTremor(1.0, seed=seed).poses(times_s).rotation_rad for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 1e-5
    np.testing.assert_array_equal(HandTremor(1.0, seed=1).poses(times_s[3:4]).rotation_rad[0], one[3])


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"rms_deg_per_s": -1.0}, "motion.camera.rms = -1 deg/s: give 0 or more"),
        ({"lowest_hz": 0.0}, "motion.camera.lowest = 0 Hz: give a frequency above 0 Hz"),
        ({"highest_hz": 1.0}, "motion.camera.highest = 1 Hz: give one above the lowest, 2 Hz"),
        ({"slope": 11.0}, "motion.camera.slope = 11.0"),
        ({"seed": -1}, "motion.camera.seed = -1"),
        ({"location_rms_m_per_s": np.inf}, "motion.camera.location_rms = inf m/s"),
    ],
)
def test_what_is_no_spectrum_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        HandTremor(**({"rms_deg_per_s": 1.0} | settings))
