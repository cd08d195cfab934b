"""EMVA 1288's high pass: slow changes of light leave it, patterns of photosites, rows and columns stay with their size."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import signal, stats

from simulator.errors import PhotositeError
from simulator.measurement.statistics.high_pass import MARGIN_PX, high_pass, kept_shares
from simulator.measurement.statistics.spatial_variance import Stack, spatial_variance

KERNEL = signal.convolve2d(
    signal.convolve2d(np.full((7, 7), 1 / 49), np.full((11, 11), 1 / 121)), np.outer([1, 2, 1], [1, 2, 1]) / 16
)


def test_it_is_the_frame_less_the_standards_three_filters():
    frame = np.random.default_rng(1).normal(100.0, 5.0, (60, 80))
    expected = (frame - signal.convolve2d(frame, KERNEL, mode="same"))[9:-9, 9:-9] + frame.mean()
    found = high_pass(Stack(frame, 1.0, 16))
    assert MARGIN_PX == 9 and found.frames == 16 and found.variance_dn2 == 1.0
    np.testing.assert_allclose(found.mean_dn, expected, rtol=1e-12)


def test_a_plane_of_light_is_gone():
    y, x = np.mgrid[:50, :70]
    np.testing.assert_allclose(np.ptp(high_pass(Stack(3.0 * x - 2.0 * y, 0.0, 2)).mean_dn), 0.0, atol=1e-9)


def test_the_shares_are_the_energies_of_the_filter():
    delta = np.zeros_like(KERNEL)
    delta[9, 9] = 1.0
    across = KERNEL.sum(axis=1)
    expected = np.sum((delta - KERNEL) ** 2), np.sum((delta[9] - across) ** 2)
    np.testing.assert_allclose(kept_shares(), expected, rtol=1e-12)
    assert kept_shares() == (
        pytest.approx(0.9885, abs=1e-4),
        pytest.approx(0.8891, abs=1e-4),
    )  # as docs/calibration.md has them


def test_patterns_keep_their_size_in_uneven_light():
    """Photosites, rows and columns of 1, 0.4 and 0.6 DN and a temporal variance of 2 DN^2 in 16 frames, 240 DN of shading."""
    rng, shape = np.random.default_rng(2), (800, 900)
    y, x = np.mgrid[-1 : 1 : shape[0] * 1j, -1 : 1 : shape[1] * 1j]
    mean = 1000.0 - 120.0 * (x**2 + y**2) + rng.normal(0.0, np.sqrt(1.0 + 2.0 / 16), shape)
    mean += rng.normal(0.0, 0.4, (shape[0], 1)) + rng.normal(0.0, 0.6, shape[1])
    assert spatial_variance(Stack(mean, 2.0, 16)).total_dn2 > 1000.0
    found = spatial_variance(high_pass(Stack(mean, 2.0, 16)))
    checks = {}
    for name, truth, noise, count in (
        ("pixel_dn2", 1.0, 2.0 / 16, 800 * 900),
        ("row_dn2", 0.16, 1.125 / 900, 800),
        ("column_dn2", 0.36, 1.125 / 800, 900),
    ):
        error = (truth + noise) * np.sqrt(2.0 / count)
        checks[name] = float(2 * stats.norm.sf(abs(getattr(found, name) - truth) / error))
    accept(checks)


def test_a_small_plane_is_one_message():
    with pytest.raises(PhotositeError, match="plane = 20 x 90 photosites: the high pass needs 21"):
        high_pass(Stack(np.ones((20, 90)), 1.0, 2))
