"""Colours that drawings may use: what a camera sees of measured surfaces in a light, and of lamps."""

from dataclasses import dataclass

import numpy as np

from simulator.color.camera_matrices import camera_response, chart_reflectances
from simulator.color.reproducible import nine_digits_each, ordered_product
from simulator.color.spectra import WAVELENGTHS_NM, illuminant
from simulator.sensor.camera.camera import Camera

LAMP_TEMPERATURES_K = tuple(round(1e6 / mired) for mired in range(100, 531, 10))  # from a blue sky to a candle, even in mired
_MIXTURE = 0.04  # of the Dirichlet distribution: most surfaces are close to one or two measured ones
_DARKEST = 0.1  # share of the measured reflectance that is left of the darkest surfaces


@dataclass(frozen=True)
class Paint:
    """Camera signals of measured surfaces and of lamps.

    measured: (patches, channels) float64, of measured surfaces; a perfect white is 1 in the channel that sees it brightest.
    lamps: (temperatures, channels) float64, of blackbodies, 1 in the brightest channel.
    """

    measured: np.ndarray
    lamps: np.ndarray

    def surfaces(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Signals of surfaces, (count, channels) float32.

        A surface is a mixture of measured ones, darkened evenly on a logarithmic scale. Mixtures of reflectances are
        reflectances, and what a camera sees of them is the same mixture.
        """
        shares = rng.standard_gamma(_MIXTURE, (count, len(self.measured)))
        shares *= (_DARKEST ** rng.random(count) / np.maximum(shares.sum(axis=1), 1e-300))[:, None]
        return ordered_product(shares, self.measured).astype(np.float32)

    def lamp(self, rng: np.random.Generator) -> np.ndarray:
        """Signal of one lamp, (channels,) float32."""
        return self.lamps[rng.integers(len(self.lamps))].astype(np.float32)


def paint_for(camera: Camera, light: str) -> Paint:
    """Mix the paint for a camera and a light.

    Surfaces: the 24 patches of the ColorChecker as Ohta measured them (1997, in colour-science). Lamps: blackbodies of
    LAMP_TEMPERATURES_K (Planck), which most lamps resemble.
    """
    curves, power = (camera.response.wavelengths_nm, camera.response.quantum_efficiency), illuminant(light)
    white = camera_response(power, WAVELENGTHS_NM, *curves)
    surfaces = camera_response(chart_reflectances(WAVELENGTHS_NM) * power, WAVELENGTHS_NM, *curves) / white.max()
    blackbodies = np.stack([illuminant(f"{kelvin} K") for kelvin in LAMP_TEMPERATURES_K])
    lamps = camera_response(blackbodies, WAVELENGTHS_NM, *curves)
    return Paint(nine_digits_each(surfaces), nine_digits_each(lamps / lamps.max(axis=1, keepdims=True)))
