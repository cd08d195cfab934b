"""getframes: Poisson, read noise, gain, ADC of a CMOS camera; single precision, no truth, buffers used again."""

import getframes
import numpy as np
from getframes.noise import DetectorWorkspace
from measuring.contest import Contestant
from measuring.work import Sensor

NAME = f"getframes {getframes.__version__}"


def contestant(mean_e: np.ndarray, sensor: Sensor) -> Contestant:
    config = getframes.CameraConfig(
        name="benchmark",
        sensor_type="CMOS",
        resolution=mean_e.shape,
        pixel_size_um=5.0,
        quantum_efficiency=1.0,
        full_well_e=sensor.full_well_e,
        bit_depth=sensor.bit_depth,
        gain_e_per_adu=1.0 / sensor.gain_dn_per_e,
        bias_offset_adu=sensor.black_level_dn,
        read_noise_e=sensor.before_e,
        dark_current_e_per_s=0.0,
    )
    camera, workspace = getframes.Camera(config, seed=1, precision="single"), DetectorWorkspace()
    codes = np.empty(mean_e.shape, np.uint32)
    return Contestant(
        NAME, lambda: camera.expose(mean_e, 1.0, include_truth=False, workspace=workspace, out=codes), lambda: codes
    )
