"""Distribution of the read noise: Tukey's lambda by maximum likelihood from differences of integer codes.

Tukey-lambda noise has the quantile function scale * (p^lambda - (1 - p)^lambda) / lambda (Joiner and Rosenblatt 1971).
lambda 0.14 is close to normal, 0 is logistic, below 0 the tails are heavy. The standard deviation is scale * std(lambda), in
cameras 1.4 to 2.2 times the scale.

The likelihood is that of the difference of two frames, which contains no fixed pattern: the sum of two independent
Tukey-lambda variables and two rounding errors, each uniform within one code.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize, signal

from simulator.measurement.statistics.interval import Interval, Z, normal_interval
from simulator.sensor.stages.tukey_lambda_polynomial import GREATEST_LAMBDA, LEAST_LAMBDA, tukey_lambda_deviation

LEAST_SIGMA_DN = 0.2  # noise below it changes too few codes for a fit
_CELLS_PER_SIGMA = 24
_TAIL = 1e-13
_OUTLIER_SHARE = 1e-12  # least probability of a cell: bounds the weight of outliers, and exceeds the rounding errors of the FFT
_MOST_RESIDUALS = 2_000_000  # standard error of lambda 0.001, smaller than its difference between two frames of one camera


@dataclass(frozen=True)
class TukeyLambda:
    """A fitted Tukey-lambda distribution.

    shape: lambda. sigma_dn: standard deviation without rounding [DN]. scale_dn: scale of the quantile function [DN].
    """

    shape: Interval
    sigma_dn: Interval
    scale_dn: float


def fit_tukey_lambda(residuals_dn: np.ndarray) -> TukeyLambda | None:
    """Fit lambda and standard deviation to the differences of dark pairs about their row means (`row_residuals`).

    residuals_dn: (n,) [DN]. Intervals follow from the curvature of the likelihood (Fisher information). lambda is limited to
    the range that the sensor stage can simulate, LEAST_LAMBDA to GREATEST_LAMBDA. None below LEAST_SIGMA_DN.
    """
    residuals_dn = residuals_dn[:: max(1, math.ceil(residuals_dn.size / _MOST_RESIDUALS))]
    start_dn = math.sqrt(max(float(np.var(residuals_dn)) / 2.0 - 1.0 / 12.0, 0.0))
    if start_dn < LEAST_SIGMA_DN:
        return None
    cell_dn = min(start_dn / _CELLS_PER_SIGMA, 0.125)
    half = int(np.abs(residuals_dn).max() / cell_dn) + 1
    counts = np.bincount(np.rint(residuals_dn / cell_dn).astype(int) + half, minlength=2 * half + 1)

    def loss(parameters: np.ndarray) -> float:
        share = difference_shares(parameters[0], math.exp(parameters[1]), cell_dn, half)
        return -float(counts @ np.log(np.maximum(share, _OUTLIER_SHARE)))

    start = np.array([0.05, math.log(start_dn)])
    simplex = start + np.array([[0.0, 0.0], [0.05, 0.0], [0.0, 0.02]])
    limits = [(LEAST_LAMBDA, GREATEST_LAMBDA), (None, None)]
    options = {"initial_simplex": simplex, "xatol": 1e-5}
    found = optimize.minimize(loss, start, method="Nelder-Mead", bounds=limits, options=options)
    shape, sigma_dn = float(found.x[0]), math.exp(found.x[1])
    errors = _standard_errors(loss, found.x, 2.0 / math.sqrt(residuals_dn.size))
    sigma = Interval(sigma_dn, *(sigma_dn * math.exp(sign * Z * errors[1]) for sign in (-1, 1)))
    return TukeyLambda(normal_interval(shape, errors[0]), sigma, sigma_dn / tukey_lambda_deviation(shape))


def rounding_doubt_dn2(shape: float, sigma_dn: float) -> float:
    """Return the largest error of a variance from which 1/12 DN^2 is subtracted for rounding [DN^2].

    The error depends on the position of the mean within a code and is at most (4 sigma^2 + 1/pi^2) phi(2 pi), with phi the
    characteristic function of the noise (Widrow and Kollar 2008, 4.1; first term of the series, Gaussian cross term).
    """
    scale_dn = sigma_dn / tukey_lambda_deviation(shape)
    share = (np.arange(20000) + 0.5) / 20000
    quantile = np.log(share / (1.0 - share)) if abs(shape) < 1e-9 else (share**shape - (1.0 - share) ** shape) / shape
    phi = abs(float(np.mean(np.cos(2.0 * math.pi * scale_dn * quantile))))
    return (4.0 * sigma_dn**2 + 1.0 / math.pi**2) * phi


def difference_shares(shape: float, sigma_dn: float, cell_dn: float, half: int) -> np.ndarray:
    """Return the probability of each cell k * cell_dn, k = -half ... half, for the difference of two rounded readings.

    Returns (2 half + 1,) float64. sigma_dn: standard deviation of one reading without rounding [DN].
    """
    reach = half + math.ceil(1.0 / cell_dn) + 1
    edges_dn = (np.arange(-reach, reach + 2) - 0.5) * cell_dn
    one = np.diff(_cumulative(shape, sigma_dn / tukey_lambda_deviation(shape), edges_dn))
    two = signal.fftconvolve(one, one[::-1], mode="same")
    whole = signal.fftconvolve(two, _triangle(cell_dn), mode="same")
    return whole[reach - half : reach + half + 1]


def _cumulative(shape: float, scale_dn: float, x_dn: np.ndarray) -> np.ndarray:
    """Cumulative distribution, by inverting the quantile function on a fine grid of log odds."""
    odds = np.linspace(math.log(_TAIL), -math.log(_TAIL), 12001)
    lower, upper = 1.0 / (1.0 + np.exp(-odds)), 1.0 / (1.0 + np.exp(odds))
    quantile = odds if abs(shape) < 1e-9 else (lower**shape - upper**shape) / shape
    return np.interp(x_dn, scale_dn * quantile, lower, left=0.0, right=1.0)


def _triangle(cell_dn: float) -> np.ndarray:
    """Shares of the cells for the sum of two rounding errors, triangular from -1 to 1 DN."""
    half = math.ceil(1.0 / cell_dn) + 1
    edges = np.clip((np.arange(-half, half + 2) - 0.5) * cell_dn, -1.0, 1.0)
    return np.diff(0.5 + edges - np.sign(edges) * edges**2 / 2.0)


def _standard_errors(loss: Callable[[np.ndarray], float], best: np.ndarray, step: float) -> np.ndarray:
    """Standard errors of two parameters from the second differences of a negative log-likelihood."""
    hessian = np.empty((2, 2))
    steps = np.eye(2) * np.array([3.0 * step, step])  # about one standard error of each
    for i in range(2):
        for j in range(2):
            corners = [loss(best + a * steps[i] + b * steps[j]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
            hessian[i, j] = (corners[0] - corners[1] - corners[2] + corners[3]) / (4.0 * steps[i, i] * steps[j, j])
    return np.sqrt(np.maximum(np.diag(np.linalg.inv(hessian)), 0.0))
