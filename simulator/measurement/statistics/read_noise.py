"""Read noise from pairs of dark frames, without row noise and rounding."""

from collections.abc import Sequence

import numpy as np

from simulator.measurement.statistics.interval import Interval, normal_interval, root, shifted
from simulator.measurement.statistics.photon_transfer import dark_noise
from simulator.measurement.statistics.temporal_noise import PairNoise

ROUNDING_VARIANCE_DN2 = 1.0 / 12.0  # of a uniform error within one code (EMVA 1288 R4.0 Linear, 2.3)


def read_noise(pairs: Sequence[PairNoise], doubt_dn2: float = 0.0) -> Interval:
    """Return the standard deviation of the temporal noise of single photosites in the dark [DN].

    pairs: of dark frames, of one size. doubt_dn2: largest error of the variance when the noise is small compared with one code
    (`rounding_doubt_dn2`), by which the interval is widened.
    The 1/12 DN^2 of rounding is subtracted (EMVA 1288 R4.0 Linear); an estimate below that becomes 0.
    Raises PhotositeError without a pair.
    """
    dark = dark_noise(pairs, row_noise=False)
    interval = shifted(normal_interval(dark.variance_dn2, dark.error_dn2), -ROUNDING_VARIANCE_DN2)
    return root(Interval(interval.value, interval.low - doubt_dn2, interval.high + doubt_dn2))


def row_residuals(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the differences of a pair less the mean of each row, (rows * columns,) float64 [DN].

    They are scaled by sqrt(columns / (columns - 1)), so that their variance is that of a difference without row noise.
    """
    difference = first.astype(np.float64) - second
    columns = difference.shape[1]
    return ((difference - difference.mean(axis=1, keepdims=True)) * np.sqrt(columns / (columns - 1.0))).ravel()
