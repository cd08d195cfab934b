"""Colour correction for one light: camera colours to XYZ by root polynomials, with less error than a matrix.

A matrix leaves an error where the camera's curves are no linear combination of the eye's. Root polynomials of second degree add
the terms sqrt(rg), sqrt(gb), sqrt(rb), which scale with the exposure as the linear terms do (Finlayson, Mackiewicz and Hurlbert
2015, "Color Correction Using Root-Polynomial Regression", IEEE Transactions on Image Processing 24).
"""

from dataclasses import dataclass

import numpy as np

from simulator.color.camera_matrices import camera_response, chart_reflectances
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, tristimulus


@dataclass(frozen=True)
class ColorCorrection:
    """Camera RGB to XYZ under one light.

    neutral: (3,) camera RGB of white in this light, largest = 1. white_xyz: (3,) of the light, Y = 1.
    terms: (6, 3) from r, g, b, sqrt(rg), sqrt(gb), sqrt(rb) of white-balanced RGB to X, Y, Z over those of white; columns add
        up to 1, so that greys stay grey.
    """

    neutral: np.ndarray
    white_xyz: np.ndarray
    terms: np.ndarray

    def xyz(self, camera_rgb: np.ndarray) -> np.ndarray:
        """XYZ (..., 3) of camera RGB (..., 3), linear, above black, not white-balanced; the same scale for every pixel.

        A product below 0, as noise below black makes it, counts as 0.
        """
        return _root_terms(np.asarray(camera_rgb, dtype=np.float64) / self.neutral) @ self.terms * self.white_xyz


def fit_color_correction(wavelengths_nm: np.ndarray, quantum_efficiency: np.ndarray, light: str) -> ColorCorrection:
    """Correction of a camera under an illuminant such as "A", "D50" or "3200 K".

    Least squares in XYZ over that of white, over the 24 reflectances that the colour matrix is fitted to, white kept exactly.
    quantum_efficiency: (wavelengths, 3) electrons per photon, R, G, B; linear between, zero outside.
    Raises PhotositeError for an unknown illuminant.
    """
    power = illuminant(light)
    lit = chart_reflectances(WAVELENGTHS_NM) * power
    white = camera_response(power, WAVELENGTHS_NM, wavelengths_nm, quantum_efficiency)
    terms = _root_terms(camera_response(lit, WAVELENGTHS_NM, wavelengths_nm, quantum_efficiency) / white)
    xyz, white_xyz = tristimulus(lit), tristimulus(power)
    free, *_ = np.linalg.lstsq(terms[:, :5] - terms[:, 5:], xyz / white_xyz - terms[:, 5:], rcond=None)
    return ColorCorrection(white / white.max(), white_xyz / white_xyz[1], np.vstack([free, 1.0 - free.sum(axis=0)]))


def _root_terms(balanced: np.ndarray) -> np.ndarray:
    """Colours (..., 3) and the roots of their products: (..., 6)."""
    neighbours = np.roll(balanced, -1, axis=-1)
    return np.concatenate([balanced, np.sqrt(np.maximum(balanced * neighbours, 0.0))], axis=-1)
