"""Sections of a camera: a line of its ISO table, the window that is read out, the colour response."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron


@dataclass(frozen=True)
class IsoSetting:
    """One measured line of a camera's ISO table.

    gain_dn_per_e: K of EMVA 1288 [DN/e-], > 0.
    read_noise_dn: total temporal dark noise in the raw file [DN], >= 0.
    """

    gain_dn_per_e: DigitalNumbersPerElectron
    read_noise_dn: DigitalNumbers

    def __post_init__(self):
        gain, noise = self.gain_dn_per_e, self.read_noise_dn
        require(0 < gain < np.inf, "camera.iso_table.gain", f"{gain:g} DN/e-", "give a gain above 0 DN/e-")
        require(0 <= noise < np.inf, "camera.iso_table.read_noise", f"{noise:g} DN", "a standard deviation is not negative")


@dataclass(frozen=True)
class Window:
    """Part of the sensor that is read out: x, y of its upper left photosite, width and height [px]."""

    x: int
    y: int
    width: int
    height: int

    def __str__(self) -> str:
        return f"{self.width} x {self.height} at ({self.x}, {self.y})"


@dataclass(frozen=True)
class SpectralResponse:
    """Quantum efficiency (filter, microlens and silicon together) per colour.

    wavelengths_nm: (wavelengths,) ascending, evenly spaced [nm].
    quantum_efficiency: (wavelengths, channels) electrons per photon; channels R, G, B, or one for MONO.
    """

    wavelengths_nm: np.ndarray
    quantum_efficiency: np.ndarray

    def __post_init__(self):
        grid, table = np.asarray(self.wavelengths_nm), np.asarray(self.quantum_efficiency)
        fits = table.ndim == 2 and len(table) == grid.size > 1 and table.shape[1] in (1, 3)
        rule = f"needs {grid.size} lines, one per wavelength, of 3 values (red, green, blue), or of 1 without a colour filter"
        require(fits, "camera.response.quantum_efficiency", f"shape {table.shape}", rule)
        ascends = bool((np.diff(grid) > 0).all())
        require(ascends, "camera.response.wavelengths", f"{grid[0]:g} to {grid[-1]:g} nm", "give ascending wavelengths")
        good = bool(np.isfinite(table).all()) and table.min() >= 0
        require(good, "camera.response.quantum_efficiency", table.min(), "electrons per photon are not negative")

    @property
    def channels(self) -> int:
        """Number of curves."""
        return np.shape(self.quantum_efficiency)[1]
