"""The published noise of the Sony A7S II in float64 NumPy and SciPy: what to compare with. Nothing of the simulator is in here.

Model: Wei, Fu, Zheng, Yang, "Physics-based Noise Modeling for Extreme Low-light Photography", TPAMI 2021 (ELD), without its
colour bias: code = black + K Poisson(n) + Tukey-lambda(shape, scale) + N(0, row) of the row, rounded.
Numbers: Feng, Wang, Wang, Fan, Huang, "Learnability Enhancement for Low-light Raw Denoising", ACM MM 2022 (PMN), as released:
megvii-research/PMN@d207d3e, data_process/process.py, camera parameters of the Sony A7S II.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

BLACK_DN, LARGEST_CODE = 512, 16383
NODES = 41  # of the quadrature over row noise: exact for polynomials up to degree 81


@dataclass(frozen=True)
class Published:
    """Noise at one ISO.

    gain_dn_per_e: K [DN/e-]. tukey_lambda, tukey_scale_dn: shape and scale of the read noise. gaussian_dn: standard
    deviation of a normal distribution fitted to the same read noise [DN]. row_noise_dn: standard deviation that the
    photosites of a row share [DN].
    """

    gain_dn_per_e: float
    tukey_lambda: float
    tukey_scale_dn: float
    gaussian_dn: float
    row_noise_dn: float

    @property
    def read_noise_dn(self) -> float:
        """Standard deviation of the Tukey-lambda part [DN]."""
        return float(self.tukey_scale_dn * stats.tukeylambda.std(self.tukey_lambda))

    def with_gaussian_width(self) -> "Published":
        """Return the same shape with the standard deviation of the Gaussian fit, which is up to 1.1 % smaller."""
        return replace(self, tukey_scale_dn=self.gaussian_dn / float(stats.tukeylambda.std(self.tukey_lambda)))

    def variance_dn2(self, mean_e: float | np.ndarray) -> float | np.ndarray:
        """Variance of a code about its mean with everything in it [DN^2], shape of mean_e [e-]."""
        return self.gain_dn_per_e**2 * mean_e + self.read_noise_dn**2 + self.row_noise_dn**2 + 1.0 / 12.0

    def codes(self, mean_e: np.ndarray, draw: np.random.Generator) -> np.ndarray:
        """Draw codes (..., height, width) uint16 of mean electrons of that shape; the second last axis counts rows."""
        shape = mean_e.shape
        signal = self.gain_dn_per_e * draw.poisson(mean_e)
        share = draw.random(shape)
        share[share == 0.0] = 0.5  # a quantile at 0 is infinite for negative shapes
        signal += self.tukey_scale_dn * stats.tukeylambda.ppf(share, self.tukey_lambda)
        signal += self.row_noise_dn * draw.standard_normal((*shape[:-1], 1))
        return np.clip(np.rint(BLACK_DN + signal), 0, LARGEST_CODE).astype(np.uint16)

    def dark_below(self, value_dn: np.ndarray) -> np.ndarray:
        """Probability that dark noise before rounding lies below a value [DN]: Tukey-lambda and row noise folded."""
        nodes, weights = np.polynomial.hermite_e.hermegauss(NODES)
        shifted = (value_dn[..., np.newaxis] - self.row_noise_dn * nodes) / self.tukey_scale_dn
        return special.tklmbda(shifted, self.tukey_lambda) @ (weights / weights.sum())

    def shares(self, codes: np.ndarray, mean_e: float = 0.0) -> np.ndarray:
        """Probability of whole codes, rising by one, at this mean; what lies beyond belongs to the first and the last."""
        counts = np.arange(stats.poisson.ppf(1e-13, mean_e), stats.poisson.ppf(1.0 - 1e-13, mean_e) + 1.0)
        edges = codes[:-1] + 0.5 - BLACK_DN
        below = sum(
            share * self.dark_below(edges - self.gain_dn_per_e * count)
            for count, share in zip(counts, stats.poisson.pmf(counts, mean_e), strict=True)
        )
        return np.diff(np.concatenate([[0.0], below, [1.0]]))


SONY_A7S2 = {
    50: Published(0.047815, 0.1474653, 0.70727646, 1.0164667, 0.13997398),
    64: Published(0.0612032, 0.13243394, 0.71535635, 1.0509665, 0.14346549),
    80: Published(0.076504, 0.1121489, 0.7799473, 1.180899, 0.19540153),
    100: Published(0.09563, 0.14875287, 0.70181876, 1.0067395, 0.1391465),
    125: Published(0.1195375, 0.12904578, 0.6961967, 1.0279676, 0.14485553),
    160: Published(0.153008, 0.094135, 0.7258587, 1.1293099, 0.19755602),
    200: Published(0.19126, 0.07902429, 0.8117464, 1.2926387, 0.22815849),
    250: Published(0.239075, 0.051688068, 0.8630922, 1.4345995, 0.26271912),
    320: Published(0.306016, 0.040700804, 1.0334468, 1.7481371, 0.3097104),
    400: Published(0.38252, 0.0222538, 1.1816813, 2.0595572, 0.36209714),
    500: Published(0.47815, -0.0031342343, 1.31772, 2.3956928, 0.42528257),
    640: Published(0.612032, 0.002566592, 1.6474211, 2.9662898, 0.48839623),
    800: Published(0.76504, -0.008199721, 1.9346539, 3.5475867, 0.5723769),
    1000: Published(0.9563, -0.021061005, 2.2795107, 4.2727833, 0.6845563),
    1250: Published(1.195375, -0.032423194, 2.708437, 5.177596, 0.8177013),
    1600: Published(1.53008, -0.0441045, 3.2283993, 6.29925, 0.988786),
    2000: Published(1.9126, -0.012963797, 1.4356787, 2.653871, 0.33124214),
    2500: Published(2.39075, -0.027097283, 1.6897862, 3.200225, 0.38264316),
    3200: Published(3.06016, -0.034863412, 2.0417721, 3.9193838, 0.44543457),
    4000: Published(3.8252, -0.043700505, 2.4629273, 4.8015847, 0.52347374),
    5000: Published(4.7815, -0.053150143, 2.9761007, 5.8995814, 0.6190265),
    6400: Published(6.12032, -0.07517104, 3.4502964, 7.1163535, 0.7218788),
    8000: Published(7.6504, -0.08208357, 4.269624, 8.916516, 0.87760293),
    10000: Published(9.563, -0.073289566, 5.495318, 11.291476, 1.0522343),
    12800: Published(12.24064, -0.06495205, 7.038261, 14.245901, 1.2749791),
    16000: Published(15.3008, -0.060692135, 8.877547, 17.833515, 1.5559287),
    20000: Published(19.126, -0.060213074, 11.002351, 22.084776, 1.8810822),
    25600: Published(24.48128, -0.09089118, 12.175712, 25.853043, 2.2760193),
}
