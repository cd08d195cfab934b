"""Cat's eye vignetting: the clipped pupil that a photosite sees, by its position on the sensor.

The sensor is divided into square zones. The pupil's shape is computed at their corners, and a photosite's blur is interpolated
bilinearly between the four corners of its zone. The result is continuous, with an error of second order in the movement of a
rim across a zone. Zones begin at the sensor's upper left corner, so that a crop has the zones of the whole frame.
"""

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simulator.optics.lens.lens import Lens
from simulator.optics.pupil.pupil import Pupil

ZONES_PX = (128, 64, 32, 16)  # sides of a zone, coarsest first; a tile has a whole number of them
MOST_MOVED = 0.02  # largest movement of a rim across a zone, whatever the tolerance [pupil radii]: lamps show the shape
MOST_MOVED_OF_HIGHLIGHTS = 0.005  # the same across a square in which spots of highlights have one shape
ZONE_ERROR, MIDDLE_ERROR = 4.0, 1.0  # of the laws below
FINEST = 0.25  # share of the largest blur radius below which zones need not be smaller
SHUT = 1e-3  # share of the pupil below which a photosite counts as dark
TRIED = 256  # points of the pupil that are tested; it is open where one of them passes all stops


@dataclass(frozen=True)
class CatsEyes:
    """Pupil by position on a sensor.

    pupil: with its stops. tangent_per_px: tangent of the field angle per photosite from the middle of the sensor.
    width_px, height_px: size of the sensor. zone_px: side of a zone [photosites].
    most_moved: largest movement of a rim across a zone [pupil radii], which the tolerance allows.
    """

    pupil: Pupil
    tangent_per_px: float
    width_px: float
    height_px: float
    zone_px: int = ZONES_PX[0]
    most_moved: float = MOST_MOVED

    def on_wider_photosites(self, largest_px: float) -> Self:
        """Return the same pupils on photosites twice as wide; largest_px: radius of the largest blur circle on those."""
        wider = replace(
            self, tangent_per_px=2.0 * self.tangent_per_px, width_px=0.5 * self.width_px, height_px=0.5 * self.height_px
        )
        return wider.with_fine_zones(largest_px)

    def with_fine_zones(self, largest_px: float) -> Self:
        """Return the same pupils with the largest zones that are fine enough for blur circles up to this radius."""

        def is_fine(zone_px: int) -> bool:
            return self.movement(zone_px) <= self.most_moved or zone_px <= FINEST * largest_px

        return replace(self, zone_px=next((zone_px for zone_px in ZONES_PX if is_fine(zone_px)), ZONES_PX[-1]))

    def allowing(self, allowed: float, largest_px: float) -> Self:
        """Return the same pupils with zones that may leave this error, as `plan_cats_eyes` chooses them; never finer ones."""
        return replace(self, most_moved=max(self.most_moved, _most_moved(allowed))).with_fine_zones(largest_px)

    def fields(self, x_px: float | np.ndarray, y_px: float | np.ndarray) -> np.ndarray:
        """Tangents of the field angle, (..., 2), at a position from the sensor's upper left corner [photosites]."""
        x, y = np.broadcast_arrays(
            np.asarray(x_px, float) - 0.5 * self.width_px, np.asarray(y_px, float) - 0.5 * self.height_px
        )
        return self.tangent_per_px * np.stack([x, y], axis=-1)

    def clips(self, fields: np.ndarray) -> np.ndarray:
        """Whether a stop may clip the aperture at these fields (..., 2)."""
        distance, corner = np.hypot(fields[..., 0], fields[..., 1]), self.pupil.corner_radius
        reach = [corner + abs(stop.shift) * distance > stop.radius for stop in self.pupil.stops]
        return np.logical_or.reduce(reach)

    def open_fields(self, fields: np.ndarray) -> np.ndarray:
        """These fields (n, 2), each moved towards the axis until the pupil is open.

        A closed pupil passes no light, but neighbouring photosites interpolate between its shape and that of an open one.
        """
        points = self.pupil.points(TRIED)
        passed = np.ones((len(fields), TRIED), bool)
        for stop in self.pupil.stops:
            passed &= ((points - stop.shift * fields[:, None]) ** 2).sum(axis=2) <= stop.radius**2
        return np.array(
            [
                field if open_ else self._open_field(field)
                for field, open_ in zip(fields, np.logical_or.reduce(passed, axis=1), strict=True)
            ]
        )

    def farthest_shift(self) -> float:
        """Distance of the middle of what is open from that of the pupil, at the corner of the sensor [pupil radii]."""
        field = self.open_fields(self.fields(0.0, 0.0)[None])[0]
        points = self.pupil.points(TRIED)
        passed = [((points - stop.shift * field) ** 2).sum(axis=1) <= stop.radius**2 for stop in self.pupil.stops]
        is_open = np.logical_and.reduce(passed)
        return float(np.hypot(*points[is_open].mean(axis=0))) if is_open.any() else 1.0

    def _open_field(self, field: np.ndarray) -> np.ndarray:
        """Farthest field from the axis, on the line to this one, at which the pupil is open; by bisection."""
        inner, outer = 0.0, 1.0
        for _ in range(20):
            middle = 0.5 * (inner + outer)
            shut = self.pupil.area(middle * field) < SHUT * math.pi
            inner, outer = (inner, middle) if shut else (middle, outer)
        return inner * field

    def movement(self, zone_px: float) -> float:
        """Largest movement of a rim in the pupil across so many photosites [pupil radii]."""
        return max(abs(stop.shift) for stop in self.pupil.stops) * self.tangent_per_px * zone_px

    @property
    def alike_px(self) -> int:
        """Side of the squares of the sensor in which spots of highlights share their shape [photosites]."""
        return max(1, int(MOST_MOVED_OF_HIGHLIGHTS / self.movement(1.0)))


def zone_error(moved: float) -> float:
    """Error of interpolating between the pupils at a zone's corners, across which a rim moves so far [pupil radii].

    A share of the brightest light, which counts by the noise at its own place: it bounds 99.9 % of the photosites beside edges
    of 50 : 1 and in rough texture, in the corner of a frame, for radii of 4 and 16 photosites (`benchmarks/cats_eyes.py`).
    """
    return min(ZONE_ERROR * moved**2, MIDDLE_ERROR * moved)


def _most_moved(allowed: float) -> float:
    """Movement of a rim across a zone at which `zone_error` is as large as this [pupil radii]."""
    return min(math.sqrt(allowed / ZONE_ERROR), MOST_MOVED)


def middle_error(moved: float) -> float:
    """Error of one pupil for all of a block, across which a rim moves so far [pupil radii]; as `zone_error`."""
    return MIDDLE_ERROR * moved


def plan_cats_eyes(
    lens: Lens, pixel_pitch_um: float, sensor_px: tuple[int, int], largest_px: float, allowed: float | None = None
) -> CatsEyes | None:
    """Pupil by position on a sensor of (width, height) photosites, or None where no rim clips it.

    largest_px: radius of the largest blur circle. allowed: error that zones may have, as a share of the brightest light; None:
    all that MOST_MOVED leaves.
    """
    if not lens.pupil.stops:
        return None
    moved = MOST_MOVED if allowed is None else _most_moved(allowed)
    eyes = CatsEyes(lens.pupil, 1e-3 * pixel_pitch_um / lens.image_distance_mm, *sensor_px, most_moved=moved)
    if not eyes.clips(eyes.fields(0.0, 0.0)):
        return None
    return eyes.with_fine_zones(largest_px)
