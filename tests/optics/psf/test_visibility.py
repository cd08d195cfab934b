"""How a difference of kernels shows: fine scenes as `visible_error` has it, coarse ones by what their light adds up to."""

import math

import numpy as np
import pytest
from scipy.ndimage import zoom

from simulator.optics.psf.kernel_split import visible_error
from simulator.optics.psf.visibility import Visibility


@pytest.mark.parametrize("seed", range(3))
def test_a_fine_scene_shows_what_visible_error_says(seed):
    rest = np.random.default_rng(seed).normal(size=(9, 9))
    assert Visibility(1.0, 2.0, 0.0).error(rest) == pytest.approx(visible_error(rest), rel=1e-12)


def test_a_bright_pixel_shows_the_largest_difference():
    rest = np.diag([0.0, 0.1, -0.3])
    assert Visibility(1.0, 1.0, 50.0).error(rest) == pytest.approx(15.0)


def test_ringing_is_not_seen_in_smooth_light():
    ringing = np.zeros((25, 25))
    ringing[12] = 0.1 * (-1.0) ** np.arange(25) * np.hanning(25)
    fine, coarse = (Visibility(1.0, scale).error(ringing) for scale in (1.0, 0.2))
    assert coarse < 0.1 * fine


def test_a_coarse_texture_shows_no_more_than_predicted():
    """Bilinear light, five photosites to a pixel of its own: a photosite in a thousand exceeds the prediction."""
    rng, scale = np.random.default_rng(1), 0.2
    rest = np.outer(np.hanning(9), np.hanning(9)) * rng.normal(size=(9, 9))
    light = zoom(rng.random((120, 120)), 5, order=1)
    off = np.abs(
        sum(np.roll(light, (y, x), (0, 1)) * rest[y + 4, x + 4] for y in range(-4, 5) for x in range(-4, 5)) - 0.5 * rest.sum()
    )
    assert np.quantile(off, 0.999) < Visibility(1.0, scale, 0.0).error(rest) < 3.0 * np.quantile(off, 0.999)


@pytest.mark.parametrize("dark_e", [2.0, 40.0, 200.0])
def test_an_error_counts_in_the_noise_of_the_gap_between_two_bars(dark_e):
    """Dark gaps of any width between bars of 2,000 electrons, in the noise of the light that the kernel brings there."""
    rng, reach, electrons = np.random.default_rng(2), 6, 2000.0
    kernel = np.outer(np.hanning(13), np.hanning(13))
    kernel /= kernel.sum()
    rest = 1e-3 * rng.normal(size=kernel.shape)
    rest -= rest.mean()
    seen = Visibility(1.0, electrons=electrons, dark_e=dark_e, read_noise_e=1.5)
    worst = 0.0
    for axis in (0, 1):
        for width in range(1, 2 * reach):
            bars = np.full(64, electrons)
            bars[32 : 32 + width] = dark_e
            wrong, light = (np.convolve(bars, one.sum(axis=axis), mode="same")[32 : 32 + width] for one in (rest, kernel))
            worst = max(worst, float((np.abs(wrong) / np.sqrt(light + 1.5**2)).max()))
    found = seen.own_error(rest, kernel) * electrons / math.sqrt(electrons + 1.5**2)
    assert worst <= found < 3.0 * worst
