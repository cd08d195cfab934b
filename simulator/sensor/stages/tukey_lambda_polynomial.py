"""Tukey-lambda numbers of unit variance as a polynomial in a normal number (quantile function: Hastings et al. 1947)."""

import math
from functools import lru_cache

import numpy as np

LEAST_LAMBDA, GREATEST_LAMBDA = -0.3, 0.25  # the published read noises lie between -0.28 and 0.2
REACH = 6.7  # largest normal number of kernels/normal.h
ORDER = 8
SERIES_BELOW = 0.005  # |lambda| from which on nothing cancels in the closed form of the deviation
# Riemann's zeta(k) for k = 2 to 8 (Abramowitz and Stegun, table 23.3).
ZETA = (
    math.pi**2 / 6,
    1.2020569031595942,
    math.pi**4 / 90,
    1.0369277551433699,
    math.pi**6 / 945,
    1.0083492773819228,
    math.pi**8 / 9450,
)


@lru_cache(maxsize=1024)  # bounded, because interpolated ISO settings produce arbitrarily many shapes
def tukey_polynomial(shape: float) -> tuple[float, ...]:
    """Return coefficients c of z (c[0] + c[1] z^2 + ...) = quantile(Phi(z)) / standard deviation.

    shape: lambda, LEAST_LAMBDA to GREATEST_LAMBDA. The fit weights errors by their effect on the probability, so the
    total variation distance to the exact distribution stays below 1e-5 and the variance within 1e-5 of 1.
    """
    z = np.linspace(1e-3, REACH, 4000)
    exact = _quantile(z, shape)
    slope = (_quantile(z + 1e-4, shape) - _quantile(z - 1e-4, shape)) / 2e-4
    weight = np.exp(-0.25 * z * z) / slope + 1e-5 / exact
    scaled = 2.0 * (z / REACH) ** 2 - 1.0
    matrix = np.polynomial.chebyshev.chebvander(scaled, ORDER) * z[:, np.newaxis]
    fitted = least_squares(matrix * weight[:, np.newaxis], exact * weight)
    series = np.polynomial.Chebyshev(fitted, domain=(0.0, REACH**2))
    return tuple(float(value) for value in series.convert(kind=np.polynomial.Polynomial).coef)


def least_squares(matrix: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return the x (columns,) that minimises |matrix x - wanted|, by modified Gram-Schmidt with `wanted` as an extra column.

    It is as accurate as a Householder QR (Bjorck 1967). NumPy's least squares uses a threaded BLAS, whose synchronisation takes
    forty times longer than such a small problem.
    """
    rows = np.vstack([matrix.T, wanted])
    triangle, count = np.zeros((len(rows), len(rows))), len(rows) - 1
    for place in range(count):
        triangle[place, place] = np.sqrt((rows[place] ** 2).sum())
        rows[place] /= triangle[place, place]
        triangle[place, place + 1 :] = (rows[place + 1 :] * rows[place]).sum(axis=1)
        rows[place + 1 :] -= triangle[place, place + 1 :, np.newaxis] * rows[place]
    return np.linalg.solve(triangle[:count, :count], triangle[:count, count])


def _quantile(z: np.ndarray, shape: float) -> np.ndarray:
    """Return the Tukey-lambda quantile, scaled to unit variance, at the probability Phi(z); lambda 0 is the logistic limit."""
    tail = 0.5 * np.array([math.erfc(one) for one in (z / math.sqrt(2.0)).tolist()])
    below, above = np.log1p(-tail), np.log(tail)
    raw = below - above if shape == 0.0 else np.exp(shape * above) * np.expm1(shape * (below - above)) / shape
    return raw / tukey_lambda_deviation(shape)


def tukey_lambda_deviation(shape: float) -> float:
    """Return the standard deviation of the Tukey-lambda distribution of scale 1, by which published scales are multiplied.

    The variance is 2 / (L^2 (1 + 2 L)) (1 - G(1 + L)^2 / G(1 + 2 L)), with the gamma function G (Joiner and Rosenblatt 1971).
    Near L = 0 the logarithm of that ratio is the sum over k >= 2 of zeta(k) (2 - 2^k) (-L)^k / k.
    shape: lambda L, LEAST_LAMBDA to GREATEST_LAMBDA. The result is right to 3e-11 of itself.
    """
    if abs(shape) < SERIES_BELOW:
        over_square = sum(zeta * (2.0 - 2.0**k) * (-shape) ** (k - 2) / k for k, zeta in enumerate(ZETA, start=2))
    else:
        over_square = (2.0 * math.lgamma(1.0 + shape) - math.lgamma(1.0 + 2.0 * shape)) / shape**2
    logarithm = shape * shape * over_square
    ratio = -over_square if logarithm == 0.0 else -math.expm1(logarithm) / shape**2
    return math.sqrt(2.0 * ratio / (1.0 + 2.0 * shape))
