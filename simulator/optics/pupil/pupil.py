"""The shape of the pupil: which rays reach a photosite.

Coordinates u are in units of the radius of the full round pupil, along the picture's axes (x right, y down). A photosite at x
sees the plane of signed blur radius s at x + s u (`ThinLens.blur_radius_um`). So u is the shape of the spot of a point nearer
than the plane in focus; that of a farther point is the same, turned by 180 degrees.

A pupil with blades has the area of the round one. The f-number then still states the light: the effective aperture of a
pupil that is not round is the diameter of the circle of equal area.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.pupil.convex_area import Disk, HalfPlane, intersection_area
from simulator.units import Degrees

_ROWS = 4096  # strips into which the pupil is cut to spread points over it
_STRAIGHT = 1e-4  # curvature whose sides bend by less than 1e-4; of circles so large differences lose digits
_PLASTIC = 1.32471795724474602596  # root of x^3 = x + 1


@dataclass(frozen=True)
class PupilStop:
    """A round stop before or behind the aperture as a photosite sees it: it moves across the pupil with the field.

    radius: of its image in the pupil. shift: how far its centre moves per tangent of the field angle; both in pupil radii.
    """

    radius: float
    shift: float


@dataclass(frozen=True)
class Pupil:
    """Aperture with or without blades, clipped off the axis by other stops (mechanical vignetting, cat's eyes).

    blades: number of sides, 3 to 32; None: round.
    rotation_deg: turns the first corner from the right towards the picture's lower edge [deg].
    blade_curvature: 0: straight sides; 1: sides are arcs of the circle through the corners, so the pupil is round.
        Between: arcs whose curvature is this share of the circle's.
    stops: what clips.

    A field is (x, y): the photosite's place from the optical axis over the image distance, that is the tangents of the
    field angle, x right and y down in the picture. Raises PhotositeError for numbers out of range.
    """

    blades: int | None = None
    rotation_deg: float = 0.0
    blade_curvature: float = 0.0
    stops: tuple[PupilStop, ...] = ()

    def __post_init__(self):
        blades, key = self.blades, "lens.aperture"
        require(blades is None or 3 <= blades <= 32, f"{key}.blades", blades, "give 3 to 32, or leave it out for a round one")
        require(math.isfinite(self.rotation_deg), f"{key}.rotation", f"{self.rotation_deg} deg", "give a finite angle")
        require(0 <= self.blade_curvature <= 1, f"{key}.blade_curvature", self.blade_curvature, "give a number from 0 to 1")

    @cached_property
    def opening(self) -> tuple[Disk | HalfPlane, ...]:
        """The aperture alone, of area pi, as an intersection of disks and half planes."""
        if self.blades is None or self.blade_curvature == 1.0:
            return (Disk(0.0, 0.0, 1.0),)
        return self._sides(self.corner_radius)

    @cached_property
    def corner_radius(self) -> float:
        """Distance of the aperture's corners from its centre, in radii of the round one."""
        if self.blades is None or self.blade_curvature == 1.0:
            return 1.0
        return math.sqrt(math.pi / intersection_area(self._sides(1.0)))

    def _sides(self, corner: float) -> tuple[Disk | HalfPlane, ...]:
        """Sides of a polygon whose corners lie at this radius."""
        half = math.pi / self.blades
        directions = math.radians(self.rotation_deg) + half * (2.0 * np.arange(self.blades) + 1.0)
        apothem = corner * math.cos(half)
        if self.blade_curvature < _STRAIGHT:
            return tuple(HalfPlane(math.cos(angle), math.sin(angle), apothem) for angle in directions)
        radius = corner / self.blade_curvature
        centre = apothem - math.sqrt(radius**2 - (corner * math.sin(half)) ** 2)
        return tuple(Disk(centre * math.cos(angle), centre * math.sin(angle), radius) for angle in directions)

    def parts(self, field=(0.0, 0.0)) -> tuple[Disk | HalfPlane, ...]:
        """The pupil as a photosite at this field sees it, as an intersection of disks and half planes."""
        x, y = field
        clips = tuple(Disk(stop.shift * float(x), stop.shift * float(y), stop.radius) for stop in self.stops)
        return self.opening + tuple(clip for clip in clips if clip not in self.opening)

    def contains(self, points, field=(0.0, 0.0)) -> np.ndarray:
        """Whether each of the points (n, 2) lies in the pupil: (n,) bool."""
        points = np.asarray(points, dtype=np.float64)
        inside = [part.contains(points[..., 0], points[..., 1]) for part in self.parts(field)]
        return np.logical_and.reduce(inside)

    def depth(self, x, y) -> np.ndarray:
        """Distance of points from the border of the pupil on the axis [pupil radii], negative outside."""
        return np.minimum.reduce([part.depth(x, y) for part in self.parts()])

    def area(self, field=(0.0, 0.0)) -> float:
        """Area in squared pupil radii, in closed form; pi where nothing clips."""
        return intersection_area(self.parts(field))

    def points(self, count: int, field=(0.0, 0.0)) -> np.ndarray:
        """Points (count, 2) float64 spread evenly over the area, of low discrepancy; those of a smaller count come first.

        The R2 sequence (Roberts 2018: the Kronecker sequence of the plastic number) in the unit square, through `of_square`.
        Raises PhotositeError where the pupil is closed.
        """
        chosen, across = even_points(count)
        return np.stack(self.of_square(chosen, across, field), axis=-1)

    def of_square(self, chosen: np.ndarray, across: np.ndarray, field=(0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
        """Places x, y in the pupil of points of the unit square, by a map that keeps areas (Rosenblatt 1952).

        The first number chooses the row by area, the second the place in the row. Raises PhotositeError where it is closed.
        """
        rows, left, right = self.spans(field)
        widths = right - left
        area = np.concatenate([[0.0], np.cumsum(0.5 * (widths[1:] + widths[:-1]) * np.diff(rows))])
        if not area[-1] > 0:
            raise PhotositeError(
                f"no ray reaches the field ({field[0]:g}, {field[1]:g}); widen the stops", key="lens.vignetting"
            )
        y = np.interp(chosen * area[-1], area, rows)
        return np.interp(y, rows, left) + across * np.interp(y, rows, widths), y

    def outline(self, field=(0.0, 0.0)) -> np.ndarray:
        """Corners (n, 2) of a fine polygon along the edge (to 1e-5), clockwise in the picture; none of a closed pupil."""
        rows, left, right = self.spans(field)
        if not (right > left).any():
            return np.empty((0, 2))
        return np.concatenate([np.stack([right, rows], axis=-1), np.stack([left, rows], axis=-1)[::-1]])

    def spans(self, field=(0.0, 0.0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (y) across the pupil with the x of both ends; denser at the top and the bottom, where the edge lies flat."""
        parts = self.parts(field)
        low, high = -2.0, 2.0  # a triangle of area pi reaches 1.56
        for _ in range(3):  # closes in on the open rows
            rows = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.linspace(0.0, math.pi, _ROWS))
            ends = [part.span(rows) for part in parts]
            left, right = np.max([end[0] for end in ends], axis=0), np.min([end[1] for end in ends], axis=0)
            is_open = np.flatnonzero(right > left)
            if not len(is_open):
                return rows, np.zeros(_ROWS), np.zeros(_ROWS)
            low, high = rows[max(is_open[0] - 1, 0)], rows[min(is_open[-1] + 1, _ROWS - 1)]
        shut = right <= left
        left, right = (np.interp(rows, rows[~shut], end[~shut]) for end in (left, right))
        return rows, left, np.where(shut, left, right)


def even_points(count: int) -> np.ndarray:
    """Points (2, count) of the R2 sequence in the unit square."""
    return np.mod(np.outer(_PLASTIC ** np.array([-1.0, -2.0]), np.arange(1, count + 1)) + 0.5, 1.0)


@dataclass(frozen=True)
class Aperture:
    """Diaphragm with blades. Its area is that of the round one, so blades change the blur and not the exposure.

    blades: number of sides, 3 to 32.
    rotation_deg: turns the first corner from the right towards the picture's lower edge, in the spot of a near light [deg].
    blade_curvature: 0: straight sides; 1: round; between: arcs.
    """

    blades: int
    rotation_deg: Degrees = 0.0
    blade_curvature: float = 0.0

    def __post_init__(self):
        self.pupil()

    def pupil(self, *stops: PupilStop) -> Pupil:
        """The pupil that these stops clip."""
        return Pupil(self.blades, self.rotation_deg, self.blade_curvature, stops)
