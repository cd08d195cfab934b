"""Mean and temporal noise of two equally exposed frames (EMVA 1288 R4.0 Linear, photon transfer method).

The difference of the two frames contains no fixed pattern, so half its variance is the temporal variance. Sums of integer
codes are exact in float64. Planes are (height, width) codes [DN] of one colour.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError


@dataclass(frozen=True)
class PairNoise:
    """Temporal noise of a pair, split into row noise and noise of single photosites.

    mean_dn: of both frames. variance_dn2: total temporal variance of EMVA 1288, rounding included.
    pixel_variance_dn2: without row noise, rounding included. row_variance_dn2: of the offsets of rows; an estimate near 0
        may be negative. rows, columns: size of the plane.
    variance_error_dn2, pixel_variance_error_dn2: standard errors, from the scatter between rows, which are independent of
        each other; so they hold for noise of any distribution.
    """

    mean_dn: float
    variance_dn2: float
    pixel_variance_dn2: float
    row_variance_dn2: float
    rows: int
    columns: int
    variance_error_dn2: float
    pixel_variance_error_dn2: float

    @property
    def mean_error_dn(self) -> float:
        """Standard error of `mean_dn` [DN]: noise of photosites falls with their number, row noise with that of the rows."""
        return math.sqrt((self.pixel_variance_dn2 / self.columns + max(self.row_variance_dn2, 0.0)) / (2.0 * self.rows))


def mean_of_pair(first: np.ndarray, second: np.ndarray) -> float:
    """Return the mean code of two frames [DN]."""
    return 0.5 * (float(first.mean(dtype=np.float64)) + float(second.mean(dtype=np.float64)))


def pair_noise(first: np.ndarray, second: np.ndarray) -> PairNoise:
    """Measure the temporal noise of a pair, row noise and noise of single photosites separately.

    The temporal variance is half the mean square difference less half the squared difference of the means, which removes
    the effect of slightly different light in the two frames.
    Analysis of variance with one random effect: in the difference, rows of n columns have means of variance
    2 (row + pixel / n), and photosites scatter about their row's mean with 2 pixel.
    Raises PhotositeError for frames of different shapes or of less than 2 x 2 photosites.
    """
    difference = _difference(first, second)
    rows, columns = difference.shape
    if min(rows, columns) < 2:
        raise PhotositeError(f"a pair of {rows} x {columns} photosites: row noise needs 2 x 2 or more; use larger frames")
    row_means = difference.mean(axis=1)
    about_zero = difference - difference.mean()
    per_row, pixel_per_row = 0.5 * np.mean(about_zero**2, axis=1), 0.5 * np.var(difference, axis=1, ddof=1)
    pixel = float(pixel_per_row.mean())
    return PairNoise(
        mean_dn=mean_of_pair(first, second),
        variance_dn2=float(per_row.mean()),
        pixel_variance_dn2=pixel,
        row_variance_dn2=float(np.var(row_means, ddof=1)) / 2.0 - pixel / columns,
        rows=rows,
        columns=columns,
        variance_error_dn2=float(np.std(per_row, ddof=1)) / math.sqrt(rows),
        pixel_variance_error_dn2=float(np.std(pixel_per_row, ddof=1)) / math.sqrt(rows),
    )


def _difference(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return first less second in float64, so that unsigned codes do not wrap around."""
    if first.shape != second.shape or first.ndim != 2:
        raise PhotositeError(f"a pair of {first.shape} and {second.shape}: both frames of a pair must have one size")
    return first.astype(np.float64) - second
