"""Irradiance that a lens gives each place of the sensor: solid angle, cos^4 and open share of the pupil."""

import numpy as np

from simulator.errors import require
from simulator.optics.pupil.vignetting import light_by_radius
from simulator.sensor.stages.irradiance import Irradiance


def irradiance_behind(lens, pixel_pitch_um: float, width_px: int, height_px: int) -> Irradiance:
    """Return the irradiance stage of a lens whose axis meets the middle of a sensor of this pitch and size."""
    tangent_per_px = 1e-3 * pixel_pitch_um / lens.image_distance_mm
    corner_px = 0.5 * float(np.hypot(width_px, height_px))
    vignetting = light_by_radius(lens.pupil, tangent_per_px * corner_px)
    return Irradiance(
        effective_solid_angle_sr=lens.irradiance_per_radiance_sr(),
        tan2_per_px2=tangent_per_px**2 if lens.cos4 else 0.0,
        centre_x_px=0.5 * width_px,
        centre_y_px=0.5 * height_px,
        vignetting=vignetting,
        nodes_per_px=(len(vignetting) - 1) / corner_px if vignetting else 0.0,
    )


def check_veiling_glare(share: float, key: str) -> None:
    """Raise PhotositeError unless 0 <= share < 1."""
    require(0 <= share < 1, key, share, "give the share of light that is scattered over the sensor, below 1, such as 0.02")
