"""Kernels of a wavefront at any blur radius and place, interpolated between computed ones and rotated to the field."""

import math
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from simulator.device.threads import in_threads
from simulator.optics.psf.fraunhofer import ROUND, Opening, odd
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.square_light import square_matrix
from simulator.optics.psf.wavefront_psf import WavefrontPsf, kernel_size_px

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

SAMPLES = 3  # per photosite and axis, of computed kernels that samples of light cut at half a cycle per photosite
MOST_SAMPLES = 7  # of those that nothing cuts
LOST = 0.5, 0.05  # below half a cycle per sample, frequency up to which these have all detail, and from which on none [cycles]
FIELD_STEPS = 8  # of the computed field radii, from the centre to the corner
BLADE_STEPS = (0, 2, 4, 6, 8)  # of these, at which what blades change is computed
BLADE_TURNS = 4  # angles between field and blades at which it is, over the angle from one corner to the next
CUBIC = 4  # nodes of an interpolation
SPLINE = 5  # degree of the splines that are turned: cubics pass what aliases to frequencies that photosites see


@dataclass(frozen=True)
class RotatedKernels:
    """Kernels of a lens whose wavefront turns with the field, or on the axis only.

    Blades do not turn with the field: what they change of the kernels of a round pupil is interpolated over their angle to it.
    lens_psf: its size and cells are not used. radii_px: blur radii at which it is computed, ascending [photosites].
    varies: whether kernels differ over the field.
    margin: around the geometric rays [lambda N]; a fraction of 0.2 / margin of the light lies beyond.
    even_squares: as of `FieldPsf`.
    """

    lens_psf: WavefrontPsf
    sampling: Sampling
    radii_px: tuple[float, ...]
    varies: bool
    margin: float
    even_squares: bool = False

    @cached_property
    def per_photosite(self) -> int:
        """`samples_of` these kernels."""
        return samples_of(self.lens_psf, even_squares=self.even_squares)

    @cached_property
    def size_px(self) -> int:
        """Photosites across kernels, before the sampling widens them."""
        return max(self._sizes_px.values())

    def computed(self, size_px: int, least_px: int) -> np.ndarray:
        """1 where wave optics tells the light of kernels of odd size, and to a least reach, (radii, 1, size, size); else 0.

        Of kernels that are turned that is a disk: their corners lie beyond what is computed.
        """
        away_px = np.abs(np.arange(size_px) - size_px // 2)
        half_px = np.array([max(self._sizes_px[radius_px] // 2, least_px) for radius_px in self.radii_px])
        far_px = np.hypot(away_px[:, None], away_px) if self.varies else np.maximum(away_px[:, None], away_px)
        return (far_px <= half_px[:, None, None]).astype(np.float32)[:, None]

    @cached_property
    def _sizes_px(self) -> dict[float, int]:
        """Photosites across the kernels of each computed radius."""
        return {radius_px: self._size_px(radius_px) for radius_px in self.radii_px}

    def kernels(self, field_xy: tuple[float, float]) -> np.ndarray:
        """Response of photosites at the computed radii and an image point, (radii, channels, size, size) float32.

        field_xy: over the sensor's half diagonal, x to the right and y down. The sum is below 1 by the light outside.
        """
        return self.photosites(self.samples(field_xy))

    def computed_kernels(self, field_xy: tuple[float, float]) -> np.ndarray:
        """`kernels` by wave optics at this place, without interpolation."""
        made = np.stack([self._samples(radius_px, field_xy, self.lens_psf.opening) for radius_px in self.radii_px])
        return self.photosites(_by_place(made))

    def photosites(self, samples: np.ndarray) -> np.ndarray:
        """Response of photosites to the light of `samples`, (radii, channels, size, size) float32."""
        size = self.size_px, self.per_photosite, self.lens_psf.pitch_um
        matrix = square_matrix(self.sampling, *size) if self.even_squares else self.sampling.photosite_matrix(*size)
        down = matrix.astype(np.float32)
        rows, columns, *kernels = samples.shape
        tall = (down @ samples.reshape(rows, -1)).reshape(len(down), columns, -1)
        return np.asarray(np.moveaxis(down @ tall, -1, 0).reshape(*kernels, len(down), len(down)))

    def samples(self, field_xy: tuple[float, float]) -> np.ndarray:
        """Light of a point at the computed radii, `per_photosite` samples per photosite and axis.

        (samples, samples, radii, channels) float32: what is done with a place is done with all kernels there.
        """
        height, angle_rad = math.hypot(*field_xy), math.atan2(field_xy[1], field_xy[0])
        fine = self._at_field(height, angle_rad)
        if self.varies:
            count = len(fine)
            fine = (_rotation(count, round(angle_rad, 12)) @ fine.reshape(count * count, -1)).reshape(fine.shape)
        return fine

    @property
    def has_blades(self) -> bool:
        """Whether blades stand at an angle to the field."""
        return self.varies and self.lens_psf.opening.blades > 0

    def _at_field(self, height: float, angle_rad: float) -> np.ndarray:
        """Samples of the kernels at a field radius on the x axis, coefficients of splines where `varies`.

        angle_rad: of the field, by which the picture is turned.
        """
        if not self.varies:
            return self._fine(0)
        place = min(height, 1.0) * FIELD_STEPS
        numbers, weights = lagrange_weights(np.arange(-1.0, FIELD_STEPS + 1.0), place)
        parts = [(weight, self._fine(int(number) - 1)) for number, weight in zip(numbers, weights, strict=True) if weight]
        if self.has_blades:
            beside, along = lagrange_weights(np.array(BLADE_STEPS, float), place)
            turns = _turn_weights(self.lens_psf.opening.blades * (self.lens_psf.opening.corner_rad - angle_rad))
            for number, weight in zip(beside, along, strict=True):
                changes = self._blade_change(BLADE_STEPS[number]) if weight else ()
                parts += [(weight * turn, change) for turn, change in zip(turns, changes, strict=False) if abs(turn) > 1e-12]
        return _weighted_sum(parts)

    def _fine(self, step: int) -> np.ndarray:
        """Samples at a computed field radius, as of `samples`; -1: beyond the centre, mirrored.

        Where `varies` those of a round pupil.
        """
        if step < 0:
            return self._fine(-step)[:, ::-1]
        if step not in self._made:
            self._made[step] = self._computed(step, ROUND if self.has_blades else self.lens_psf.opening)
        return self._made[step]

    def _blade_change(self, step: int) -> np.ndarray:
        """What blades change at a computed field radius, BLADE_TURNS times what `samples` has."""
        if step not in self._changes:
            opening, turn_rad = self.lens_psf.opening, 2.0 * math.pi / (BLADE_TURNS * self.lens_psf.opening.blades)
            ways = [self._computed(step, opening.with_corner(turn * turn_rad)) for turn in range(BLADE_TURNS // 2 + 1)]
            ways += [way[::-1] for way in ways[-2:0:-1]]  # the field has the blades' mirror image on its other side
            self._changes[step] = np.stack(ways) - self._fine(step)
        return self._changes[step]

    def _computed(self, step: int, opening: Opening) -> np.ndarray:
        """Samples of wave optics at a field radius; coefficients of splines where `varies`."""
        made = np.stack(
            in_threads(lambda radius_px: self._samples(radius_px, (step / FIELD_STEPS, 0.0), opening), self.radii_px)
        )
        return _by_place(_spline_coefficients(made) if self.varies else made)

    def _samples(self, radius_px: float, field_xy: tuple[float, float], opening: Opening) -> np.ndarray:
        size_px, finer = self._sizes_px[radius_px], self.per_photosite
        lens = replace(self.lens_psf, size_px=size_px, cells=finer, opening=opening)
        pad, kept = finer * (self.size_px - size_px) // 2, (0.5 * finer - LOST[0], 0.5 * finer - LOST[1])
        found = [lens.cell_kernel(channel, radius_px, field_xy, kept) for channel in range(len(lens.wavelengths_nm))]
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

    @cached_property
    def _changes(self) -> dict[int, np.ndarray]:
        return {}


def samples_of(lens_psf: WavefrontPsf, *, even_squares: bool) -> int:
    """Samples of computed kernels per photosite and axis, odd: as many as hold what photosites see of such light."""
    return min(max(SAMPLES, odd(2.0 * (lens_psf.cutoff + LOST[0]))), MOST_SAMPLES) if even_squares else SAMPLES


def _by_place(kernels: np.ndarray) -> np.ndarray:
    """Kernels (radii, channels, samples, samples) by place, (samples, samples, radii, channels) float32."""
    return np.ascontiguousarray(np.moveaxis(kernels, (0, 1), (2, 3)), np.float32)


def _weighted_sum(parts: list[tuple[float, np.ndarray]]) -> np.ndarray:
    """Sum of arrays with a weight each, of any one shape (rows, ...); float32."""
    found = np.zeros(parts[0][1].shape, np.float32)
    for line, *lines in zip(found, *(part for _, part in parts), strict=True):  # which the cache holds
        for (weight, _), part in zip(parts, lines, strict=True):
            line += np.float32(weight) * part
    return found


def _turn_weights(angle_rad: float) -> np.ndarray:
    """Weights (BLADE_TURNS,) of values at even steps of a turn, of the Fourier series through them at an angle."""
    steps = 2.0 * math.pi / BLADE_TURNS * np.arange(BLADE_TURNS)
    terms = [np.cos(order * (angle_rad - steps)) for order in range(1, BLADE_TURNS // 2)]
    last = math.cos(BLADE_TURNS // 2 * angle_rad) * np.cos(BLADE_TURNS // 2 * steps)
    return np.asarray((1.0 + 2.0 * sum(terms) + last) / BLADE_TURNS)


def lagrange_weights(nodes: np.ndarray, place: float, count: int = CUBIC) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of an even count of nodes around a place, or of all if there are fewer, and their weights; nodes ascend."""
    first = int(np.clip(np.searchsorted(nodes, place) - count // 2, 0, max(len(nodes) - count, 0)))
    near = nodes[first : first + count]
    weights = [np.prod((place - np.delete(near, n)) / (near[n] - np.delete(near, n))) for n in range(len(near))]
    return first + np.arange(len(near)), np.array(weights)


def _spline_coefficients(samples: np.ndarray) -> np.ndarray:
    """Coefficients of splines through samples (..., rows, columns)."""
    from scipy.ndimage import spline_filter1d

    for axis in (-1, -2):
        samples = spline_filter1d(samples, SPLINE, axis=axis, mode="mirror")
    return np.asarray(samples)


@lru_cache(maxsize=2)
def _rotation(count: int, angle_rad: float) -> "csr_matrix":
    """Sparse matrix (count^2, count^2) from spline coefficients to samples, turned from the x axis towards the y axis."""
    from scipy.sparse import csr_matrix

    axis = np.arange(count) - 0.5 * (count - 1)
    x = math.cos(angle_rad) * axis[None, :] + math.sin(angle_rad) * axis[:, None] + 0.5 * (count - 1)
    y = math.cos(angle_rad) * axis[:, None] - math.sin(angle_rad) * axis[None, :] + 0.5 * (count - 1)
    (left, across), (top, down) = (_spline_weights(place.ravel()) for place in (x, y))
    columns = top[:, :, None] * np.int32(count) + left[:, None, :]
    inside = ((top >= 0) & (top < count))[:, :, None] & ((left >= 0) & (left < count))[:, None, :]
    weights, columns = np.where(inside, down[:, :, None] * across[:, None, :], np.float32(0.0)), np.where(inside, columns, 0)
    starts = (SPLINE + 1) ** 2 * np.arange(count * count + 1, dtype=np.int32)
    return csr_matrix((weights.ravel(), columns.ravel(), starts), shape=(count * count, count * count))


def _spline_weights(place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the six coefficients around places (n,), and their weights in a quintic B-spline: (n, 6) each."""
    low, beside = np.floor(place), np.arange(-(SPLINE // 2), SPLINE // 2 + 2)
    away = np.abs((place - low)[:, None] - beside)
    near = ((-10.0 * away + 30.0) * away**2 - 60.0) * away**2 + 66.0
    middle = ((((5.0 * away - 45.0) * away + 150.0) * away - 210.0) * away + 75.0) * away + 51.0
    weights = np.where(away < 1.0, near, np.where(away < 2.0, middle, (3.0 - away) ** 5)) / 120.0
    return (low[:, None] + beside).astype(np.int32), weights.astype(np.float32)
