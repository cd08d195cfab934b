"""Field of view and 35 mm equivalents: what every kind of lens that forms an image has in common."""

import math

FULL_FRAME_DIAGONAL_MM = math.hypot(36.0, 24.0)  # ISO 1007, 135 format
AIRY_ZERO = 1.2196698912665045  # first zero of J1 over pi
GREEN_NM = 550.0  # near the eye's greatest sensitivity


def crop_factor(diagonal_mm: float) -> float:
    """Diagonal of the 135 format over that of the sensor."""
    return FULL_FRAME_DIAGONAL_MM / diagonal_mm


class Perspective:
    """Figures that follow from `image_distance_mm`, `focal_length_mm` and `f_number`, which the lens has."""

    image_distance_mm: float
    focal_length_mm: float
    f_number: float

    def field_of_view_deg(self, extent_mm: float) -> float:
        """Full angle that a sensor of this width, height or diagonal sees [deg]: 2 atan(extent / 2 z_i)."""
        return math.degrees(2.0 * math.atan(0.5 * extent_mm / self.image_distance_mm))

    def focal_length_35mm_mm(self, diagonal_mm: float) -> float:
        """Focal length with the same diagonal field of view on 36 mm x 24 mm, focused at infinity [mm]: f * crop factor."""
        return self.focal_length_mm * crop_factor(diagonal_mm)

    def f_number_35mm(self, diagonal_mm: float) -> float:
        """f-number with the same pupil at the equivalent focal length: N * crop factor.

        The same pupil and field of view give the same blur in shares of the picture, C / diagonal = A (z_i / diagonal)
        |1/z_focus - 1/z|, and the same light in the whole picture.
        """
        return self.f_number * crop_factor(diagonal_mm)
