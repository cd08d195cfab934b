"""The ideal thin lens: one object for focus, field of view, blur circle and irradiance.

Distances are along the optical axis. Sources: 1/f = 1/z_i + 1/z_o (Gauss); irradiance by ISETCam's
form E = pi L tau / (1 + 4 N^2 (1 + |m|)^2), exact on the axis of a uniform disk pupil, or the aplanatic
form E = pi L tau / (4 N^2 (1 + |m|)^2), exact when the sine condition holds.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from simulator.distortion import Distortion
from simulator.errors import PhotositeError, require
from simulator.stage import Moments, Stage
from simulator.units import FNumber, Metres, Millimetres

FULL_FRAME_DIAGONAL_MM = math.hypot(36.0, 24.0)  # ISO 1007, 135 format


@dataclass(frozen=True)
class ThinLens:
    """Thin lens focused by moving the sensor.

    focal_length_mm: f [mm], > 0.
    f_number: N = f / pupil diameter, >= 0.5 (a lens in air cannot be faster).
    focus_distance_m: lens to the plane in focus, along the axis [m], > f; inf is allowed.
    transmittance: tau, share of light the glass lets through, 0 < tau <= 1.
    irradiance: which of the two formulas above.
    cos4: whether irradiance falls with the fourth power of the cosine of the field angle.
    model: name for the file's metadata.
    distortion: geometric distortion and lateral colour.
    """

    focal_length_mm: Millimetres
    f_number: FNumber
    focus_distance_m: Metres = math.inf
    transmittance: float = 1.0
    irradiance: Literal["thin_lens", "aplanatic"] = "thin_lens"
    cos4: bool = True
    model: str = "thin lens"
    distortion: Distortion | None = None

    def __post_init__(self):
        require(self.focal_length_mm > 0, "lens.focal_length", f"{self.focal_length_mm} mm", "give a length above 0 mm")
        require(
            self.f_number >= 0.5,
            "lens.f_number",
            f"f/{self.f_number:g}",
            "no lens in air is faster than f/0.5; give f/0.5 or more",
        )
        require(0 < self.transmittance <= 1, "lens.transmittance", self.transmittance, "give a share above 0 and up to 1")
        if not self.focus_distance_m * 1e3 > self.focal_length_mm:
            raise PhotositeError(
                f"lens.focus_distance = {self.focus_distance_m:g} m: nothing nearer than the focal length "
                f"({self.focal_length_mm:g} mm) can be brought into focus; give more than {self.focal_length_mm / 1e3:g} m"
            )

    @property
    def image_distance_mm(self) -> float:
        """Lens to sensor: z_i = 1 / (1/f - 1/z_o) [mm]."""
        return 1.0 / (1.0 / self.focal_length_mm - 1e-3 / self.focus_distance_m)

    @property
    def magnification(self) -> float:
        """|m| = z_i / z_o at the plane in focus."""
        return self.image_distance_mm / (self.focus_distance_m * 1e3)

    @property
    def pupil_diameter_mm(self) -> float:
        """A = f / N [mm]."""
        return self.focal_length_mm / self.f_number

    def irradiance_per_radiance_sr(self) -> float:
        """E / L on the axis [sr]."""
        working = 4.0 * (self.f_number * (1.0 + self.magnification)) ** 2
        return math.pi * self.transmittance / (working + (1.0 if self.irradiance == "thin_lens" else 0.0))

    def field_of_view_deg(self, extent_mm: float) -> float:
        """Full angle that a sensor of this extent sees [deg]: 2 atan(extent / 2 z_i)."""
        return math.degrees(2.0 * math.atan(0.5 * extent_mm / self.image_distance_mm))

    def focal_length_35mm_mm(self, diagonal_mm: float) -> float:
        """Focal length with the same diagonal field of view on 36 mm x 24 mm [mm]."""
        return self.focal_length_mm * FULL_FRAME_DIAGONAL_MM / diagonal_mm

    def blur_radius_um(self, depth_m):
        """Signed radius of the blur circle on the sensor [um]; positive behind the plane in focus.

        C/2 = (A/2) z_i (1/z_focus - 1/z): linear in the inverse of the distance (similar triangles).
        depth_m: float or array, > 0; inf is allowed.
        """
        diopters = 1.0 / self.focus_distance_m - 1.0 / np.asarray(depth_m, dtype=np.float64)
        return 0.5 * self.pupil_diameter_mm * self.image_distance_mm * diopters


@dataclass(frozen=True)
class Irradiance(Stage):
    """Electron irradiance on the sensor = electron radiance * solid angle * cos^4 of the field angle.

    solid_angle_sr: E / L on the axis [sr], from ThinLens.irradiance_per_radiance_sr.
    tan2_per_px2: (pixel pitch / image distance)^2, so that tan^2 of the field angle is r^2 of it; 0 without cos^4.
    centre_x_px, centre_y_px: the optical axis in photosites from the sensor's upper left corner.
    """

    stem: ClassVar[str] = "irradiance"
    solid_angle_sr: float
    tan2_per_px2: float
    centre_x_px: float
    centre_y_px: float

    def moments(self, signal: Moments) -> Moments:
        """On the axis."""
        return Moments(signal.mean * self.solid_angle_sr, signal.variance * self.solid_angle_sr**2)
