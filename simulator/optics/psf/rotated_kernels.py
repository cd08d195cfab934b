"""Kernels of a wavefront at any blur radius and place, interpolated between computed ones and rotated to the field."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simulator.optics.psf.fraunhofer import odd
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

FINEST_CELLS = 5  # per photosite and axis, of computed kernels
SAMPLES = 3  # per photosite and axis, of kernels that are rotated
PASSED, STOPPED = 1.0, 1.45  # spatial frequencies that they keep, and lose [cycles per photosite]
FIELD_STEPS = 8  # of the computed field radii, from the centre to the corner
CUBIC = 4  # nodes of an interpolation


@dataclass(frozen=True)
class RotatedKernels:
    """Kernels of a lens without parts that are fixed to the picture's axes, or on the axis only.

    lens_psf: its size and cells are not used. radii_px: blur radii at which it is computed, ascending [photosites].
    varies: whether kernels differ over the field.
    margin: around the geometric rays [lambda N]; a fraction of 0.2 / margin of the light lies beyond.
    """

    lens_psf: WavefrontPsf
    sampling: Sampling
    radii_px: tuple[float, ...]
    varies: bool
    margin: float

    @property
    def cells(self) -> int:
        """Cells per photosite and axis of computed kernels."""
        lens = self.lens_psf
        wanted = odd(lens.pitch_um / (0.5e-3 * float(np.min(lens.wavelengths_nm)) * lens.f_number))
        return min(max(wanted, SAMPLES), FINEST_CELLS)

    @cached_property
    def size_px(self) -> int:
        """Photosites across kernels, before the sampling widens them."""
        return max(self._size_px(radius_px) for radius_px in self.radii_px)

    def kernels(self, field_xy: tuple[float, float]) -> np.ndarray:
        """Response of photosites at the computed radii and an image point, (radii, channels, size, size) float64.

        field_xy: over the sensor's half diagonal, x to the right and y down. The sum is below 1 by the light outside.
        """
        return self.photosites(self.samples(field_xy))

    def photosites(self, samples: np.ndarray) -> np.ndarray:
        """Response of photosites to the light of `samples`, (..., size, size)."""
        down = self.sampling.photosite_matrix(self.size_px, SAMPLES, self.cells, self.lens_psf.pitch_um)
        return np.asarray(down @ samples @ down.T)

    def samples(self, field_xy: tuple[float, float]) -> np.ndarray:
        """Light of a point at the computed radii, SAMPLES per photosite and axis: (radii, channels, samples, samples)."""
        height, angle_rad = math.hypot(*field_xy), math.atan2(field_xy[1], field_xy[0])
        fine = self._at_field(height)
        count = fine.shape[-1]
        if height > 0.0 and self.varies:
            turned = _rotation(count, round(angle_rad, 12)) @ fine.reshape(-1, count * count).T
            fine = turned.T.reshape(fine.shape)
        return fine

    def _at_field(self, height: float) -> np.ndarray:
        """Samples of the kernels at a field radius on the x axis, coefficients of cubic splines where `varies`."""
        if not self.varies:
            return self._fine(0)
        place = min(height, 1.0) * FIELD_STEPS
        numbers, weights = lagrange_weights(np.arange(-1.0, FIELD_STEPS + 1.0), place)
        parts = (weight * self._fine(int(number) - 1) for number, weight in zip(numbers, weights, strict=True) if weight)
        return np.asarray(sum(parts))

    def _fine(self, step: int) -> np.ndarray:
        """Samples at a computed field radius, (radii, channels, samples, samples); -1: beyond the centre, mirrored."""
        if step < 0:
            return self._fine(-step)[..., ::-1]
        if step not in self._made:
            made = np.stack([self._samples(radius_px, step / FIELD_STEPS) for radius_px in self.radii_px])
            self._made[step] = _spline_coefficients(made) if self.varies else made
        return self._made[step]

    def _samples(self, radius_px: float, height: float) -> np.ndarray:
        size_px, cells = self._size_px(radius_px), self.cells
        lens = replace(self.lens_psf, size_px=size_px, cells=cells)
        fewer = _resampling(size_px, cells)
        pad = SAMPLES * (self.size_px - size_px) // 2
        channels = range(len(lens.wavelengths_nm))
        found = [fewer @ lens.cell_kernel(channel, radius_px, (height, 0.0)) @ fewer.T for channel in channels]
        return np.pad(np.stack(found), ((0, 0), (pad, pad), (pad, pad)))

    def _size_px(self, radius_px: float) -> int:
        lens = self.lens_psf
        radii_px = (radius_px * lens.opening.reach,)
        return kernel_size_px(
            lens.aberrations, lens.f_number, lens.pitch_um, lens.wavelengths_nm, radii_px, airy_margin=self.margin
        )

    @cached_property
    def _made(self) -> dict[int, np.ndarray]:
        return {}


def lagrange_weights(nodes: np.ndarray, place: float) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the CUBIC nodes around a place, or of all if there are fewer, and their weights; nodes ascend."""
    first = int(np.clip(np.searchsorted(nodes, place) - CUBIC // 2, 0, max(len(nodes) - CUBIC, 0)))
    near = nodes[first : first + CUBIC]
    weights = [np.prod((place - np.delete(near, n)) / (near[n] - np.delete(near, n))) for n in range(len(near))]
    return first + np.arange(len(near)), np.array(weights)


@lru_cache(maxsize=32)
def _resampling(size_px: int, cells: int) -> np.ndarray:
    """Samples of light in cells, (SAMPLES * size_px, cells * size_px), of the same sum and without fine detail."""
    period = 2 * size_px
    frequency = np.arange(-round(STOPPED * period), round(STOPPED * period) + 1) / period
    kept = np.clip((STOPPED - np.abs(frequency)) / (STOPPED - PASSED), 0.0, 1.0)
    kept = 0.5 - 0.5 * np.cos(math.pi * kept)
    into, out = (np.arange(count * size_px) - 0.5 * (count * size_px - 1) for count in (cells, SAMPLES))
    back, ahead = (np.exp(2j * math.pi * np.outer(places, frequency)) for places in (out / SAMPLES, -into / cells))
    return np.ascontiguousarray(((back * kept) @ ahead.T).real) / (SAMPLES * period)


def _spline_coefficients(samples: np.ndarray) -> np.ndarray:
    """Coefficients of cubic splines through samples (..., rows, columns)."""
    from scipy.ndimage import spline_filter1d

    return np.asarray(spline_filter1d(spline_filter1d(samples, axis=-1, mode="mirror"), axis=-2, mode="mirror"))


@lru_cache(maxsize=4)
def _rotation(count: int, angle_rad: float) -> "csr_matrix":
    """Sparse matrix (count^2, count^2) from spline coefficients to samples, turned from the x axis towards the y axis."""
    from scipy.sparse import csr_matrix

    axis = np.arange(count) - 0.5 * (count - 1)
    x = math.cos(angle_rad) * axis[None, :] + math.sin(angle_rad) * axis[:, None] + 0.5 * (count - 1)
    y = math.cos(angle_rad) * axis[:, None] - math.sin(angle_rad) * axis[None, :] + 0.5 * (count - 1)
    (left, across), (top, down) = (_spline_weights(place.ravel()) for place in (x, y))
    columns = top[:, :, None] * count + left[:, None, :]
    weights = down[:, :, None] * across[:, None, :]
    inside = ((top >= 0) & (top < count))[:, :, None] & ((left >= 0) & (left < count))[:, None, :]
    weights, columns = np.where(inside, weights, 0.0), np.where(inside, columns, 0)
    starts = 16 * np.arange(count * count + 1)
    return csr_matrix((weights.ravel(), columns.ravel(), starts), shape=(count * count, count * count))


def _spline_weights(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the four coefficients around places (n,), and their weights in a cubic B-spline: (n, 4) each."""
    low = np.floor(place)
    t = place - low
    parts = ((1.0 - t) ** 3, 3.0 * t**3 - 6.0 * t**2 + 4.0, -3.0 * t**3 + 3.0 * t**2 + 3.0 * t + 1.0, t**3)
    return low.astype(int)[:, None] + np.arange(-1, 3), np.stack(parts, axis=-1) / 6.0
