"""The work that contestants do: light levels, sensors, and the moments that a right frame has."""

import math
from dataclasses import dataclass

import numpy as np

LIGHT = {  # mean electrons: log-uniform between these per photosite, in smooth ramps as pictures have them
    "daylight": (50.0, 5e4),
    "dusk": (1.0, 1e3),
    "night": (0.1, 30.0),
}


@dataclass(frozen=True)
class Sensor:
    """A sensor: Poisson, full well, read noise before the gain, gain, read noise after it, row noise, colour bias, ADC.

    tukey_lambda: shape of the noise after the gain; None: Gaussian. after_dn is its standard deviation in both cases.
    color_bias_dn: offset for each place of the 2x2 block, row by row.
    """

    full_well_e: float
    gain_dn_per_e: float
    before_e: float = 0.0
    after_dn: float = 0.0
    tukey_lambda: float | None = None
    row_dn: float = 0.0
    color_bias_dn: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    black_level_dn: float = 512.0
    bit_depth: int = 14

    @property
    def max_code(self) -> int:
        """Largest code."""
        return 2**self.bit_depth - 1

    @property
    def tukey_scale_dn(self) -> float:
        """Scale of scipy.stats.tukeylambda that gives the standard deviation after_dn."""
        from scipy import stats

        return self.after_dn / float(stats.tukeylambda.std(self.tukey_lambda))

    def color_bias(self, shape: tuple[int, int]) -> np.ndarray:
        """Colour bias of a frame, (height, width) float32 [DN]."""
        block = np.asarray(self.color_bias_dn, np.float32).reshape(2, 2)
        return np.tile(block, (-(-shape[0] // 2), -(-shape[1] // 2)))[: shape[0], : shape[1]]

    def check(self, codes: np.ndarray, mean_e: np.ndarray) -> tuple[float, float]:
        """Mean error in sigma and variance ratio of a frame against the model, where nothing clips: (0, 1) is right."""
        mean = mean_e.astype(np.float64) * self.gain_dn_per_e + self.color_bias(mean_e.shape) + self.black_level_dn
        variance = self.gain_dn_per_e**2 * (mean_e.astype(np.float64) + self.before_e**2) + 1 / 12
        variance += self.after_dn**2 + self.row_dn**2
        sigma = np.sqrt(variance)
        inside = (mean - 7 * sigma > 0) & (mean + 7 * sigma < self.max_code) & (mean_e * 1.1 + 300 < self.full_well_e)
        residual = (codes.astype(np.float64)[inside] - mean[inside]) / sigma[inside]
        return float(residual.mean()), float((residual**2).mean())


# Sony A7S II at ISO 1600 as PMN measured it (Feng et al. 2022): gain, read noise, its Tukey-lambda shape, row noise. The ELD
# model (Wei et al. 2020) adds colour bias, here of the size that LED publishes (Jin et al. 2023: -1.9 to 4.1 DN).
ELD = Sensor(
    full_well_e=1e9,
    gain_dn_per_e=1.5301,
    after_dn=6.299,
    tukey_lambda=-0.044,
    row_dn=0.989,
    color_bias_dn=(-1.9, 0.3, 1.2, 4.1),
)
# The same camera at ISO 100: 10.53 e- of read noise in all, in two sources, and in one for simulators that have one.
CHAIN = Sensor(full_well_e=1.66e5, gain_dn_per_e=0.09563, before_e=4.0, after_dn=0.932)
ONE_READ_NOISE = Sensor(full_well_e=1.66e5, gain_dn_per_e=0.09563, before_e=10.53)


def ramp(megapixels: float, low_e: float, high_e: float) -> np.ndarray:
    """Mean electrons rising in log steps from left to right: (height, width) float32, 4:3."""
    height = int(math.sqrt(megapixels * 1e6 * 3 / 4)) // 4 * 4
    row = np.exp(np.linspace(math.log(low_e), math.log(high_e), height * 4 // 3))
    return np.ascontiguousarray(np.broadcast_to(row, (height, len(row))), dtype=np.float32)
