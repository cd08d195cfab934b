"""Numbers with the same bits on every processor; the last bits of a BLAS, and of logarithms and sines, differ between them."""

from collections.abc import Sequence

import numpy as np

PIXELS_AT_ONCE = 4096  # of `ordered_product`: some tens of bands of them stay in the cache


def nine_digits(value: float) -> float:
    """Return a number to nine significant digits: more than single precision holds, few enough to hide last bits."""
    return float(f"{value:.9g}")


def nine_digits_each(values: np.ndarray) -> np.ndarray:
    """Return numbers of any shape, each to nine significant digits, float64."""
    return np.reshape([nine_digits(value) for value in np.ravel(values)], np.shape(values))


def weighted_sum(terms: Sequence[np.ndarray] | np.ndarray, weights: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
    """Return the sum of terms times their weights, which broadcast to one shape, added in their order."""
    found = terms[0] * weights[0]
    for term, weight in zip(terms[1:], weights[1:], strict=True):
        found += term * weight
    return found


def ordered_product(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return values (..., n) @ weights (n, m), (..., m), each entry added from the first of the n to the last."""
    flat = values.reshape(-1, values.shape[-1])
    found = np.empty((len(flat), weights.shape[1]), np.result_type(values, weights))
    for first in range(0, len(flat), PIXELS_AT_ONCE):
        some = slice(first, first + PIXELS_AT_ONCE)
        terms = np.ascontiguousarray(flat[some].T)
        for column, own in enumerate(weights.T):
            found[some, column] = weighted_sum(terms, own)
    return found.reshape(*values.shape[:-1], weights.shape[1])
