"""Limits of the settings that all kinds of scenes have."""

import math

from simulator.errors import require


def check_luminance(luminance: float) -> None:
    """Raise PhotositeError unless a luminance is above 0 and finite [cd m^-2]."""
    require(
        luminance > 0 and math.isfinite(luminance),
        "scene.luminance",
        f"{luminance} cd/m^2",
        "give one above 0, such as 100 cd/m^2",
    )


def check_field_of_view(angle_deg: float | None) -> None:
    """Raise PhotositeError unless an angle is None or between 0 and 180 degrees."""
    inside = angle_deg is None or 0 < angle_deg < 180
    require(inside, "scene.field_of_view", f"{angle_deg} deg", "give the full horizontal angle, above 0 and below 180 deg")
