"""Dead leaves have the power spectrum of their closed form, which falls with the square of the frequency."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import ndimage, stats

from simulator.scene.dead_leaves import dead_leaves

WIDTH, HEIGHT, SMALLEST, LARGEST, SEEDS = 192, 128, 2.0, 32.0, 16
BANDS = np.geomspace(0.02, 0.25, 8)  # cycles/px
FINE = 4  # samples of the closed form per pixel


def covariance(distance: np.ndarray) -> np.ndarray:
    """1/12 g(d) / (2 g(0) - g(d)), g(d) the mean area of a leaf and itself moved by d (Gousseau and Roueff 2007)."""
    radii = np.geomspace(SMALLEST, LARGEST, 1000)
    weights = np.gradient(radii) * radii**-3.0
    known = np.linspace(0.0, 2.0 * LARGEST, 4000)
    t = np.minimum(known[:, None] / (2.0 * radii), 1.0)
    shared = (2.0 * radii**2 * (np.arccos(t) - t * np.sqrt(1.0 - t**2))) @ weights
    return np.interp(distance, known, shared / (2.0 * shared[0] - shared) / 12.0, right=0.0)


def expected_periodogram() -> np.ndarray:
    """Mean of |FFT|^2 / pixels over random pictures: the sum of the covariance over all pairs of pixels, (HEIGHT, WIDTH)."""
    down, across = (np.arange(-FINE * side, FINE * side) / FINE for side in (HEIGHT, WIDTH))
    fine = covariance(np.hypot(down[:, None], across[None, :]))
    for axis in (0, 1):  # means over both pixels of a pair, an even one twice
        box = np.ones(FINE + 1) / FINE
        box[[0, -1]] *= 0.5
        fine = ndimage.convolve1d(ndimage.convolve1d(fine, box, axis, mode="constant"), box, axis, mode="constant")
    pairs = (1.0 - np.abs(down) / HEIGHT)[:, None] * (1.0 - np.abs(across) / WIDTH)[None, :]
    lags = (fine * pairs)[::FINE, ::FINE].reshape(2, HEIGHT, 2, WIDTH).sum(axis=(0, 2))  # lags d and d - side are one
    return np.fft.fft2(lags).real


def by_band(power: np.ndarray) -> np.ndarray:
    """Means of a power spectrum in the bands."""
    frequency = np.hypot(np.fft.fftfreq(HEIGHT)[:, None], np.fft.fftfreq(WIDTH)[None, :])
    number = np.digitize(frequency, BANDS)
    return np.array([power[number == band].mean() for band in range(1, len(BANDS))])


@pytest.fixture(scope="module")
def pictures() -> list[np.ndarray]:
    return [dead_leaves(WIDTH, HEIGHT, SMALLEST, LARGEST, seed) for seed in range(SEEDS)]


@pytest.mark.slow
def test_the_power_spectrum_is_that_of_the_closed_form(pictures):
    """t-test of each band over the seeds."""
    found = np.array([by_band(np.abs(np.fft.fft2(one - 0.5)) ** 2 / one.size) for one in pictures])
    expected = by_band(expected_periodogram())
    error = found.std(axis=0, ddof=1) / np.sqrt(SEEDS)
    t = (found.mean(axis=0) - expected) / error
    accept({band: float(2 * stats.t.sf(abs(value), SEEDS - 1)) for band, value in enumerate(t)})


def test_the_closed_form_falls_with_the_square_of_the_frequency():
    middle = np.sqrt(BANDS[:-1] * BANDS[1:])
    assert np.polyfit(np.log(middle), np.log(by_band(expected_periodogram())), 1)[0] == pytest.approx(-2.0, abs=0.25)


def test_greys_are_evenly_distributed_and_nothing_stays_open(pictures):
    """Means of pictures hold few large leaves, so their scatter over the seeds is the error."""
    means = np.array([one.mean() for one in pictures])
    accept({"mean": float(2 * stats.t.sf(abs(means.mean() - 0.5) / (means.std(ddof=1) / np.sqrt(SEEDS)), SEEDS - 1))})
    assert all(0.0 <= one.min() and one.max() <= 1.0 for one in pictures)


def test_the_seed_decides_the_picture(pictures):
    assert (dead_leaves(WIDTH, HEIGHT, SMALLEST, LARGEST, 3) == pictures[3]).all()
    assert not (pictures[3] == pictures[4]).any(axis=1).all()
