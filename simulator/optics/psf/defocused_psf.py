"""Circles of confusion far larger than the Airy disk: the geometric image of the aperture, convolved with the PSF in focus."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil


@dataclass(frozen=True)
class DefocusedPsf:
    """Kernels of one blur radius, with the interface of WavefrontPsf.

    focus: the lens in focus, whose cells the kernels have. radius_px: signed blur radius [photosites].
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
        """Light of a point in each cell, (size_px * cells, size_px * cells) float64."""
        from scipy.signal import fftconvolve

        # The weights by which a photosite gathers light are the point spread function mirrored in both axes.
        disk = aperture_weights(self.pupil, self.radius_px * self.cells)[::-1, ::-1]
        kernel = fftconvolve(disk, self.focus.cell_kernel(channel, 0.0, field_xy))
        padding = (self.size_px * self.cells - len(kernel)) // 2
        return np.maximum(np.pad(kernel, padding), 0.0)
