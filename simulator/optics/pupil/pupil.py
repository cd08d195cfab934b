"""The shape of the pupil: which rays reach a photosite.

Coordinates u are in radii of the full round pupil, along the picture's axes (x right, y down). The ray from a photosite at x
through u meets the plane of signed blur radius s at x + s u (`ThinLens.blur_radius_um`). So the spot of a point nearer than the
plane in focus has the shape of the pupil, that of a farther point the shape rotated by 180 degrees.

A pupil with blades has the area of the round one, so that the f-number still determines the exposure.

Light that was swept under a rolling shutter, each row at its own time, shows the image of the pupil skewed: `Pupil.skew`.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from simulator.errors import PhotositeError, require
from simulator.optics.pupil.convex_area import Disk, HalfPlane, intersection_area
from simulator.units import Degrees

_ROWS = 4096  # rows across the pupil that its inverse distribution is tabulated on
_STRAIGHT = 1e-4  # blade curvature below which sides are straight to 1e-4; larger circles lose digits in differences
_ON_AXIS = (0.0, 0.0)
UPRIGHT = (0.0, 0.0)  # skew of a pupil as it is

Field = tuple[float, float] | np.ndarray  # (x, y), see Pupil
_PLASTIC = 1.32471795724474602596  # root of x^3 = x + 1


@dataclass(frozen=True)
class PupilStop:
    """A round stop before or behind the aperture, projected into the pupil from a photosite: it shifts with the field.

    radius: of its projection in the pupil. shift: of its centre per tangent of the field angle; both in pupil radii.
    """

    radius: float
    shift: float


@dataclass(frozen=True)
class Pupil:
    """Aperture with or without blades, clipped off the axis by other stops (mechanical vignetting, cat's eyes).

    blades: number of sides, 3 to 32; None: round.
    rotation_deg: angle of the first corner, from the right towards the picture's lower edge [deg].
    blade_curvature: 0: straight sides; 1: sides are arcs of the circle through the corners, so the pupil is round.
        Between: arcs of this fraction of the circle's curvature.
    stops: round stops that clip the aperture.
    skew: of the pupil's image (`spans`, and what is made of them): its point (x, y) is at (x + skew[0] y, y + skew[1] y), with
        skew[1] above -1.

    A field is (x, y): the photosite's position relative to the optical axis over the image distance, that is the tangents of
    the field angle, x right and y down in the picture. Raises PhotositeError for numbers out of range.
    """

    blades: int | None = None
    rotation_deg: float = 0.0
    blade_curvature: float = 0.0
    stops: tuple[PupilStop, ...] = ()
    skew: tuple[float, float] = UPRIGHT

    def __post_init__(self) -> None:
        blades, key = self.blades, "lens.aperture"
        require(blades is None or 3 <= blades <= 32, f"{key}.blades", blades, "give 3 to 32, or leave it out for a round one")
        require(math.isfinite(self.rotation_deg), f"{key}.rotation", f"{self.rotation_deg} deg", "give a finite angle")
        require(0 <= self.blade_curvature <= 1, f"{key}.blade_curvature", self.blade_curvature, "give a number from 0 to 1")

    def turned(self, angle_rad: float) -> Self:
        """Return the aperture turned from the right towards the picture's lower edge; a round one is itself. Stops stay."""
        return self if self.is_round else replace(self, rotation_deg=self.rotation_deg + math.degrees(angle_rad))

    @cached_property
    def opening(self) -> tuple[Disk | HalfPlane, ...]:
        """The aperture without stops, of area pi, as an intersection of disks and half planes."""
        if self.blades is None or self.blade_curvature == 1.0:
            return (Disk(0.0, 0.0, 1.0),)
        return self._sides(self.blades, self._upright_corner)

    @cached_property
    def is_round(self) -> bool:
        """Whether the aperture without stops is a disk."""
        return self.opening == (Disk(0.0, 0.0, 1.0),) and self.skew == UPRIGHT

    @cached_property
    def corner_radius(self) -> float:
        """Distance of the aperture's corners from its centre, in radii of the round one; not less where it is skewed."""
        across, down = self.skew
        return self._upright_corner * float(np.linalg.norm([[1.0, across], [0.0, 1.0 + down]], 2))

    @cached_property
    def _upright_corner(self) -> float:
        if self.blades is None or self.blade_curvature == 1.0:
            return 1.0
        return math.sqrt(math.pi / intersection_area(self._sides(self.blades, 1.0)))

    def corners(self) -> np.ndarray:
        """Corners of the aperture without stops, upright, (blades, 2) [pupil radii]; none of a round one."""
        if self.blades is None or self.blade_curvature == 1.0:
            return np.empty((0, 2))
        angles = math.radians(self.rotation_deg) + 2.0 * math.pi / self.blades * np.arange(self.blades)
        return self._upright_corner * np.stack([np.cos(angles), np.sin(angles)], axis=-1)

    def _sides(self, blades: int, corner: float) -> tuple[Disk | HalfPlane, ...]:
        """Sides of a polygon whose corners lie at this radius."""
        half = math.pi / blades
        directions = math.radians(self.rotation_deg) + half * (2.0 * np.arange(blades) + 1.0)
        apothem = corner * math.cos(half)
        if self.blade_curvature < _STRAIGHT:
            return tuple(HalfPlane(math.cos(angle), math.sin(angle), apothem) for angle in directions)
        radius = corner / self.blade_curvature
        centre = apothem - math.sqrt(radius**2 - (corner * math.sin(half)) ** 2)
        return tuple(Disk(centre * math.cos(angle), centre * math.sin(angle), radius) for angle in directions)

    def parts(self, field: Field = _ON_AXIS) -> tuple[Disk | HalfPlane, ...]:
        """The clipped pupil at a field, as an intersection of disks and half planes."""
        x, y = field
        clips = tuple(Disk(stop.shift * float(x), stop.shift * float(y), stop.radius) for stop in self.stops)
        return self.opening + tuple(clip for clip in clips if clip not in self.opening)

    def contains(self, points: ArrayLike, field: Field = _ON_AXIS) -> np.ndarray:
        """Whether each of the points (n, 2) lies in the pupil: (n,) bool."""
        places = np.asarray(points, dtype=np.float64)
        inside = [part.contains(places[..., 0], places[..., 1]) for part in self.parts(field)]
        return np.logical_and.reduce(inside)

    def depth(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distance of points from the edge of the pupil on the axis [pupil radii], negative outside."""
        return np.minimum.reduce([part.depth(x, y) for part in self.parts()])

    def area(self, field: Field = _ON_AXIS) -> float:
        """Area in squared pupil radii, in closed form; pi where nothing clips."""
        return intersection_area(self.parts(field))

    def points(self, count: int, field: Field = _ON_AXIS) -> np.ndarray:
        """Low-discrepancy points (count, 2) float64 of uniform density; a smaller count is a prefix of a larger one.

        The R2 sequence (Roberts 2018: the Kronecker sequence of the plastic number), through `map_unit_square`.
        Raises PhotositeError where the pupil is closed.
        """
        chosen, across = generate_r2_points(count)
        return np.stack(self.map_unit_square(chosen, across, field), axis=-1)

    def map_unit_square(self, chosen: np.ndarray, across: np.ndarray, field: Field = _ON_AXIS) -> tuple[np.ndarray, np.ndarray]:
        """Map points of the unit square to x, y in the pupil, preserving areas (Rosenblatt 1952).

        chosen: fraction of the area above the row, 0 to 1. across: position in the row, 0 to 1.
        Raises PhotositeError where the pupil is closed.
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

    def outline(self, field: Field = _ON_AXIS) -> np.ndarray:
        """Corners (n, 2) of a fine polygon along the edge (to 1e-5), clockwise in the picture; none of a closed pupil."""
        rows, left, right = self.spans(field)
        if not (right > left).any():
            return np.empty((0, 2))
        return np.concatenate([np.stack([right, rows], axis=-1), np.stack([left, rows], axis=-1)[::-1]])

    def spans(self, field: Field = _ON_AXIS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows (y) across the pupil and the x of their two ends; denser at top and bottom, where the edge is flat."""
        parts = self.parts(field)
        low, high = -2.0, 2.0  # a triangle of area pi reaches 1.56
        rows = left = right = np.empty(0)
        for _ in range(3):  # each pass narrows the range to the rows that are open
            rows = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.linspace(0.0, math.pi, _ROWS))
            ends = [part.span(rows) for part in parts]
            left, right = np.max([end[0] for end in ends], axis=0), np.min([end[1] for end in ends], axis=0)
            is_open = np.flatnonzero(right > left)
            if not len(is_open):
                return rows, np.zeros(_ROWS), np.zeros(_ROWS)
            low, high = rows[max(is_open[0] - 1, 0)], rows[min(is_open[-1] + 1, _ROWS - 1)]
        shut = right <= left
        left, right = (np.interp(rows, rows[~shut], end[~shut]) for end in (left, right))
        across, down = self.skew
        return (1.0 + down) * rows, left + across * rows, np.where(shut, left, right) + across * rows


def generate_r2_points(count: int) -> np.ndarray:
    """Points (2, count) of the R2 sequence in the unit square."""
    return np.mod(np.outer(_PLASTIC ** np.array([-1.0, -2.0]), np.arange(1, count + 1)) + 0.5, 1.0)


@dataclass(frozen=True)
class Aperture:
    """Diaphragm with blades. Its area is that of the round one, so blades change the blur and not the exposure.

    blades: number of sides, 3 to 32.
    rotation_deg: angle of the first corner, from the right towards the picture's lower edge, in the spot of a near light [deg].
    blade_curvature: 0: straight sides; 1: round; between: arcs.
    """

    blades: int
    rotation_deg: Degrees = 0.0
    blade_curvature: float = 0.0

    def __post_init__(self) -> None:
        self.pupil()  # raises for numbers out of range

    def pupil(self, *stops: PupilStop) -> Pupil:
        """Return the pupil of this aperture, clipped by stops."""
        return Pupil(self.blades, self.rotation_deg, self.blade_curvature, stops)
