"""Field of view and 35 mm equivalents: common to every lens that forms an image."""

import math
from typing import Protocol

FULL_FRAME_DIAGONAL_MM = math.hypot(36.0, 24.0)  # ISO 1007, 135 format
AIRY_ZERO = 1.2196698912665045  # first zero of J1 over pi
GREEN_NM = 550.0  # near the eye's greatest sensitivity


def crop_factor(diagonal_mm: float) -> float:
    """Diagonal of the 135 format over that of the sensor."""
    return FULL_FRAME_DIAGONAL_MM / diagonal_mm


class ImageScale(Protocol):
    """What the methods of Perspective need from the class that inherits them."""

    @property
    def image_distance_mm(self) -> float:
        """Lens to sensor z_i [mm]."""
        ...

    @property
    def focal_length_mm(self) -> float:
        """Focal length f [mm]."""
        ...

    @property
    def f_number(self) -> float:
        """N."""
        ...


class Perspective:
    """Mixin: field of view and 35 mm equivalents of a lens with image distance, focal length and f-number."""

    def field_of_view_deg(self: ImageScale, extent_mm: float) -> float:
        """Full angle that a sensor of this width, height or diagonal sees [deg]: 2 atan(extent / 2 z_i)."""
        return math.degrees(2.0 * math.atan(0.5 * extent_mm / self.image_distance_mm))

    def field_m(self: ImageScale, extent_mm: float, depth_m: float) -> float:
        """Width, height or diagonal that a sensor of this extent sees of a plane at a distance [m]: extent z / z_i."""
        return extent_mm * depth_m / self.image_distance_mm

    def focal_length_35mm_mm(self: ImageScale, diagonal_mm: float) -> float:
        """Focal length with the same diagonal field of view on 36 mm x 24 mm, focused at infinity [mm]: f * crop factor."""
        return self.focal_length_mm * crop_factor(diagonal_mm)

    def f_number_35mm(self: ImageScale, diagonal_mm: float) -> float:
        """f-number with the same pupil at the equivalent focal length: N * crop factor.

        The same pupil and field of view give the same blur in shares of the picture, C / diagonal = A (z_i / diagonal)
        |1/z_focus - 1/z|, and the same light in the whole picture.
        """
        return self.f_number * crop_factor(diagonal_mm)
