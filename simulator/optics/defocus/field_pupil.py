"""Cat's eyes: the pupil that a photosite sees, by its place on the sensor.

The sensor is divided into square zones. The shape is known at their corners, and a photosite's mean is that of the four corners
around it, bilinear in its place: no step anywhere, and an error of second order in how far a rim moves across a zone. Zones
begin at the sensor's upper left corner, so that a crop has those of the whole frame.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from simulator.optics.lens.lens import Lens
from simulator.optics.pupil.pupil import Pupil

ZONES_PX = (128, 64, 32, 16)  # sides of a zone, coarsest first; a tile has a whole number of them
MOST_MOVED = 0.02  # movement of a rim across a zone, in pupil radii: edges are right to 0.1 sigma of 2000 e-
MOST_MOVED_OF_LIGHTS = 0.005  # the same across a square in which spots of lights have one shape
FINEST = 0.25  # of the largest blur circle's radius: zones need not be smaller
SHUT = 1e-3  # share of the pupil below which a photosite counts as dark
TRIED = 256  # points of the pupil of which one must pass


@dataclass(frozen=True)
class CatsEyes:
    """Pupil by place on a sensor.

    pupil: with its stops. tangent_per_px: of the field angle, per photosite from the middle of the sensor.
    width_px, height_px: of the sensor. zone_px: side of a zone.
    """

    pupil: Pupil
    tangent_per_px: float
    width_px: int
    height_px: int
    zone_px: int = ZONES_PX[0]

    def fields(self, x_px, y_px) -> np.ndarray:
        """Tangents of the field angle, (..., 2), at a place from the sensor's upper left corner [px]."""
        x, y = np.broadcast_arrays(
            np.asarray(x_px, float) - 0.5 * self.width_px, np.asarray(y_px, float) - 0.5 * self.height_px
        )
        return self.tangent_per_px * np.stack([x, y], axis=-1)

    def clips(self, fields: np.ndarray) -> np.ndarray:
        """Whether a stop may hide a part of the aperture at these fields (..., 2)."""
        distance, corner = np.hypot(fields[..., 0], fields[..., 1]), self.pupil.corner_radius
        reach = [corner + abs(stop.shift) * distance > stop.radius for stop in self.pupil.stops]
        return np.logical_or.reduce(reach)

    def open_fields(self, fields: np.ndarray) -> np.ndarray:
        """These fields (n, 2); for one at which the pupil is shut, the farthest on the way to it from the axis where it is not.

        No light is there. Its neighbours, which have a little, need a shape to mix with.
        """
        points = self.pupil.points(TRIED)
        passed = np.ones((len(fields), TRIED), bool)
        for stop in self.pupil.stops:
            passed &= ((points - stop.shift * fields[:, None]) ** 2).sum(axis=2) <= stop.radius**2
        return np.array(
            [field if open_ else self._open_field(field) for field, open_ in zip(fields, passed.any(axis=1), strict=True)]
        )

    def _open_field(self, field: np.ndarray) -> np.ndarray:
        inner, outer = 0.0, 1.0
        for _ in range(20):
            middle = 0.5 * (inner + outer)
            shut = self.pupil.area(middle * field) < SHUT * math.pi
            inner, outer = (inner, middle) if shut else (middle, outer)
        return inner * field

    def movement(self, zone_px: float) -> float:
        """How far a rim moves in the pupil across so many photosites, in pupil radii."""
        return max(abs(stop.shift) for stop in self.pupil.stops) * self.tangent_per_px * zone_px

    @property
    def alike_px(self) -> int:
        """Side of squares of the sensor in which spots of lights share their shape."""
        return max(1, int(MOST_MOVED_OF_LIGHTS / self.movement(1.0)))


def plan_cats_eyes(lens: Lens, pixel_pitch_um: float, sensor_px: tuple[int, int], largest_px: float) -> CatsEyes | None:
    """Pupil by place on a sensor of (width, height) photosites, or None where no rim hides anything of it.

    largest_px: radius of the largest blur circle.
    """
    if not lens.pupil.stops:
        return None
    eyes = CatsEyes(lens.pupil, 1e-3 * pixel_pitch_um / lens.image_distance_mm, *sensor_px)
    if not eyes.clips(eyes.fields(0.0, 0.0)):
        return None

    def fine(zone_px: int) -> bool:
        return eyes.movement(zone_px) <= MOST_MOVED or zone_px <= FINEST * largest_px

    return replace(eyes, zone_px=next((zone_px for zone_px in ZONES_PX if fine(zone_px)), ZONES_PX[-1]))
