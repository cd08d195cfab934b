"""Diffraction of a pupil: what symmetry and single precision save changes nothing that counts."""

import math

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from simulator.optics.psf.fraunhofer import ROUND, compute_psf, sample_pupil

SINGLE = 1e-6  # of the brightest cell: 2 sqrt(log2 n) roundings of an amplitude, n = 2^18 samples, and as many of the light


def edge_of_samples(depth: np.ndarray) -> np.ndarray:
    """Step at 0 through a sinc in a Kaiser window of three samples, by the trapezoidal rule, float64."""
    steps = np.linspace(-3.0, 3.0, 2401)
    rises = cumulative_trapezoid(np.sinc(steps) * np.kaiser(2401, 4.0), steps, initial=0.0)
    return np.interp(depth, steps, rises / rises[-1])


def exact_pupil(wavefront_um, cell_um: float, size: int) -> tuple[np.ndarray, np.ndarray, float, int]:
    """Amplitude of a round pupil's samples in double precision, their places, their side, and the image's period [cells]."""
    cell = cell_um / (2.0 * 0.55 * 5.6)
    pupil, period = sample_pupil(wavefront_um, 0.55, cell, size, ROUND)
    sample = 1.0 / (period * cell)
    axis = np.arange(-(len(pupil) - 1) / 2, len(pupil) / 2) * sample
    inside = edge_of_samples(ROUND.depth(axis[None, :], axis[:, None]) / sample)
    return inside * np.exp(-2j * math.pi / 0.55 * wavefront_um(axis[None, :], axis[:, None])), axis, sample, period


@pytest.mark.parametrize(("f_number", "wavelength_um", "cell_um", "size"), [(8.0, 0.55, 1.0, 201), (2.8, 0.5, 0.6, 101)])
def test_the_light_beyond_an_image_is_what_the_edge_of_the_pupil_scatters(f_number, wavelength_um, cell_um, size):
    """Rings of J1 fall as lambda N / (pi^3 r^3) on average: 8 sin(45 deg) / (pi^3 a) of lambda N beyond a square, 2 a wide."""
    found = compute_psf(lambda x, y: 0.0 * x, wavelength_um, f_number, cell_um, size)
    beyond = 8.0 * math.sin(0.25 * math.pi) / math.pi**3 * wavelength_um * f_number / (0.5 * size * cell_um)
    assert 1.0 - found.sum() == pytest.approx(beyond, rel=0.05)


@pytest.mark.parametrize("cell_um", [1.5, 8.4])  # one sample per cell, and several
def test_the_light_of_cells_is_that_of_the_sum_over_the_pupil_in_double_precision(cell_um):
    """Against the Fourier sum at the points of a Gauss-Legendre rule in each cell."""

    def wavefront_um(x, y):
        return 0.7 * (x**2 + y**2) * x + 0.3 * x**2 + 0.2 * y

    size, points = 21, 12
    found = compute_psf(wavefront_um, 0.55, 5.6, cell_um, size)
    exact, axis, sample, _ = exact_pupil(wavefront_um, cell_um, size)
    cell = cell_um / (2.0 * 0.55 * 5.6)
    nodes, weights = np.polynomial.legendre.leggauss(points)
    places = cell * (np.arange(-(size // 2), size // 2 + 1)[:, None] + 0.5 * nodes).ravel()
    turns = np.exp(-2j * math.pi * np.outer(places, axis))
    light = np.abs(turns @ exact @ turns.T) ** 2 * cell**2 * sample**2 / math.pi
    rule = np.kron(np.eye(size), 0.5 * weights)
    np.testing.assert_allclose(found, rule @ light @ rule.T * sample**2, rtol=0, atol=SINGLE * found.max())


@pytest.mark.parametrize("tilt_um", [0.0, 0.4])  # an even pupil, and another
@pytest.mark.parametrize("cell_um", [0.8, 1.5, 8.4])  # a few samples per cell, up to as many as detail is left out
def test_light_without_fine_detail_is_that_of_the_whole_image_less_its_high_frequencies(cell_um, tilt_um):
    """Against the Fourier sum at points of the whole period, and what is left of its spectrum, in double precision."""
    kept, size = (0.3, 0.48), 21

    def wavefront_um(x, y):
        return 0.7 * (x**2 + y**2) * x + 0.3 * x**2 + tilt_um * y

    found = compute_psf(wavefront_um, 0.55, 5.6, cell_um, size, kept=kept)
    exact, axis, sample, period = exact_pupil(wavefront_um, cell_um, size)
    cell = cell_um / (2.0 * 0.55 * 5.6)
    per_cell = math.ceil(2 * len(axis) / period)
    turns = np.exp(-2j * math.pi * np.outer(cell * np.arange(per_cell * period) / per_cell, axis))
    light = np.abs(turns @ exact @ turns.T) ** 2 * cell**2 * sample**4 / math.pi
    frequency = np.abs(np.fft.fftfreq(per_cell * period, 1.0 / per_cell))
    share = 0.5 + 0.5 * np.cos(math.pi * np.clip((frequency - kept[0]) / (kept[1] - kept[0]), 0.0, 1.0))
    left = np.fft.ifft2(np.fft.fft2(light) * share[:, None] * share[None, :]).real[::per_cell, ::per_cell]
    middle = np.roll(left, (size // 2, size // 2), axis=(0, 1))[:size, :size]
    np.testing.assert_allclose(found, middle, rtol=0, atol=SINGLE * found.max())


@pytest.mark.parametrize("turn", [0, 1])
@pytest.mark.parametrize("cell_um", [1.5, 8.4])  # one sample per cell, and several
def test_a_pupil_that_is_even_along_one_axis_has_the_image_of_its_whole_sum(turn, cell_um):
    """Coma and astigmatism along the field, against the same with a tilt across it by 1e-12 um, which is not even."""

    def wavefront_um(x, y, tilt_um=0.0):
        x, y = (y, x) if turn else (x, y)
        return 0.7 * (x**2 + y**2) * x + 0.3 * x**2 + tilt_um * y

    even = compute_psf(wavefront_um, 0.55, 5.6, cell_um, 31)
    whole = compute_psf(lambda x, y: wavefront_um(x, y, 1e-12), 0.55, 5.6, cell_um, 31)
    np.testing.assert_allclose(even, whole, rtol=0, atol=SINGLE * whole.max())
    mirror, other = (1, 0) if turn else (0, 1)
    np.testing.assert_allclose(even, np.flip(even, mirror), rtol=0, atol=SINGLE * even.max())
    assert np.abs(even - np.flip(even, other)).max() > 0.1 * even.max()
