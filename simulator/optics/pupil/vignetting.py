"""Mechanical vignetting: round stops before and behind the aperture clip off-axis cones of light.

The cone of light of a photosite at tangent t (x right, y down in the picture) converges at the photosite, at z_i behind the
aperture, and on the other side at the point in focus, at z_o. A ray through u of the pupil crosses a plane a
distance d before the aperture at u a (1 - d / z_o) - t d, in the axes of `Pupil`, and a plane d behind it at
u a (1 - d / z_i) + t d (similar triangles; a: radius of the pupil). So a stop of radius R is a disk in the pupil, of radius
R / (a (1 - d / z)), whose centre moves by +-d / (a (1 - d / z)) per tangent.

All light of a photosite passes that cone, whatever the distance of the scene. Its irradiance is that of the full pupil times
clipped area / full area; the lost light is not renormalised.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.pupil.pupil import Pupil, PupilStop
from simulator.units import Millimetres

NODES = 513  # of relative illumination from the axis to the corner; error below 1e-4 of that on the axis
NODES_OF_BLADES, AZIMUTHS = 129, 8  # with blades; directions within the angle of one blade


@dataclass(frozen=True)
class RoundStop:
    """Rim of a lens element or of the barrel.

    distance_mm: along the axis from the aperture [mm], > 0.
    diameter_mm: clear diameter [mm]; not narrower than the axial cone, or it would be the aperture.
    """

    distance_mm: Millimetres
    diameter_mm: Millimetres


@dataclass(frozen=True)
class Vignetting:
    """Stops that clip spots of light towards the corners to cat's eyes.

    front: stop on the scene's side of the aperture.
    rear: stop on the sensor's side of the aperture.
    """

    front: RoundStop | None = None
    rear: RoundStop | None = None

    def pupil_stops(self, opening: Pupil, radius_mm: float, image_mm: float, focus_mm: float) -> tuple[PupilStop, ...]:
        """Project the stops into the pupil.

        opening: the pupil on the axis. radius_mm: of the round pupil of equal area. image_mm, focus_mm: z_i and z_o [mm].
        Raises PhotositeError for a stop that clips the axial cone, or lies beyond the sensor or the plane in focus.
        """
        sides = (("front", self.front, 1.0, focus_mm), ("rear", self.rear, -1.0, image_mm))
        return tuple(
            _project_stop(stop, f"lens.vignetting.{side}", sign, end_mm, radius_mm, opening.corner_radius)
            for side, stop, sign, end_mm in sides
            if stop is not None
        )


def _project_stop(stop: RoundStop, key: str, sign: float, end_mm: float, radius_mm: float, corner: float) -> PupilStop:
    """Project a stop into the pupil along the cone that ends at end_mm; see the module for the formula."""
    distance_mm, diameter_mm = stop.distance_mm, stop.diameter_mm
    rule = f"lies between the aperture and what is {end_mm:g} mm from it; give a distance above 0 mm and below that"
    require(0 < distance_mm < end_mm, f"{key}.distance", f"{distance_mm:g} mm", rule)
    cone_mm = radius_mm * (1.0 - distance_mm / end_mm)
    if not 2.0 * cone_mm * corner <= diameter_mm < math.inf:
        raise PhotositeError(
            "narrower than the light on the axis, so that it, not lens.f_number, would "
            f"be the aperture; give {2.0 * cone_mm * corner:.4g} mm or more, or a larger f-number",
            key=f"{key}.diameter",
            value=f"{diameter_mm:g} mm",
        )
    return PupilStop(0.5 * diameter_mm / cone_mm, sign * distance_mm / cone_mm)


@lru_cache(maxsize=64)
def relative_pupil_areas(pupil: Pupil, tangent: float) -> tuple[float, ...]:
    """Clipped over full area of the pupil, at even steps of the tangent of the field angle from 0 to `tangent`.

    With blades this depends on the direction; the mean over directions is returned. Empty without stops.
    """
    if not pupil.stops:
        return ()
    if pupil.blades is None:
        return tuple(pupil.area((step, 0.0)) / math.pi for step in np.linspace(0.0, tangent, NODES))
    angles = 2.0 * math.pi / pupil.blades * (np.arange(AZIMUTHS) + 0.5) / AZIMUTHS + math.radians(pupil.rotation_deg)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    return tuple(
        float(np.mean([pupil.area(step * direction) for direction in directions])) / math.pi
        for step in np.linspace(0.0, tangent, NODES_OF_BLADES)
    )


@lru_cache(maxsize=64)
def pupil_area_error(pupil: Pupil, tangent: float) -> float:
    """Largest error of `relative_pupil_areas` where a frame reads it, as a share of the area on the axis; 0 without stops.

    A line between nodes errs by an eighth of the second difference, and by a quarter of it where a rim begins to clip. With
    blades the mean over directions stands for each of them.
    """
    table = np.array(relative_pupil_areas(pupil, tangent))
    if not len(table):
        return 0.0
    between = 0.25 * float(np.abs(np.diff(table, 2)).max())
    if pupil.blades is None:
        return between
    turns = np.arange(2 * AZIMUTHS) / (2 * AZIMUTHS)  # corners and middles of the sides are among them
    angles = 2.0 * math.pi / pupil.blades * turns + math.radians(pupil.rotation_deg)
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    steps = range(0, len(table), 2)
    areas = [[pupil.area(tangent * step / (len(table) - 1) * one) / math.pi for one in directions] for step in steps]
    return between + float(np.abs(np.array(areas) - table[::2, None]).max())
