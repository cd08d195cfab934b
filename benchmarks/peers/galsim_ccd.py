"""GalSim's CCDNoise: Poisson and one read noise, in ADU; the full well and the ADC are NumPy's."""

import galsim
import numpy as np
from measuring.contest import Contestant
from measuring.work import Sensor

NAME = f"GalSim {galsim.__version__} CCDNoise"


def contestant(mean_e: np.ndarray, sensor: Sensor) -> Contestant:
    noise = galsim.CCDNoise(galsim.BaseDeviate(1), gain=1.0 / sensor.gain_dn_per_e, read_noise=sensor.before_e)
    mean_dn, last = mean_e * np.float32(sensor.gain_dn_per_e), {}

    def run() -> None:
        image = galsim.ImageF(mean_dn.copy())
        image.addNoise(noise)
        signal = image.array
        np.minimum(signal, np.float32(sensor.full_well_e * sensor.gain_dn_per_e), out=signal)
        signal += np.float32(sensor.black_level_dn)
        np.rint(signal, out=signal)
        np.clip(signal, 0, sensor.max_code, out=signal)
        last.update(codes=signal.astype(np.uint16))

    return Contestant(NAME, run, lambda: last["codes"])
