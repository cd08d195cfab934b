"""Geometric distortion of a lens, and lateral colour as a magnification of each channel.

The distorted place of a point is x (1 + k1 r^2 + k2 r^4 + k3 r^6) + 2 p1 x y + p2 (r^2 + 2 x^2), and alike in y (Brown 1966,
Photogrammetric Engineering 32, 444). DNG's WarpRectilinear (DNG 1.4, chapter 7) maps a position in the corrected picture
to the distorted one by the same polynomial, so that the file holds the coefficients without a fit.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from simulator.errors import PhotositeError, require

CLOSE_ENOUGH_PX = 1e-3  # error of Newton's method [photosites]
MOST_STEPS = 12


@dataclass(frozen=True)
class Distortion:
    """Distortion of a lens about the centre of the sensor; k1 < 0 is a barrel.

    k1, k2, k3: radial, p1, p2: tangential coefficients of Brown and Conrady.
    unit: of r: focal_length, the image distance, as in camera calibrations (x / z), or half_diagonal of the sensor, as in
        lens profiles.
    lateral: magnification of red, green and blue, such as [1.0004, 1, 0.9997]: lateral chromatic aberration.
    Raises PhotositeError for numbers that are not finite.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    unit: Literal["focal_length", "half_diagonal"] = "focal_length"
    lateral: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        for key in ("k1", "k2", "k3", "p1", "p2"):
            require(math.isfinite(getattr(self, key)), f"lens.distortion.{key}", getattr(self, key), "give a finite number")
        good = len(self.lateral) == 3 and all(0.9 < value < 1.1 for value in self.lateral)
        require(good, "lens.distortion.lateral", list(self.lateral), "give three magnifications within 0.9 to 1.1")

    @property
    def has_effect(self) -> bool:
        """Whether any point is displaced."""
        return any((self.k1, self.k2, self.k3, self.p1, self.p2)) or set(self.lateral) != {1.0}


@dataclass(frozen=True)
class Warp:
    """A distortion on the photosites of one sensor.

    unit_px: photosites for r = 1. centre_x_px, centre_y_px: the optical axis from the sensor's upper left corner.
    magnification: one per channel. steps: Newton's steps that place every photosite to CLOSE_ENOUGH_PX.
    """

    distortion: Distortion
    unit_px: float
    centre_x_px: float
    centre_y_px: float
    magnification: tuple[float, ...]
    steps: int = MOST_STEPS

    def distorted(self, x_px: ArrayLike, y_px: ArrayLike, channel: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Distorted positions of points of the undistorted picture [photosites from the upper left corner], float64."""
        a, b = (
            (np.asarray(x_px, float) - self.centre_x_px) / self.unit_px,
            (np.asarray(y_px, float) - self.centre_y_px) / self.unit_px,
        )
        a, b, *_ = self._polynomial(a, b)
        far = self.unit_px * self.magnification[channel]
        return self.centre_x_px + far * a, self.centre_y_px + far * b

    def undistorted(self, x_px: ArrayLike, y_px: ArrayLike, channel: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """Undistorted positions of points of the distorted picture: the inverse of `distorted`, by Newton's method, float64."""
        a, b = self._inverse(x_px, y_px, channel)
        return self.centre_x_px + self.unit_px * a, self.centre_y_px + self.unit_px * b

    def sides(self, x_px: ArrayLike, y_px: ArrayLike, channel: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Sides of the parallelograms that photosites there see, in their length: derivatives xx, xy = yx, yy of `undistorted`.

        A side to the right is (xx, xy), one down (xy, yy).
        """
        *_, xx, xy, yy = self._polynomial(*self._inverse(x_px, y_px, channel))
        area = self.magnification[channel] * (xx * yy - xy * xy)
        return yy / area, -xy / area, xx / area

    def _inverse(self, x_px: ArrayLike, y_px: ArrayLike, channel: int) -> tuple[np.ndarray, np.ndarray]:
        """Undistorted positions from the centre, in units of r."""
        far = self.unit_px * self.magnification[channel]
        seen_a, seen_b = (np.asarray(x_px, float) - self.centre_x_px) / far, (np.asarray(y_px, float) - self.centre_y_px) / far
        a, b = seen_a, seen_b
        for _ in range(self.steps):
            new_a, new_b, xx, xy, yy = self._polynomial(a, b)
            miss_a, miss_b, area = new_a - seen_a, new_b - seen_b, xx * yy - xy * xy
            a, b = a - (yy * miss_a - xy * miss_b) / area, b - (xx * miss_b - xy * miss_a) / area
        return a, b

    def _polynomial(self, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Distorted position and its derivatives xx, xy = yx, yy, in units of r."""
        d, r2 = self.distortion, a * a + b * b
        radial = 1.0 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3))
        slope = 2.0 * (d.k1 + r2 * (2.0 * d.k2 + r2 * 3.0 * d.k3))
        new_a = a * radial + 2.0 * d.p1 * a * b + d.p2 * (r2 + 2.0 * a * a)
        new_b = b * radial + 2.0 * d.p2 * a * b + d.p1 * (r2 + 2.0 * b * b)
        xx = radial + slope * a * a + 2.0 * d.p1 * b + 6.0 * d.p2 * a
        yy = radial + slope * b * b + 2.0 * d.p2 * a + 6.0 * d.p1 * b
        return new_a, new_b, xx, slope * a * b + 2.0 * d.p1 * a + 2.0 * d.p2 * b, yy

    def at_spot(self, x_px: float, y_px: float) -> Self:
        """Return the same distortion on photosites that lie so far from these."""
        return replace(self, centre_x_px=self.centre_x_px - x_px, centre_y_px=self.centre_y_px - y_px)

    def on_wider_photosites(self) -> Self:
        """Return the same distortion, counted in photosites twice as wide."""
        centre = 0.5 * self.centre_x_px, 0.5 * self.centre_y_px
        return replace(self, unit_px=0.5 * self.unit_px, centre_x_px=centre[0], centre_y_px=centre[1])

    def macros(self) -> dict[str, object]:
        """Macros of kernels/distortion.h."""
        numbers = {key.upper(): getattr(self.distortion, key) for key in ("k1", "k2", "k3", "p1", "p2")}
        numbers |= {"UNIT_PX": self.unit_px, "CENTRE_X": self.centre_x_px, "CENTRE_Y": self.centre_y_px}
        magnification = (self.magnification * 3)[:3] if len(self.magnification) == 1 else self.magnification
        numbers |= {f"SHRINK_{index}": 1.0 / (value * self.unit_px) for index, value in enumerate(magnification)}
        numbers |= {f"LATERAL_{index}": 1.0 / value - 1.0 for index, value in enumerate(magnification)}
        macros: dict[str, object] = {f"DISTORTION_{key}": f"({value:.9e}f)" for key, value in numbers.items()}
        return macros | {"DISTORTION_STEPS": self.steps}

    def rectilinear(
        self, left: float, top: float, right: float, bottom: float
    ) -> tuple[tuple[tuple[float, ...], ...], tuple[float, float]] | None:
        """Coefficients (kr0..kr3, kt0, kt1) of each channel, and centre (x, y), of WarpRectilinear for a part of the sensor.

        left, top, right, bottom: centres of the part's outermost pixels [photosites]. WarpRectilinear's unit is the distance
        from the optical axis to the farthest corner, and the centre is relative to the part's sides. None when the axis lies
        outside the part, which DNG forbids, and for a part of one row or column, which has no such place.
        """
        if right <= left or bottom <= top:
            return None
        centre = (self.centre_x_px - left) / (right - left), (self.centre_y_px - top) / (bottom - top)
        if not all(0.0 <= share <= 1.0 for share in centre):
            return None
        sides = (
            max(abs(edge - middle) for edge in edges)
            for edges, middle in (((left, right), self.centre_x_px), ((top, bottom), self.centre_y_px))
        )
        share, d = math.hypot(*sides) / self.unit_px, self.distortion
        terms = (1.0, d.k1 * share**2, d.k2 * share**4, d.k3 * share**6, d.p1 * share, d.p2 * share)
        return tuple(tuple(value * term for term in terms) for value in self.magnification), centre

    def extent(self, width_px: int, height_px: int) -> tuple[float, float, float, float]:
        """Return how undistorting widens the sensor and its photosites.

        Undistorted over distorted width and height of the sensor, the longest side of a photosite's parallelogram, and its
        largest width or height, over the photosite's side.
        """
        reach_x, reach_y, stretch, widest = 1.0, 1.0, 1.0, 1.0
        x, y = _lattice(width_px, height_px)
        for channel in range(len(self.magnification)):
            u, v = self.undistorted(x, y, channel)
            reach_x = max(reach_x, 2.0 * float(np.abs(u - self.centre_x_px).max()) / width_px)
            reach_y = max(reach_y, 2.0 * float(np.abs(v - self.centre_y_px).max()) / height_px)
            xx, xy, yy = np.abs(self.sides(x, y, channel))
            stretch = max(stretch, float(np.hypot(np.maximum(xx, yy), xy).max()))
            widest = max(widest, float((np.maximum(xx, yy) + xy).max()))
        return reach_x, reach_y, stretch, widest

    def tilt(self, width_px: int, height_px: int) -> float:
        """How far sides of photosites lean at most, in their length: of undistorting, over a sensor."""
        return _tilt(self, width_px, height_px)


@lru_cache(maxsize=8)
def _tilt(warp: Warp, width_px: int, height_px: int) -> float:
    places = _lattice(width_px, height_px)
    return max(float(np.abs(warp.sides(*places, channel)[1]).max()) for channel in range(len(warp.magnification)))


def _lattice(width_px: int, height_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Places x, y on a sensor from edge to edge [photosites], (1089,) each, at which it is measured."""
    x, y = np.meshgrid(np.linspace(0, width_px, 33), np.linspace(0, height_px, 33))
    return x.ravel(), y.ravel()


def plan_warp(
    distortion: Distortion | None, image_distance_px: float, width_px: int, height_px: int, channels: int
) -> Warp | None:
    """Distortion of a lens on a sensor; None without effect.

    image_distance_px: lens to sensor [photosites]. Raises PhotositeError for a distortion that is not invertible.
    """
    if distortion is None or not distortion.has_effect:
        return None
    half_diagonal_px = 0.5 * math.hypot(width_px, height_px)
    unit_px = half_diagonal_px if distortion.unit == "half_diagonal" else image_distance_px
    rule = "is stated for red, green and blue, and the camera sees white, too; leave it out"
    require(channels != 4 or len({*distortion.lateral}) == 1, "lens.distortion.lateral", list(distortion.lateral), rule)
    magnification = tuple(distortion.lateral) if channels == 3 else (distortion.lateral[1],)
    warp = Warp(distortion, unit_px, 0.5 * width_px, 0.5 * height_px, magnification)
    _check_fold(warp, half_diagonal_px)
    edge = np.linspace(-0.05, 1.05, 23)
    x, y = (axis.ravel() for axis in np.meshgrid(edge * width_px, edge * height_px))
    for steps in range(1, MOST_STEPS + 1):
        tried = Warp(distortion, unit_px, 0.5 * width_px, 0.5 * height_px, magnification, steps)
        misses = [
            np.hypot(*np.subtract(tried.distorted(*tried.undistorted(x, y, c), c), (x, y))) for c in range(len(magnification))
        ]
        if np.max(misses) < 0.1 * CLOSE_ENOUGH_PX:
            return tried
    raise PhotositeError("the picture cannot be traced back; lessen k1, k2, k3, p1 or p2", key="lens.distortion")


def _check_fold(warp: Warp, half_diagonal_px: float) -> None:
    """Raise PhotositeError for a radial polynomial that is not monotonic out to the corner of the sensor."""
    radius = np.linspace(0.0, 10.0, 4001) * half_diagonal_px / warp.unit_px
    seen, _, slope, *_ = Warp(Distortion(*_radial(warp.distortion)), 1.0, 0.0, 0.0, (1.0,))._polynomial(radius, 0.0 * radius)
    turns = np.nonzero(slope <= 0.0)[0]
    reached = np.max(seen) if len(turns) == 0 else seen[turns[0]]
    share = float(reached) * warp.unit_px * min(warp.magnification) / half_diagonal_px
    rule = f"folds the picture over at {share:.2f} of the sensor's half diagonal; lessen k1, k2 or k3"
    require(share > 1.1, "lens.distortion", _radial(warp.distortion), rule)


def _radial(distortion: Distortion) -> tuple[float, float, float]:
    """Radial coefficients k1, k2, k3."""
    return distortion.k1, distortion.k2, distortion.k3
