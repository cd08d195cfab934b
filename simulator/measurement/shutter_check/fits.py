"""Least squares with the covariance that the residuals tell; plain arrays in."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product
from math import factorial

import numpy as np
from scipy.optimize import least_squares


@dataclass(frozen=True)
class Fit:
    """values: (parameters,). covariance: (parameters, parameters). fitted: the model at the data."""

    values: np.ndarray
    covariance: np.ndarray
    fitted: np.ndarray

    def error_of(self, derivative: np.ndarray) -> float:
        """Standard error of a function of the parameters with this derivative (parameters,)."""
        return float(np.sqrt(derivative @ self.covariance @ derivative))

    def errors(self) -> np.ndarray:
        """Standard errors of the parameters."""
        return np.sqrt(np.diagonal(self.covariance))


def fit_linear(columns: np.ndarray, data: np.ndarray) -> Fit:
    """Fit data (points,) by columns (points, parameters), all points of one unknown variance."""
    values = np.linalg.lstsq(columns, data, rcond=None)[0]
    fitted = columns @ values
    return Fit(values, _covariance(columns, data - fitted), fitted)


def fit_curve(
    model: Callable[[np.ndarray], np.ndarray],
    data: np.ndarray,
    first: np.ndarray,
    scale: np.ndarray,
    spread: np.ndarray | float = 1.0,
) -> Fit:
    """Fit data (points,) by a model of parameters.

    first: where to begin, (parameters,). scale: by how much each parameter may change at first.
    spread: standard deviations of the points, (points,), up to an unknown common factor.
    """

    def deviations(values: np.ndarray) -> np.ndarray:
        return (model(values) - data) / spread

    found = least_squares(deviations, first, x_scale=scale, xtol=1e-12, ftol=1e-14, gtol=1e-14).x
    columns = np.empty((data.size, first.size))
    for index, step in enumerate(1e-4 * scale):
        ends = [deviations(found + sign * step * np.eye(first.size)[index]) for sign in (1.0, -1.0)]
        columns[:, index] = (ends[0] - ends[1]) / (2.0 * step)
    return Fit(found, _covariance(columns, deviations(found)), model(found))


def _covariance(columns: np.ndarray, residuals: np.ndarray) -> np.ndarray:
    variance = float(residuals @ residuals) / (residuals.size - columns.shape[1])
    return variance * np.linalg.pinv(columns.T @ columns)


def overlap(offset: np.ndarray, first: np.ndarray | float, second: np.ndarray | float) -> np.ndarray:
    """Return the length that two intervals share whose middles are so far apart.

    first, second: their lengths. As a function of the offset it is a trapezoid, the convolution of two boxes: first + second
    wide at its base, as high as the shorter, with ramps as long as the shorter.
    """
    low, high = np.maximum(-0.5 * first, offset - 0.5 * second), np.minimum(0.5 * first, offset + 0.5 * second)
    return np.maximum(high - low, 0.0)


def box_sum_share(x: np.ndarray, widths: Sequence[np.ndarray | float]) -> np.ndarray:
    """Return the share of a chain of boxes, centred at 0 and convolved with each other, that lies below x.

    widths: of the boxes, > 0 and not far smaller than the widest. Each box is the difference of two steps over its width.
    """
    total = np.zeros(np.shape(x))
    for signs in product((1.0, -1.0), repeat=len(widths)):
        shift = sum(0.5 * sign * width for sign, width in zip(signs, widths, strict=True))
        total += np.prod(signs) * np.maximum(x + shift, 0.0) ** len(widths)
    return total / (factorial(len(widths)) * np.prod(np.broadcast_arrays(*widths), axis=0))
