"""Irradiance over the sensor behind a lens: projected solid angle on the axis, cos^4 law, rims and measured fall-off."""

import numpy as np

from simulator.errors import require
from simulator.optics.lens.lens import Lens
from simulator.optics.pupil.vignetting import NODES, pupil_area_error, relative_pupil_areas
from simulator.sensor.stages.irradiance import Irradiance


def plan_irradiance(lens: Lens, pixel_pitch_um: float, width_px: int, height_px: int) -> Irradiance:
    """Return the irradiance stage of a lens whose optical axis meets the centre of a sensor of this pitch and size."""
    tangent_per_px = 1e-3 * pixel_pitch_um / lens.image_distance_mm
    corner_px = 0.5 * float(np.hypot(width_px, height_px))
    vignetting = relative_pupil_areas(lens.pupil, tangent_per_px * corner_px)
    if lens.falloff is not None:
        tangent = tangent_per_px * corner_px
        reach = 1.0 if lens.falloff.unit == "half_diagonal" else tangent
        open_ = (
            np.interp(np.linspace(0.0, 1.0, NODES), np.linspace(0.0, 1.0, len(vignetting)), vignetting) if vignetting else 1.0
        )
        vignetting = tuple((open_ * lens.falloff.shares(np.linspace(0.0, reach, NODES))).tolist())
    return Irradiance(
        effective_solid_angle_sr=lens.irradiance_per_radiance_sr(),
        tan2_per_px2=tangent_per_px**2 if lens.cos4 else 0.0,
        centre_x_px=0.5 * width_px,
        centre_y_px=0.5 * height_px,
        vignetting=vignetting,
        nodes_per_px=(len(vignetting) - 1) / corner_px if vignetting else 0.0,
    )


def illumination_error(lens: Lens, pixel_pitch_um: float, width_px: int, height_px: int) -> float:
    """Error of the table of clipped pupils of `plan_irradiance`, as a share of the light on the axis; 0: no rim clips."""
    return pupil_area_error(
        lens.pupil, 1e-3 * pixel_pitch_um / lens.image_distance_mm * 0.5 * float(np.hypot(width_px, height_px))
    )


def check_veiling_glare(share: float, key: str) -> None:
    """Raise PhotositeError unless 0 <= share < 1."""
    require(0 <= share < 1, key, share, "give the share of light that is scattered over the sensor, below 1, such as 0.02")
