"""A camera that combines readings, and its codes for given mean electrons, without lens and scene."""

from collections.abc import Mapping

import numpy as np

from simulator.device import Device
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.hdr_passes import read_out_combined
from simulator.sensor.hdr_plan import HdrSensorPlan, plan_readings
from simulator.sensor.seeds import Seeds
from simulator.sensor.sensor_plan import SensorPlan, plan_sensor
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Stage

from .camera_builders import small_camera

HIGH, LOW = IsoSetting(1.28, 2.0), IsoSetting(0.08, 1.3)  # 12 bits hold 3149 and 50388 e-, read with 1.56 and 16.25 e-
SHOT_NOISE: Mapping[str, Stage] = {"photon_shot_noise": PhotonShotNoise()}
DUAL_GAIN = HdrReadout(gains=(1.0, 0.0625))
TWO_PHOTODIODES = HdrReadout(light=(1.0, 0.0625))
TWO_EXPOSURES = HdrReadout(exposures=(1.0, 0.0625))


def hdr_plan(readout: HdrReadout | None, width: int, height: int, time_s: float = 1.0, **settings: object) -> SensorPlan:
    """The plan of a camera of 12 bits, black at 64 DN, at ISO 1600; its light is the mean electrons of a second."""
    camera = {"bit_depth": 12, "black_level_dn": 64.0, "iso_table": {100: LOW, 1600: HIGH}, "stages": SHOT_NOISE, **settings}
    plain = plan_sensor(small_camera(width, height, hdr_readout=readout, **camera), (Integration(time_s, 1.0),), 1600, time_s)
    return plan_readings(plain, 1600)


def combined_codes(device: Device, sensor: SensorPlan, electrons: np.ndarray, frame: int = 1) -> np.ndarray:
    """Codes of a frame of mean electrons in the time that the plan has, (height, width) uint16."""
    assert isinstance(sensor, HdrSensorPlan)
    light = device.upload(np.ascontiguousarray(electrons / sensor.exposure.time_s, np.float32))
    return read_out_combined(device, sensor, [light] * len(sensor.exposures), Seeds(2, frame))
