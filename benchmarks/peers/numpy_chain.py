"""The chain in NumPy: Generator.poisson and standard_normal in float32, in place where NumPy can."""

import numpy as np
from measuring.contest import Contestant
from measuring.work import Sensor

NAME = f"NumPy {np.__version__}"


def frame(mean_e: np.ndarray, sensor: Sensor, rng: np.random.Generator) -> np.ndarray:
    """Codes (height, width) uint16."""
    signal = rng.poisson(mean_e).astype(np.float32)
    np.minimum(signal, np.float32(sensor.full_well_e), out=signal)
    if sensor.before_e:
        signal += np.float32(sensor.before_e) * rng.standard_normal(mean_e.shape, dtype=np.float32)
    signal *= np.float32(sensor.gain_dn_per_e)
    if sensor.after_dn:
        signal += np.float32(sensor.after_dn) * rng.standard_normal(mean_e.shape, dtype=np.float32)
    signal += np.float32(sensor.black_level_dn)
    np.rint(signal, out=signal)
    np.clip(signal, 0, sensor.max_code, out=signal)
    return signal.astype(np.uint16)


def contestant(mean_e: np.ndarray, sensor: Sensor) -> Contestant:
    rng, last = np.random.default_rng(1), {}
    return Contestant(NAME, lambda: last.update(codes=frame(mean_e, sensor, rng)), lambda: last["codes"])
