"""Numbers that the camera file predicts for the raw files, and reasons why some of them cannot be measured."""

import math
from dataclasses import replace

from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import SensorPlan
from simulator.sensor.stages.digital_gain import DigitalGain
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.stage import Moments

LEAST_READ_NOISE_DN = 0.5  # below it, rounding dominates (EMVA 1288 sets its limit at a variance of 0.24 DN^2)
CLEAR_SIGMAS = 4.0  # least pedestal in standard deviations of the dark; clips 1 code in 30,000


def expected_gain(camera: Camera, iso: int, sensor: SensorPlan) -> float:
    """K of the camera file at an ISO, times the digital gain if there is one [DN/e-]."""
    digital = sensor.stage("digital_gain")
    return camera.iso_setting(iso).gain_dn_per_e * (digital.factor if isinstance(digital, DigitalGain) else 1.0)


def read_noise_dn(sensor: SensorPlan) -> float:
    """Temporal noise of a photosite in the dark by the camera's stages, without row noise and rounding [DN]."""
    return math.sqrt(max(dark_moments(sensor, rows=False).variance - 1.0 / 12.0, 0.0))


def row_noise_dn(sensor: SensorPlan) -> float:
    """Temporal noise in the dark that is common to all photosites of a row [DN]."""
    return math.sqrt(max(dark_moments(sensor).variance - dark_moments(sensor, rows=False).variance, 0.0))


def dark_moments(sensor: SensorPlan, rows: bool = True) -> Moments:
    """Mean and variance of a dark code [DN, DN^2]. rows: whether row noise is part of the variance."""
    kept = tuple(stage for stage in sensor.stages if rows or not stage.is_common_to_rows)
    return replace(sensor, stages=kept).moments(0.0)


def is_pedestal_sufficient(sensor: SensorPlan) -> bool:
    """Whether the black level is high enough that the noise of dark frames is not clipped at code 0."""
    return is_clear_of_zero(sensor.moments(0.0))


def is_clear_of_zero(dark: Moments) -> bool:
    """Whether codes with these moments, those without light [DN], hardly ever end at code 0."""
    return dark.mean >= CLEAR_SIGMAS * math.sqrt(dark.variance + dark.fixed_variance)


def reason_read_noise_is_unmeasurable(sensor: SensorPlan) -> str:
    """Return why the read noise cannot be measured from the raw files, or an empty string."""
    read_dn, dark, hot = read_noise_dn(sensor), sensor.moments(0.0), sensor.stage("hot_pixels")
    if read_dn < LEAST_READ_NOISE_DN:
        return f"below {LEAST_READ_NOISE_DN} DN, where rounding hides it"
    if not is_pedestal_sufficient(sensor):
        return f"the pedestal of {dark.mean:g} DN is below {CLEAR_SIGMAS:g} standard deviations: the file clips the dark"
    gain = sensor.moments(1.0).mean - dark.mean
    if isinstance(hot, HotPixels) and hot.share * hot.rate_e_per_s * hot.time_s * gain**2 > 0.005 * read_dn**2:
        return "hot pixels add shot noise of their own to it"
    return ""


def reason_gain_is_unmeasurable(sensor: SensorPlan) -> str:
    """Return why K cannot be measured from the raw files, or an empty string."""
    if sensor.readout.crosstalk.electrical_shares != (0.0, 0.0):
        return "neighbours share charge, which smooths the noise that K is measured by"
    return ""


def reason_efficiency_is_unmeasurable(sensor: SensorPlan) -> str:
    """Return why the quantum efficiency of a colour cannot be measured from the raw files, or an empty string."""
    crosstalk, coloured = sensor.readout.crosstalk, sensor.camera.channels > 1
    if coloured and (crosstalk.optical_shares, crosstalk.electrical_shares) != ((0.0, 0.0), (0.0, 0.0)):
        return "neighbours of other colours share their light"
    return reason_gain_is_unmeasurable(sensor)


def reason_linearity_is_unmeasurable(sensor: SensorPlan) -> str:
    """Return why the response is not expected to be linear, or an empty string."""
    return "" if all(stage.is_linear for stage in sensor.stages) else "the camera file says how it is bent"
