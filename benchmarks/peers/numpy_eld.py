"""The ELD model in NumPy: with scipy.stats.tukeylambda.rvs, and with its quantile function written by hand in float32."""

from collections.abc import Callable

import numpy as np
import scipy
from measuring.contest import Contestant
from measuring.work import Sensor
from scipy import stats

SCIPY = f"SciPy {scipy.__version__} tukeylambda.rvs"
QUANTILE = f"NumPy {np.__version__} quantile by hand"
Noise = Callable[[Sensor, tuple[int, ...], np.random.Generator], np.ndarray]


def by_scipy(sensor: Sensor, shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Tukey-lambda noise as SciPy's users write it."""
    return stats.tukeylambda.rvs(sensor.tukey_lambda, scale=sensor.tukey_scale_dn, size=shape, random_state=rng)


def by_quantile(sensor: Sensor, shape: tuple[int, ...], rng: np.random.Generator) -> np.ndarray:
    """Q(u) = scale (u^lambda - (1 - u)^lambda) / lambda (Joiner and Rosenblatt 1971), u kept off 0 and 1."""
    u = rng.random(shape, dtype=np.float32)
    np.clip(u, np.float32(2**-25), np.float32(1 - 2**-24), out=u)
    power = np.float32(sensor.tukey_lambda)
    noise = u**power
    noise -= (1 - u) ** power
    noise *= np.float32(sensor.tukey_scale_dn / sensor.tukey_lambda)
    return noise


def frame(mean_e: np.ndarray, sensor: Sensor, rng: np.random.Generator, tukey_lambda: Noise) -> np.ndarray:
    """Codes (height, width) uint16."""
    signal = rng.poisson(mean_e).astype(np.float32)
    signal *= np.float32(sensor.gain_dn_per_e)
    signal += tukey_lambda(sensor, mean_e.shape, rng)
    signal += np.float32(sensor.row_dn) * rng.standard_normal((mean_e.shape[0], 1), dtype=np.float32)
    for place, bias in enumerate(sensor.color_bias_dn):
        signal[place // 2 :: 2, place % 2 :: 2] += np.float32(bias)
    signal += np.float32(sensor.black_level_dn)
    np.rint(signal, out=signal)
    np.clip(signal, 0, sensor.max_code, out=signal)
    return signal.astype(np.uint16)


def _contestant(name: str, tukey_lambda: Noise, mean_e: np.ndarray, sensor: Sensor) -> Contestant:
    rng, last = np.random.default_rng(1), {}
    return Contestant(name, lambda: last.update(codes=frame(mean_e, sensor, rng, tukey_lambda)), lambda: last["codes"])


def contestants(mean_e: np.ndarray, sensor: Sensor) -> list[Contestant]:
    return [_contestant(SCIPY, by_scipy, mean_e, sensor), _contestant(QUANTILE, by_quantile, mean_e, sensor)]
