"""Cores of kernels in smooth scenes show what kernels show that reach farther."""

import numpy as np
import pytest

from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.rotated_kernels import SAMPLES
from simulator.optics.psf.smooth_cores import ShownKernel, core_matrix, pixel_light
from simulator.optics.psf.visibility import Visibility

SMOOTH = Visibility(1e-3, 0.45)


@pytest.mark.parametrize(("side_px", "apart_px"), [(1.0, 0.0), (0.7, 0.0), (1.0, 0.6)])
def test_light_of_a_pixel_is_the_mean_of_its_tent_over_open_areas(side_px, apart_px):
    away, inside = np.linspace(-4.0, 4.0, 33), (np.arange(2000) + 0.5) / 2000 - 0.5
    places = away[:, None] + side_px * inside[None, :]
    tents = [np.maximum(1.0 - np.abs(places + shift) / 2.2, 0.0) / 2.2 for shift in (-0.5 * apart_px, 0.5 * apart_px)]
    np.testing.assert_allclose(pixel_light(away, 2.2, side_px, apart_px), np.mean(tents, axis=(0, 2)), atol=1e-6)


def test_a_core_keeps_light_and_what_lies_within_it():
    fold = core_matrix(41, 6, 2.2)
    np.testing.assert_allclose(fold.sum(axis=0), 1.0, atol=1e-9)
    np.testing.assert_allclose(fold[:, 14:27], np.eye(13), atol=1e-9)
    np.testing.assert_allclose(core_matrix(41, 20, 2.2), np.eye(41), atol=1e-9)


def point_beside(place_px: float, count: int = 21) -> np.ndarray:
    """Light of a point at a place, on the samples of `count` photosites."""
    samples = np.zeros((SAMPLES * count, SAMPLES * count))
    samples[round(SAMPLES * (count // 2 + place_px)) + SAMPLES // 2, SAMPLES * count // 2] = 1.0
    return samples


def ringing_weights(place_px: float, count: int) -> np.ndarray:
    """Weights of photosites of a point at a place, of frequencies up to half a cycle: a sinc, which rings."""
    across = np.zeros(count)
    across[count // 2] = 1.0
    return np.outer(np.sinc(np.arange(count) - count // 2 - place_px) * np.hanning(count + 2)[1:-1], across)


def test_a_small_core_is_as_right_as_a_kernel_that_rings():
    """A point a third of a photosite beside the middle: its sinc shows no better where its pixels lie than 9 x 9 weights do."""
    shown = ShownKernel(point_beside(1.0 / 3.0), Sampling(), 5.0, SMOOTH)
    whole = ringing_weights(1.0 / 3.0, 61)
    fold = core_matrix(61, 4, shown.width_px)
    small, cut = fold @ whole @ fold.T, whole[26:35, 26:35]
    exact, found, plain = (shown.error(one) for one in (whole, small, cut))
    assert found < 1.05 * exact < 0.9 * plain
    assert np.abs(small).sum() < 0.9 * np.abs(whole).sum()


def test_a_point_in_the_middle_of_a_photosite_is_exact():
    shown, one = ShownKernel(point_beside(0.0), Sampling(), 5.0, SMOOTH), np.zeros((3, 3))
    one[1, 1] = 1.0
    assert shown.error(one) < 1e-9
    assert shown.error(np.roll(one, 1, axis=0)) > 0.1
    assert ShownKernel(point_beside(0.0), Sampling(fill_factor=0.4), 5.0, SMOOTH).error(one) > 1e-3
