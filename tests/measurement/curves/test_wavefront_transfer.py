"""Transfer of pupils with aberrations against Fourier transforms of the pupil, and closed forms."""

import numpy as np
import pytest
from helpers.green_frames import GREEN_UM
from helpers.wave_optics import pupil_transfer

from simulator.measurement.curves.wavefront_transfer import wavefront_transfer

SIDE, RADIUS = 640, 150  # of the grid on which the pupil is transformed


def transformed(error_um, wavelength_um):
    """|autocorrelation| of the pupil along x by transforms, at whole numbers of samples, over the pupil's area."""
    axis = (np.arange(SIDE) - SIDE // 2) / RADIUS
    x, y = np.meshgrid(axis, axis)
    fine = (np.arange(8) + 0.5) / 8 - 0.5  # share of each sample inside the rim
    inside = sum((x + dx / RADIUS) ** 2 + (y + dy / RADIUS) ** 2 <= 1.0 for dx in fine for dy in fine) / 64
    pupil = inside * np.exp(2j * np.pi / wavelength_um * error_um(x, y))
    found = np.abs(np.fft.ifft2(np.abs(np.fft.fft2(pupil)) ** 2))[0, : 2 * RADIUS]
    return np.arange(2 * RADIUS) / RADIUS, found / inside.sum()


@pytest.mark.parametrize(
    "error_um",
    [
        lambda x, y: 0.3 * (x**2 + y**2),
        lambda x, y: 0.8 * (x**2 + y**2) ** 2 - 0.7 * (x**2 + y**2),
        lambda x, y: 0.5 * (x**2 + y**2) * x + 0.4 * x**2,
        lambda x, y: 6.0 * (x**2 + y**2) ** 2,
    ],
    ids=["defocus", "spherical", "coma and astigmatism", "eleven waves"],
)
def test_it_is_the_autocorrelation_of_the_pupil(error_um):
    shifts, expected = transformed(error_um, GREEN_UM)
    chosen = slice(15, None, 15)
    np.testing.assert_allclose(wavefront_transfer(error_um, GREEN_UM, shifts[chosen]), expected[chosen], atol=5e-4)


def test_without_error_it_is_that_of_a_round_pupil_and_a_tilt_changes_nothing():
    frequency = np.linspace(0.0, 0.6, 13)
    wanted = [pupil_transfer(one, 4.0) for one in frequency]
    for error_um in (lambda x, y: 0.0 * x, lambda x, y: 3.0 * x + 2.0 * y):
        found = wavefront_transfer(error_um, GREEN_UM, 2.0 * GREEN_UM * 4.0 * frequency)
        assert found == pytest.approx(wanted, abs=1e-6)


def test_modulation_across_a_defocus_of_one_axis_sees_none_of_it():
    shifts = np.linspace(0.0, 2.0, 9)
    plain = wavefront_transfer(lambda x, y: 0.0 * x, GREEN_UM, shifts)
    assert wavefront_transfer(lambda x, y: 0.5 * y**2, GREEN_UM, shifts) == pytest.approx(plain, abs=1e-6)
    assert wavefront_transfer(lambda x, y: 0.5 * x**2, GREEN_UM, shifts)[4] < 0.3 * plain[4]
