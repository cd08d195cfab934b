"""Mean and variances of the code over the photoelectrons, as the stages of a sensor declare them."""

import math

import numpy as np

from simulator.sensor.camera.camera import Camera
from simulator.sensor.code_variance import clipped_moments
from simulator.sensor.hdr_plan import HdrSensorPlan, plan_readings
from simulator.sensor.hdr_variance import combined_variance
from simulator.sensor.iso_speed import saturation_exposure_lx_s
from simulator.sensor.sensor_plan import SensorPlan, plan_sensor
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.stage import Moments

CLEAR_SIGMAS = 4.0  # a code this far below white is clipped once in 30,000 frames


def sensor_alone(camera: Camera, iso: float, exposure_time_s: float) -> SensorPlan:
    """Return the plan of a camera's sensor at an ISO and an exposure time [s], without lens and scene.

    Raises PhotositeError for an ISO that the camera does not have.
    """
    light = [Integration(exposure_time_s, camera.pixel_pitch_um**2 * camera.fill_factor)]
    return plan_readings(plan_sensor(camera, light, iso, exposure_time_s), iso)


def code_moments(sensor: SensorPlan, electrons: np.ndarray) -> Moments:
    """Return mean [DN], temporal and fixed-pattern variance [DN^2] of the code, each (n,) float64.

    electrons: mean photoelectrons of a photosite (n,) float64 [e-]; of several exposures, those of the longest.
    The moments are those of the stages (EMVA 1288 R4.0, eq. 9), clipped as the sensor clips (`clipped_moments`); of an HDR
    read-out the temporal variance is that of the combined signal (`combined_variance`).
    """
    if not isinstance(sensor, HdrSensorPlan):
        return clipped_moments(sensor.moment_steps(), electrons)
    used = [_reading_moments(sensor, float(one)) for one in electrons]
    spec = sensor.spec
    shares = {which: spec.exposures[place] * spec.light[place] for place, which in reversed([*enumerate(spec.exposure_of)])}
    light = [np.asarray(electrons * shares[exposure], np.float32)[np.newaxis] for exposure in sorted(shares)]
    variance = combined_variance(sensor, light)[0].astype(np.float64)
    mean, fixed = (np.array([getattr(one, name) for one in used]) for name in ("mean", "fixed_variance"))
    return Moments(mean, variance, fixed)


def _reading_moments(sensor: HdrSensorPlan, mean_electrons: float) -> Moments:
    steps, own_e = sensor.steps_at(mean_electrons)
    signal = Moments(own_e, 0.0)
    for step in steps:
        signal = step.moments(signal)
    return signal


def electrons_below_white(sensor: SensorPlan, least_e: float, count: int) -> np.ndarray:
    """Return mean photoelectrons in even ratios from least_e up to where noise begins to clip at white, (count,) float64 [e-].

    The last is the largest whose mean code lies CLEAR_SIGMAS standard deviations below the white level. Raises no error for a
    sensor that dark current fills: it returns an empty array.
    """
    white_dn, top_e = sensor.white_level_dn(), sensor.electrons_at_white()
    if top_e <= least_e:
        return np.empty(0)
    near_e = np.geomspace(least_e, top_e, 4 * count)
    found = code_moments(sensor, near_e)
    clear = found.mean + CLEAR_SIGMAS * np.sqrt(found.variance) < white_dn
    return np.geomspace(least_e, near_e[clear][-1], count) if clear.any() else np.empty(0)


def electrons_per_lx_s(sensor: SensorPlan) -> float:
    """Return photoelectrons per luminous exposure in daylight (D55) of the first colour to saturate [e- / lx s]; 0: none.

    The exposure that saturates (`saturation_exposure_lx_s`, ISO 12232:2019) is that of full_scale / K photoelectrons.
    """
    saturation = saturation_exposure_lx_s(sensor)
    return sensor.full_scale_dn() / sensor.gain_dn_per_e() / saturation if math.isfinite(saturation) else 0.0
