"""Saturation exposure and baseline exposure of a camera at an ISO setting (ISO 12232:2019)."""

import math

from simulator.color.camera_matrices import camera_response
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, luminance_cd_m2
from simulator.sensor.sensor_plan import SensorPlan

MIDDLE_GREY = 0.18  # of white: level 118 of 255 in sRGB, which defines the standard output sensitivity
EXPOSURE_LX_S = 10.0  # luminous exposure of middle grey at ISO 1: recommended exposure index = 10 lx s / H
SATURATION_LX_S = 78.0  # luminous exposure that saturates at ISO 1: 100 / 18 * sqrt(2) * 10 lx s, rounded by the standard
METERED_LEVEL = EXPOSURE_LX_S / SATURATION_LX_S  # of white, of what a meter exposes for: 0.128


def saturation_based_speed(saturation_lx_s: float) -> float:
    """Return the ISO speed 78 lx s / H_sat, which leaves half a stop above a white surface."""
    return SATURATION_LX_S / saturation_lx_s


def standard_output_sensitivity(middle_grey_lx_s: float) -> float:
    """Return the sensitivity 10 lx s / H of the exposure that gives the output level 118 of 255 in sRGB: 0.18 of white."""
    return EXPOSURE_LX_S / middle_grey_lx_s


def saturation_exposure_lx_s(sensor: SensorPlan) -> float:
    """Return the luminous exposure in daylight (D55) at which the first colour channel reaches the white level [lx s].

    Infinite for a camera that does not respond to this light. 78 lx s divided by it is the saturation-based ISO speed.
    """
    camera, response = sensor.camera, sensor.camera.response
    light = illuminant("D55")
    electrons = camera_response(light[None], WAVELENGTHS_NM, response.wavelengths_nm, response.quantum_efficiency)
    per_joule = float(electrons.max())  # electrons per unit of light on a square metre
    electrons_per_lx_s = 1e-12 * camera.pixel_pitch_um**2 * camera.fill_factor * per_joule / float(luminance_cd_m2(light))
    dn_per_lx_s = sensor.gain_dn_per_e() * electrons_per_lx_s
    return sensor.full_scale_dn() / dn_per_lx_s if dn_per_lx_s > 0 else math.inf


def baseline_exposure_ev(sensor: SensorPlan, iso: float) -> float | None:
    """Return the exposure compensation [EV] that renders middle grey, exposed for this ISO, as 18 % (DNG 1.4).

    BaselineExposure = log2(0.18 H_sat ISO / 10 lx s): 0.49 EV where the ISO is the saturation-based speed, which leaves half
    a stop above white. None for a camera that does not respond to daylight.
    """
    gain = MIDDLE_GREY * saturation_exposure_lx_s(sensor) * iso / EXPOSURE_LX_S
    return math.log2(gain) if 0 < gain < math.inf else None
