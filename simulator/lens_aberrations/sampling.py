"""From fine cells to photosites: the aperture of a photosite and an optical low-pass filter."""

from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.units import Micrometres


@dataclass(frozen=True)
class Sampling:
    """What stands between the light on the sensor and one photosite.

    fill_factor: light-sensitive share of a photosite, a square of side pitch sqrt(fill_factor): MTF |sinc(side nu)| on either
        axis (Boreman, Modulation Transfer Function in Optical and Electro-Optical Systems, 1.6).
    low_pass_um: distance between the spots of a four-spot birefringent low-pass filter on either axis [um]:
        MTF |cos(pi distance nu)| (Greivenkamp 1990, Appl. Opt. 29, 676). 0: no filter.
    """

    fill_factor: float = 1.0
    low_pass_um: Micrometres = 0.0

    def __post_init__(self):
        require(0 < self.fill_factor <= 1, "fill_factor", self.fill_factor, "give a share above 0 and up to 1")
        require(0 <= self.low_pass_um < 100, "low_pass", f"{self.low_pass_um:g} um", "give a distance from 0 to 100 um")

    def transfer(self, frequency_per_um: np.ndarray, pitch_um: float) -> np.ndarray:
        """Modulation transfer along one axis, with its sign, same shape as the frequencies [cycles/um]."""
        side_um = pitch_um * np.sqrt(self.fill_factor)
        return np.sinc(frequency_per_um * side_um) * np.cos(np.pi * self.low_pass_um * frequency_per_um)

    def photosites(self, cells: np.ndarray, per_photosite: int, pitch_um: float) -> np.ndarray:
        """Response of photosites to light given in cells, (size, size) -> (size / per_photosite, ...) float64, same sum.

        cells: light in each of odd x odd cells, per_photosite (odd) of them to a photosite and axis; a low-pass filter
        wants a margin of half its distance. Exact for a photosite that is sensitive all over.
        """
        size = len(cells)
        if self.fill_factor == 1.0 and self.low_pass_um == 0.0:
            count = size // per_photosite
            return cells.reshape(count, per_photosite, count, per_photosite).sum(axis=(1, 3), dtype=np.float64)
        cell_um = pitch_um / per_photosite
        frequency = np.fft.fftfreq(2 * size, cell_um)
        # The cells have integrated over their own width already.
        transfer = self.transfer(frequency, pitch_um) / np.sinc(frequency * cell_um)
        spectrum = np.fft.fft2(cells, (2 * size, 2 * size)) * transfer[:, None] * transfer[None, :]
        first = per_photosite // 2
        sampled = np.fft.ifft2(spectrum).real[first:size:per_photosite, first:size:per_photosite]
        return sampled * (cells.sum(dtype=np.float64) / sampled.sum())
