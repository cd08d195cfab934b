"""Mean and noise of two frames taken alike (EMVA 1288 R4.0 Linear: temporal noise by the photon transfer method).

The difference of the two holds no fixed pattern, so half its variance is the temporal variance. Whole-number codes are
summed exactly, so nothing is lost in large frames. Planes are (height, width) codes [DN] of one colour.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError


@dataclass(frozen=True)
class PairNoise:
    """Temporal noise of a pair, split into what a whole row has in common and what is a photosite's own.

    mean_dn: of both frames. variance_dn2: all temporal variance of EMVA 1288, rounding included.
    pixel_variance_dn2: without row noise, rounding included. row_variance_dn2: of the offsets of whole rows; an estimate
        around 0 may be negative. rows, columns: size of the plane.
    """

    mean_dn: float
    variance_dn2: float
    pixel_variance_dn2: float
    row_variance_dn2: float
    rows: int
    columns: int

    @property
    def pixel_sd(self) -> float:
        """Relative standard deviation of pixel_variance_dn2 for normal noise: sqrt(2 / (rows (columns - 1)))."""
        return math.sqrt(2.0 / (self.rows * (self.columns - 1)))


def mean_of_pair(first: np.ndarray, second: np.ndarray) -> float:
    """Mean code of two frames [DN]."""
    return 0.5 * (float(first.mean(dtype=np.float64)) + float(second.mean(dtype=np.float64)))


def temporal_variance(first: np.ndarray, second: np.ndarray) -> float:
    """Temporal variance [DN^2]: half the mean square difference less half the squared difference of the means.

    The second term takes out that the light was not quite the same in both frames.
    Raises PhotositeError for frames of different shapes.
    """
    difference = _difference(first, second)
    return 0.5 * (float(np.mean(difference**2)) - float(np.mean(difference)) ** 2)


def pair_noise(first: np.ndarray, second: np.ndarray) -> PairNoise:
    """Temporal noise of a pair, row noise apart.

    Analysis of variance with one random effect: in the difference, rows of n columns have means of variance
    2 (row + pixel / n), and photosites scatter about their row's mean with 2 pixel.
    Raises PhotositeError for frames of different shapes or of less than 2 x 2 photosites.
    """
    difference = _difference(first, second)
    rows, columns = difference.shape
    if min(rows, columns) < 2:
        raise PhotositeError(f"a pair of {rows} x {columns} photosites: row noise needs 2 x 2 or more; use larger frames")
    row_means = difference.mean(axis=1, keepdims=True)
    pixel = float(np.sum((difference - row_means) ** 2)) / (2.0 * rows * (columns - 1))
    of_means = float(np.var(row_means, ddof=1)) / 2.0
    total = 0.5 * (float(np.mean(difference**2)) - float(np.mean(difference)) ** 2)
    return PairNoise(mean_of_pair(first, second), total, pixel, of_means - pixel / columns, rows, columns)


def _difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """First minus second as float64, so that unsigned codes cannot wrap."""
    if first.shape != second.shape or first.ndim != 2:
        raise PhotositeError(f"a pair of {first.shape} and {second.shape}: both frames of a pair must have one size")
    return first.astype(np.float64) - second
