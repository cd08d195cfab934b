"""Point spread functions of a wavefront for the channels of a camera: kernel by kernel, or as a table."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.lens.zernike import noll_orders
from simulator.optics.psf.fraunhofer import ROUND, Opening, compute_psf, odd
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable

LARGEST_KERNEL_PX = 511
AIRY_MARGIN = 6.0  # around the geometric rays [lambda N]: 97 % of the light of an ideal lens lies within


def channel_wavelengths(wavelengths_nm: np.ndarray, light: np.ndarray, count: int = 3) -> np.ndarray:
    """Wavelengths that represent the light of each channel, (channels, count) [nm].

    light: (wavelengths, channels) what a channel detects at each wavelength, such as radiance x wavelength x quantum
    efficiency. The spectrum is cut into `count` parts of equal light, each represented by its mean wavelength.
    """
    rows = []
    for weights in np.asarray(light, dtype=np.float64).T:
        edges = np.concatenate([[0.0], np.cumsum(weights)])
        moments = np.concatenate([[0.0], np.cumsum(weights * wavelengths_nm)])
        cuts = np.interp(np.linspace(0.0, edges[-1], count + 1), edges, moments)
        rows.append(np.diff(cuts) * count / edges[-1])
    return np.array(rows)


@dataclass(frozen=True)
class WavefrontPsf:
    """Point spread functions by wave optics, incoherent sums over a few wavelengths per channel.

    f_number: working f-number, N (1 + |m|) of a lens focused near.
    wavelengths_nm: per channel, its wavelengths [nm], as from channel_wavelengths, of equal weight.
    size_px: photosites across a kernel, odd. cells: cells per photosite and axis in a table, odd. opening: edge of the pupil.
    Kernels are normalised, which puts the light outside back in proportion: a flat field keeps its level.
    """

    aberrations: Aberrations
    f_number: float
    pitch_um: float
    wavelengths_nm: tuple[tuple[float, ...], ...]
    size_px: int
    cells: int = 3
    opening: Opening = ROUND

    def __post_init__(self) -> None:
        good = self.size_px % 2 == 1 and 1 <= self.size_px <= LARGEST_KERNEL_PX
        require(good, "size of the kernels", f"{self.size_px} photosites", f"give an odd number up to {LARGEST_KERNEL_PX}")
        require(self.cells % 2 == 1 and self.cells > 0, "cells", self.cells, "give an odd number")

    @property
    def cutoff(self) -> float:
        """Highest spatial frequency that the lens passes at its shortest wavelength, 1 / (lambda N) [cycles per photosite]."""
        return self.pitch_um / (1e-3 * float(np.min(self.wavelengths_nm)) * self.f_number)

    def cell_kernel(
        self, channel: int, blur_radius_px: float, field_xy: tuple[float, float], kept: tuple[float, float] | None = None
    ) -> np.ndarray:
        """Light of a point in each cell, (size_px * cells, ...) float64; the sum is below 1 by the light outside.

        kept: as of `compute_psf` [cycles per photosite].
        """
        kept = None if kept is None else (kept[0] / self.cells, kept[1] / self.cells)
        wavelengths, cell_um, size = self.wavelengths_nm[channel], self.pitch_um / self.cells, self.size_px * self.cells
        total = np.zeros((size, size))
        for wavelength_nm in wavelengths:

            def wavefront_error_um(x: np.ndarray, y: np.ndarray, wavelength_nm: float = wavelength_nm) -> np.ndarray:
                blur_um = blur_radius_px * self.pitch_um
                return self.aberrations.wavefront_error_um(x, y, self.f_number, wavelength_nm, field_xy, blur_um)

            light = 1e-3 * wavelength_nm, self.f_number
            total = total + compute_psf(wavefront_error_um, *light, cell_um, size, self.opening, kept)
        return total / len(wavelengths)

    def kernel(
        self, channel: int, blur_radius_px: float, field_xy: tuple[float, float], sampling: Sampling | None = None
    ) -> np.ndarray:
        """Response of the photosites around an image point, (size_px, size_px) float64, sum 1. See PsfTable.kernel."""
        cells = self.cell_kernel(channel, blur_radius_px, field_xy)
        return (sampling or Sampling()).photosites(cells / cells.sum(), self.cells, self.pitch_um)

    def table(self, blur_radii_px: Sequence[float], fields: Sequence[float]) -> PsfTable:
        """Tabulate kernels for every blur radius [photosites], field and channel.

        A table is rotated to the direction of the field. Raises PhotositeError for Zernike terms without rotational symmetry,
        which keep to the axes of the picture.
        """
        tilted = [index for index in self.aberrations.zernike_um if noll_orders(index)[1] != 0]
        rule = "a table is turned to the field, and these terms do not turn; ask for kernels at places instead"
        require(not tilted, "lens.aberrations.zernike", tilted, rule)
        channels, size = len(self.wavelengths_nm), self.size_px * self.cells
        kernels = np.empty((len(blur_radii_px), len(fields), channels, size, size), np.float32)
        for place in np.ndindex(kernels.shape[:3]):
            row, column, channel = place
            cells = self.cell_kernel(channel, blur_radii_px[row], (fields[column], 0.0))
            kernels[place] = cells / cells.sum()
        return PsfTable(kernels, np.asarray(blur_radii_px, float), np.asarray(fields, float), self.cells, self.pitch_um)


def kernel_size_px(
    aberrations: Aberrations,
    f_number: float,
    pitch_um: float,
    wavelengths_nm: Sequence[Sequence[float]] | np.ndarray,
    blur_radii_px: Sequence[float] = (0.0,),
    airy_margin: float = AIRY_MARGIN,
) -> int:
    """Width of a kernel that holds all geometric rays and airy_margin lambda N of diffraction around them [photosites], odd.

    Raises PhotositeError above LARGEST_KERNEL_PX.
    """
    rim = np.linspace(0.0, 1.0, 17)[:, None] * np.exp(2j * math.pi * np.arange(32) / 32)[None, :]
    step, reach_um = 1e-4, 0.0
    for wavelength_nm in sorted(set(np.ravel(wavelengths_nm))):
        for blur_px in (min(blur_radii_px), max(blur_radii_px)):
            for field in aberrations.extreme_fields:
                lens = (f_number, float(wavelength_nm), (field, 0.0), blur_px * pitch_um)
                for dx, dy in ((step, 0.0), (0.0, step)):
                    ahead = aberrations.wavefront_error_um(rim.real + dx, rim.imag + dy, *lens)
                    slope = (ahead - aberrations.wavefront_error_um(rim.real - dx, rim.imag - dy, *lens)) / (2.0 * step)
                    reach_um = max(reach_um, 2.0 * f_number * float(np.abs(slope).max()))
    longest_um = 1e-3 * float(np.max(wavelengths_nm))
    size = odd(2.0 * (reach_um + airy_margin * longest_um * f_number) / pitch_um + 1.0)
    # Coefficients of no stated f-number are those of any pupil, and their rays land farther off the larger N is.
    smaller = "state at_f_number" if aberrations.at_f_number is None else "stop down"
    rule = f"a kernel has at most {LARGEST_KERNEL_PX}: {smaller}, or lessen the aberrations or the defocus"
    require(size <= LARGEST_KERNEL_PX, "lens.aberrations", f"{size} photosites wide", rule)
    return size
