"""Closed forms and integrals of diffraction, in float64."""

import math

import numpy as np
from scipy.special import j0

from helpers.green_frames import GREEN_UM

NODES, WEIGHTS = np.polynomial.legendre.leggauss(120)


def pupil_transfer(frequency_per_um: float, f_number: float) -> float:
    """Transfer of a round pupil without aberrations (Goodman, Introduction to Fourier Optics, 6.3)."""
    u = min(frequency_per_um * GREEN_UM * f_number, 1.0)
    return 2.0 / math.pi * (math.acos(u) - u * math.sqrt(1.0 - u * u))


def spot(constant: float, x: np.ndarray) -> np.ndarray:
    """Intensity of a far point at x sqrt(lambda v) behind a hole of constant sqrt(lambda v), by the Fresnel integral."""
    rho, weights = 0.25 * constant * (NODES + 1.0), 0.25 * constant * WEIGHTS
    wave = np.exp(1j * math.pi * rho**2) * rho * weights
    return np.abs(2 * math.pi * (j0(2 * math.pi * np.outer(x, rho)) @ wave)) ** 2


def half_light_radius(constant: float) -> float:
    x = np.linspace(0.0, 2.0, 4001)
    density = spot(constant, x) * 2 * math.pi * x
    inside = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(x))])
    return float(np.interp(0.5 * math.pi * constant**2 / 4, inside, x))  # all of the light that enters: Parseval
