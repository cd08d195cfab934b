"""Tables of point spread functions over defocus, field and channel."""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.psf.pixel_aperture import Sampling

SUM_TOLERANCE = 1e-3  # relative error of a kernel's sum above which the table is refused
NEGATIVE_TOLERANCE = 1e-6  # of the largest value, which rounding may leave below 0


@dataclass(frozen=True)
class PsfTable:
    """Kernels of a lens for signed blur radii x field radii x channels.

    kernels: (blur radii, fields, channels, size, size) float32, light of a point in each cell, with the image
        point in the middle cell, for an image point to the right of the centre of the picture: rows run down, columns run
        outwards. One channel stands for all.
    blur_radii_px: ascending, signed as ThinLens.blur_radius_um, in photosites: linear in the inverse of the distance.
    fields: ascending, distance of the image point from the centre over the sensor's half diagonal.
    cells: odd number of cells per photosite and axis. pitch_um: photosite pitch the cells divide [um].
    light: sum of every kernel; below 1 where light is lost.
    Raises PhotositeError for kernels that are no square of odd size, not finite, negative, or of another sum.
    """

    kernels: np.ndarray
    blur_radii_px: np.ndarray
    fields: np.ndarray
    cells: int
    pitch_um: float
    light: float = 1.0
    source: str = "PSF"

    def __post_init__(self) -> None:
        kernels = np.asarray(self.kernels)
        self._check_axes(kernels)
        self._check_values(kernels)
        kernels = np.maximum(kernels, 0.0)
        sums = kernels.sum(axis=(3, 4), dtype=np.float64)
        object.__setattr__(self, "kernels", (kernels * (self.light / sums)[..., None, None]).astype(np.float32))

    @property
    def size_px(self) -> int:
        """Photosites across a kernel."""
        return self.kernels.shape[-1] // self.cells

    def kernel(
        self, channel: int, blur_radius_px: float, field_xy: tuple[float, float], sampling: Sampling | None = None
    ) -> np.ndarray:
        """Response of the photosites around an image point, (size_px, size_px) float64, sum `light`.

        field_xy: the image point over the sensor's half diagonal, x to the right and y down. Interpolated linearly between the
        entries of the table, constant beyond; rotated to the direction of the field.
        """
        cells = self.cell_kernel(channel, blur_radius_px, field_xy)
        return (sampling or Sampling()).photosites(cells, self.cells, self.pitch_um)

    def whole(self) -> Self:
        """Return the same kernels with all light: sum 1."""
        return self if self.light == 1.0 else replace(self, kernels=self.kernels / np.float32(self.light), light=1.0)

    def cell_kernel(self, channel: int, blur_radius_px: float, field_xy: tuple[float, float]) -> np.ndarray:
        """Light of an image point in each cell, (size_px * cells, ...) float64, sum `light`; arguments as of `kernel`."""
        kernels = self.kernels[:, :, min(channel, self.kernels.shape[2] - 1)]
        found = np.zeros(kernels.shape[2:])
        for row, row_weight in interpolation_weights(np.asarray(self.blur_radii_px), blur_radius_px):
            for column, weight in interpolation_weights(np.asarray(self.fields), math.hypot(*field_xy)):
                found += row_weight * weight * kernels[row, column]
        return rotate_kernel(found, math.atan2(field_xy[1], field_xy[0]))

    def _check_axes(self, kernels: np.ndarray) -> None:
        shape, wanted = kernels.shape, (len(self.blur_radii_px), len(self.fields))
        rule = "give (blur radii, fields, channels, size, size)"
        require(kernels.ndim == 5 and shape[:2] == wanted, "shape of kernels", shape, rule, file=self.source)
        odd_size = shape[3] == shape[4] and shape[3] % 2 == 1
        require(odd_size, "size of the kernels", f"{shape[3]} x {shape[4]}", "give an odd square", file=self.source)
        whole = self.cells > 0 and self.cells % 2 == 1 and shape[3] % self.cells == 0
        rule = f"give an odd number of cells per photosite that divides the kernels' {shape[3]} cells"
        require(whole, "cells", self.cells, rule, file=self.source)
        for name, axis in (("blur_radii_px", self.blur_radii_px), ("fields", self.fields)):
            good = len(axis) > 0 and np.isfinite(axis).all() and np.all(np.diff(axis) > 0)
            require(bool(good), name, list(axis), "give ascending numbers, each once", file=self.source)
        require(
            self.fields[0] >= 0, "fields", list(self.fields), "give shares of the half diagonal, 0 or more", file=self.source
        )
        require(0 < self.light <= 1, "light", self.light, "give the share that arrives, above 0 and up to 1", file=self.source)

    def _check_values(self, kernels: np.ndarray) -> None:
        if not np.isfinite(kernels).all():
            raise PhotositeError(
                f"kernel {_place(~np.isfinite(kernels))} is not finite; give numbers everywhere", file=self.source
            )
        negative = kernels < -NEGATIVE_TOLERANCE * kernels.max(axis=(3, 4), keepdims=True)
        if negative.any():
            least = float(kernels[negative].min())
            raise PhotositeError(f"kernel {_place(negative)} holds {least:g}; light is not negative", file=self.source)
        sums = kernels.sum(axis=(3, 4), dtype=np.float64)
        wrong = np.abs(sums - self.light) > SUM_TOLERANCE * self.light
        if wrong.any():
            place = tuple(int(i) for i in np.argwhere(wrong)[0])
            raise PhotositeError(
                f"kernel {place} sums to {sums[place]:.6g}, not to {self.light:g}: divide it by its sum, or "
                "state the light that arrives as `light`",
                file=self.source,
            )


def _place(wrong: np.ndarray) -> tuple[int, ...]:
    """Indices (blur radius, field, channel) of the first kernel marked as wrong."""
    return tuple(int(i) for i in np.argwhere(wrong)[0][:3])


def interpolation_weights(axis: np.ndarray, value: float) -> list[tuple[int, float]]:
    """Indices and weights of linear interpolation at a value of an ascending axis; beyond the ends, the end."""
    place = float(np.interp(value, axis, np.arange(len(axis))))
    low = min(int(place), len(axis) - 1)
    share = place - low
    return [(low, 1.0)] if share == 0.0 else [(low, 1.0 - share), (low + 1, share)]


def rotate_kernel(cells: np.ndarray, angle_rad: float) -> np.ndarray:
    """Return a kernel rotated from the x axis towards the y axis (down); same sum, float64.

    Multiples of a right angle are exact, other angles are interpolated by a cubic spline.
    """
    quarters = round(angle_rad / (0.5 * math.pi))
    cells = np.rot90(cells, -quarters)
    rest = angle_rad - quarters * 0.5 * math.pi
    if abs(rest) < 1e-9:
        return cells.astype(np.float64)
    axis = np.arange(len(cells)) - len(cells) // 2
    x = math.cos(rest) * axis[None, :] + math.sin(rest) * axis[:, None]
    y = math.cos(rest) * axis[:, None] - math.sin(rest) * axis[None, :]
    return _resampled(cells, x, y)


def skew_kernel(cells: np.ndarray, skew: tuple[float, float]) -> np.ndarray:
    """Return a kernel whose light at (x, y) from its middle is taken to (x + skew[0] y, y + skew[1] y); same sum, float64."""
    axis = np.arange(len(cells)) - len(cells) // 2
    y = axis[:, None] / (1.0 + skew[1]) + 0.0 * axis[None, :]
    return _resampled(cells, axis[None, :] - skew[0] * y, y)


def _resampled(cells: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return a kernel with the light of places (x, y) from its middle, by a cubic spline, and with the same sum."""
    from scipy.ndimage import map_coordinates

    middle = len(cells) // 2
    found = np.maximum(map_coordinates(cells.astype(np.float64), (y + middle, x + middle), order=3), 0.0)
    return found * (cells.sum(dtype=np.float64) / found.sum())
