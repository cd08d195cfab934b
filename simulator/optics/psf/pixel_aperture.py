"""The aperture of a photosite and an optical low-pass filter, applied to kernels on fine cells."""

import functools
import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.optics.geometry.footprint import Footprint
from simulator.units import Micrometres

RINGING_PX = 12  # reach of the ringing of an aperture or filter that passes detail up to the band limit [photosites]


@dataclass(frozen=True)
class Sampling:
    """Sampling of the light on the sensor by a photosite.

    fill_factor: light-sensitive share of a photosite, a square of side pitch sqrt(fill_factor): MTF |sinc(side nu)| on either
        axis (Boreman, Modulation Transfer Function in Optical and Electro-Optical Systems, 1.6).
    low_pass_um: distance between the spots of a four-spot birefringent low-pass filter on either axis [um]:
        MTF |cos(pi distance nu)| (Greivenkamp 1990, Appl. Opt. 29, 676). 0: no filter.
    """

    fill_factor: float = 1.0
    low_pass_um: Micrometres = 0.0

    def __post_init__(self) -> None:
        require(0 < self.fill_factor <= 1, "camera.fill_factor", self.fill_factor, "give a share above 0 and up to 1")
        distance_um = self.low_pass_um
        require(0 <= distance_um < 100, "camera.low_pass", f"{distance_um:g} um", "give a distance from 0 to below 100 um")

    def transfer(self, frequency_per_um: np.ndarray, pitch_um: float) -> np.ndarray:
        """Modulation transfer along one axis, with its sign, same shape as the frequencies [cycles/um]."""
        side_um = pitch_um * np.sqrt(self.fill_factor)
        return np.sinc(frequency_per_um * side_um) * np.cos(np.pi * self.low_pass_um * frequency_per_um)

    def photosites(self, cells: np.ndarray, per_photosite: int, pitch_um: float) -> np.ndarray:
        """Response of photosites to light given in cells, (size, size) -> (size / per_photosite, ...) float64, same sum.

        cells: light in each of odd x odd cells, per_photosite (odd) of them to a photosite and axis; a low-pass filter
        needs a margin of half its distance. Exact for a photosite that is sensitive all over.
        """
        size = len(cells)
        if self.fill_factor == 1.0 and self.low_pass_um == 0.0:
            count = size // per_photosite
            return cells.reshape(count, per_photosite, count, per_photosite).sum(axis=(1, 3), dtype=np.float64)
        cell_um = pitch_um / per_photosite
        frequency = np.fft.fftfreq(2 * size, cell_um)
        # The cells are integrals over their own width.
        transfer = self.transfer(frequency, pitch_um) / np.sinc(frequency * cell_um)
        spectrum = np.fft.fft2(cells, (2 * size, 2 * size)) * transfer[:, None] * transfer[None, :]
        first = per_photosite // 2
        sampled = np.fft.ifft2(spectrum).real[first:size:per_photosite, first:size:per_photosite]
        return sampled * (cells.sum(dtype=np.float64) / sampled.sum())

    def margin_px(self, pitch_um: float, footprint: Footprint | None = None) -> int:
        """Photosites by which `phases` widens a kernel on each side."""
        plain = footprint is not None or (self.fill_factor == 1.0 and self.low_pass_um == 0.0)
        return 1 if plain else RINGING_PX + math.ceil(0.5 * self.low_pass_um / pitch_um)

    def footprint(self, pitch_um: float) -> Footprint:
        """Squares over which photosites average light behind the filter."""
        return Footprint(math.sqrt(self.fill_factor), self.low_pass_um / pitch_um)

    def phases(
        self,
        cells: np.ndarray,
        per_photosite: int,
        pitch_um: float,
        over: int,
        band_limited: bool,
        footprint: Footprint | None = None,
    ) -> np.ndarray:
        """Kernels from light samples, over x over per photosite, to photosites: (over^2, size, size) float64.

        Light samples are means over their own width, so the transfer function of the kernels is that of the lens times that of
        this sampling, divided by sinc(nu pitch / over), up to over / 2 cycles per photosite: the aperture counts once. Where a
        photosite is not sensitive all over, the transfer is tapered to zero over the last fifth, so that points do not ring.
        Phase [over * row + column] is the kernel of the samples at this place within their photosites, on the grid of
        photosites; the signal is the sum over phases of their convolutions. All phases together have the sum of `cells`.
        cells: light of a point in each of odd x odd cells, per_photosite (odd) to a photosite and axis.
        band_limited: whether the cells are integrals of a function that is band-limited to their grid.
        footprint: of samples that hold filter and open area, whose other squares kernels undo; None: a sample is the mean over
            its own square.
        """
        matrices = _phase_matrices(self, len(cells), per_photosite, pitch_um, over, band_limited, footprint)
        columns = [down @ cells for down in matrices]
        found = np.array([column @ across.T for column in columns for across in matrices])
        return found * (cells.sum(dtype=np.float64) / found.sum())

    def photosite_matrix(self, size_px: int, per_photosite: int, pitch_um: float) -> np.ndarray:
        """Matrix of one axis from samples of a kernel to photosites, (size_px + 2 margin_px, per_photosite * size_px) float64.

        The kernel is that of `phases` with one light sample per photosite, without its normalisation.
        per_photosite: samples per photosite and axis, odd, of light without finer detail.
        """
        return _photosite_matrix(self, size_px, per_photosite, pitch_um)


@functools.lru_cache(maxsize=8)
def _photosite_matrix(sampling: Sampling, size_px: int, per_photosite: int, pitch_um: float) -> np.ndarray:
    found_px = size_px + 2 * sampling.margin_px(pitch_um)
    cycles = _cycles(found_px, 1)
    transfer = sampling.transfer(cycles / pitch_um, pitch_um) / np.sinc(cycles)
    transfer[[0, -1]] *= 0.5
    count = per_photosite * size_px
    places, photosites = (np.arange(count) - count // 2) / per_photosite, np.arange(found_px) - found_px // 2
    back, ahead = (np.exp(2j * math.pi * np.outer(away, cycles)) for away in (photosites, -places))
    return np.ascontiguousarray(((back * transfer) @ ahead.T).real) / (2 * found_px)


def _cycles(found_px: int, over: int) -> np.ndarray:
    """Frequencies of a kernel padded to twice this size, up to over / 2 cycles per photosite."""
    period = 2 * found_px
    return np.arange(-over * period // 2, over * period // 2 + 1) / period


@functools.lru_cache(maxsize=8)
def _phase_matrices(
    sampling: Sampling,
    count: int,
    per_photosite: int,
    pitch_um: float,
    over: int,
    band_limited: bool,
    footprint: Footprint | None,
) -> list[np.ndarray]:
    """Matrices of one axis from cells to photosites, (photosites, count) float64, by place of the light samples.

    The transfer function is even, so that they are real.
    """
    found_px = count // per_photosite + 2 * sampling.margin_px(pitch_um, footprint)
    cycles = _cycles(found_px, over)
    if footprint is None:
        transfer = sampling.transfer(cycles / pitch_um, pitch_um) / np.sinc(cycles / over)
    else:
        transfer = 1.0 / footprint.beside_transfer(cycles)
    transfer[[0, -1]] *= 0.5
    if band_limited:
        transfer /= np.sinc(cycles / per_photosite)
    if sampling.fill_factor < 1.0 and over % 2 == 0:  # photosites lie between cells
        last = np.clip((np.abs(cycles) / (0.5 * over) - 0.8) / 0.2, 0.0, 1.0)
        transfer *= 0.5 + 0.5 * np.cos(math.pi * last)
    into = np.exp(-2j * math.pi * np.outer(cycles, (np.arange(count) - count // 2) / per_photosite))
    distances = np.arange(found_px) - found_px // 2
    offsets = [(over - 1 - 2 * phase) / (2 * over) for phase in range(over)]
    return [
        np.ascontiguousarray((np.exp(2j * math.pi * np.outer(distances + offset, cycles)) * transfer @ into).real)
        for offset in offsets
    ]
