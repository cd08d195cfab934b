"""Planning of a point's image beyond the thin lens: diffraction, aberrations, low-pass filter, aperture of the photosites.

Two ways. By distance: light is dealt out to slabs of blur radius, each spread with the kernel of wave optics there. After the
blur: the geometric blur comes first, then the kernel in focus; exact for filter, aperture and a PSF known in focus only.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simulator.optics.lens.perspective import AIRY_ZERO
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.lens.zernike import noll_orders
from simulator.optics.psf.defocused_psf import FarBlur
from simulator.optics.psf.fraunhofer import ROUND, odd
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.wavefront_psf import LARGEST_KERNEL_PX, WavefrontPsf, kernel_size_px
from simulator.optics.pupil.pupil import Pupil

FIELDS = (0.0, 0.25, 0.5, 0.75, 1.0)  # of tables, half diagonals
# Of lambda N around the rays, and the size of kernels up to which it is taken: 0.2 / margin of the light lies beyond.
MARGINS = ((60.0, 65), (40.0, 97), (20.0, 129), (12.0, 255), (6.0, LARGEST_KERNEL_PX))
MOST_CELLS = 601  # across a kernel
ROUGH_PX = 5  # rays that fill so many photosites leave no detail that needs finer cells than a fifth of one
FAR_AIRY = 16.0  # blur radius, in those of the Airy disk, from which diffraction follows the geometric blur
FAR_CELLS_PX = 24.0  # blur radius from which kernels have one cell per point of light
RINGING = 1e-3  # share of a kernel's light that may be negative
SLAB_PX = 0.5  # between slabs; a sixteenth of larger radii


@dataclass(frozen=True)
class Spread:
    """Kernels over slabs of blur radius, channels, and places on the sensor.

    psf: of the lens; None: a perfect one. pupil: shape of its aperture.
    sampling: aperture of the photosites and low-pass filter.
    over: points per photosite and axis that light is given on. radii_px: of the slabs, ascending, signed [photosites].
    by_distance: whether slabs stand for the blur, instead of following it.
    bright: light of each channel above which it goes through kernels without negative values: kernels of detail near the
        limit of the points ring, which nothing shows but lights in the dark [e- s^-1 um^-2 sr^-1].
    sensor_px: width and height of the sensor. nodes: rows and columns of kernels on it.
    """

    psf: WavefrontPsf | PsfTable | None
    pupil: Pupil
    sampling: Sampling
    pitch_um: float
    over: int
    radii_px: tuple[float, ...]
    by_distance: bool
    sensor_px: tuple[int, int]
    nodes: tuple[int, int]
    bright: tuple[float, ...] = ()

    @cached_property
    def x_px(self) -> np.ndarray:
        """Columns of the nodes [photosites], 0 at the centre of the sensor's first."""
        return _places(self.sensor_px[0], self.nodes[1])

    @cached_property
    def y_px(self) -> np.ndarray:
        """Rows of the nodes."""
        return _places(self.sensor_px[1], self.nodes[0])

    @cached_property
    def reach_px(self) -> int:
        """Photosites that kernels reach on either side."""
        size = 1 if self.psf is None else max(self._lens(slab).size_px for slab in range(len(self.radii_px)))
        return size // 2 + self.sampling.margin_px(self.pitch_um)

    def joined(self, slab: int) -> bool:
        """Whether a slab and the one before it may be one surface."""
        if slab == 0:
            return False
        before, here = self.radii_px[slab - 1 : slab + 1]
        return here - before <= 1.01 * max(_step_px(before), _step_px(here))

    def rings(self, slab: int, channel: int) -> bool:
        """Whether kernels have negative values that matter."""
        kernel = self.kernel(slab, channel, False, self.nodes[0] // 2, self.nodes[1] // 2)
        return bool(self.bright) and -float(np.minimum(kernel, 0.0).sum()) > RINGING * float(kernel.sum())

    def kernel(self, slab: int, channel: int, positive: bool, row: int, column: int) -> np.ndarray:
        """Kernel at a node, (over^2, size, size) float64, phases as of `Sampling.phases`.

        positive: without its negative values, the others lessened to the same light.
        """
        if positive:
            kernel = self.kernel(slab, channel, False, row, column)
            kept = np.maximum(kernel, 0.0)
            return kept * (kernel.sum() / kept.sum())
        key = slab, channel, row, column
        if key not in self._kernels:
            width, height = self.sensor_px
            half = 0.5 * math.hypot(width, height)
            field_xy = (self.x_px[column] + 0.5 - 0.5 * width) / half, (self.y_px[row] + 0.5 - 0.5 * height) / half
            cells, per_photosite = self._cells(slab, channel, field_xy)
            fine = isinstance(self.psf, WavefrontPsf) or per_photosite > 1
            self._kernels[key] = self.sampling.phases(cells, per_photosite, self.pitch_um, self.over, fine)
        return self._kernels[key]

    def _cells(self, slab: int, channel: int, field_xy: tuple[float, float]) -> tuple[np.ndarray, int]:
        """Light of a point in cells, and cells per photosite."""
        if self.psf is None:
            return np.ones((1, 1)), 1
        lens, radius_px = self._lens(slab), self.radii_px[slab]
        if isinstance(lens, WavefrontPsf) and self.nodes != (1, 1) and not _is_fixed(lens):
            if slab not in self._tables:
                self._tables[slab] = lens.table([radius_px], FIELDS)
            lens = self._tables[slab]
        cells = lens.cell_kernel(channel, radius_px, field_xy)
        return (cells if isinstance(lens, PsfTable) else cells / cells.sum()), lens.cells

    @property
    def light(self) -> float:
        """Share of a point's light that arrives."""
        return self.psf.light if isinstance(self.psf, PsfTable) else 1.0

    def _lens(self, slab: int) -> WavefrontPsf | FarBlur | PsfTable:
        """Point spread function of a slab; a wavefront's is as large and as fine as this radius needs."""
        if not isinstance(self.psf, WavefrontPsf):
            return self.psf
        if slab not in self._lenses:
            self._lenses[slab] = self._made_for(self.radii_px[slab])
        return self._lenses[slab]

    def _made_for(self, radius_px: float) -> WavefrontPsf | FarBlur:
        if self.psf.aberrations != Aberrations() or abs(radius_px) < FAR_AIRY * airy_radius_px(self.psf):
            return _sized(self.psf, radius_px, self.over)
        focus = _sized(self.psf, 0.0, self.over)
        coarse = odd(self.over) if abs(radius_px) > FAR_CELLS_PX else max(odd(self.over), 3)
        return FarBlur(replace(focus, cells=min(focus.cells, coarse)), self.pupil, radius_px)

    @cached_property
    def _kernels(self) -> dict:
        return {}

    @cached_property
    def _tables(self) -> dict:
        return {}

    @cached_property
    def _lenses(self) -> dict:
        return {}


def airy_radius_px(psf: WavefrontPsf) -> float:
    """First dark ring of a lens in focus at its shortest wavelength [photosites]."""
    return AIRY_ZERO * 1e-3 * float(np.min(psf.wavelengths_nm)) * psf.f_number / psf.pitch_um


def _places(side_px: int, count: int) -> np.ndarray:
    return np.linspace(0.0, side_px, count) - 0.5 if count > 1 else np.array([0.5 * side_px - 0.5])


def _step_px(radius_px: float) -> float:
    return max(SLAB_PX, abs(radius_px) / 16.0)


def _is_fixed(psf: WavefrontPsf) -> bool:
    """Whether a part of the wavefront keeps to the picture's axes, so that kernels do not turn with the field."""
    return psf.opening is not ROUND or any(noll_orders(index)[1] for index in psf.aberrations.zernike_um)


def _sized(psf: WavefrontPsf, radius_px: float, over: int) -> WavefrontPsf:
    """Kernel that holds its rays and, of the light that diffraction throws beyond them, what its size allows."""
    longest_um, shortest_um = 1e-3 * float(np.max(psf.wavelengths_nm)), 1e-3 * float(np.min(psf.wavelengths_nm))
    radii_px = (radius_px * psf.opening.reach,)
    rays = kernel_size_px(psf.aberrations, psf.f_number, psf.pitch_um, psf.wavelengths_nm, radii_px, airy_margin=0.0)
    per_margin = 2.0 * longest_um * psf.f_number / psf.pitch_um
    sizes = [odd(rays + margin * per_margin) for margin, _ in MARGINS]
    size = next((size for size, (_, most) in zip(sizes, MARGINS, strict=True) if size <= most), LARGEST_KERNEL_PX)
    wanted = odd(psf.pitch_um / (0.5 * shortest_um * psf.f_number))
    least = 1 if over == 1 and wanted == 1 else odd(over)
    most = max(((MOST_CELLS // size) - 1) // 2 * 2 + 1, least)
    return replace(psf, size_px=size, cells=min(max(wanted, least), 5 if rays > ROUGH_PX else wanted + 2, most))


def slab_radii_px(least_px: float, greatest_px: float) -> list[float]:
    """Signed radii from the least to the greatest, as far apart as slabs may be."""
    radii = [least_px]
    while radii[-1] < greatest_px - 1e-6:
        radii.append(min(radii[-1] + _step_px(radii[-1]), greatest_px))
    return radii
