"""Blur circles far larger than the Airy disk: the aperture's geometric image, spread by diffraction as in focus."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil


@dataclass(frozen=True)
class FarBlur:
    """Kernels of one blur radius, as WavefrontPsf has them.

    focus: the lens in focus, whose kernels have these cells. radius_px: signed radius [photosites].
    """

    focus: WavefrontPsf
    pupil: Pupil
    radius_px: float

    @property
    def cells(self) -> int:
        """Cells per photosite and axis."""
        return self.focus.cells

    @property
    def size_px(self) -> int:
        """Photosites across a kernel, odd."""
        return self.focus.size_px + 2 * math.ceil(self.pupil.corner_radius * abs(self.radius_px) + 1.0)

    def cell_kernel(self, channel: int, _radius_px: float, field_xy: tuple[float, float]) -> np.ndarray:
        """Light in each cell, (size_px * cells, ...) float64."""
        from scipy.signal import fftconvolve

        # What a photosite gathers at an offset, a point throws to the opposite one.
        disk = aperture_weights(self.pupil, self.radius_px * self.cells)[::-1, ::-1]
        found = fftconvolve(disk, self.focus.cell_kernel(channel, 0.0, field_xy))
        spare = (self.size_px * self.cells - len(found)) // 2
        return np.maximum(np.pad(found, spare), 0.0)
