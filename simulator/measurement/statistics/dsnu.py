"""DSNU, column and row offsets and hot photosites from averaged dark frames (EMVA 1288 R4.0 Linear, 8)."""

from dataclasses import dataclass, replace

import numpy as np

from simulator.measurement.statistics.interval import Interval, covariance, root, shifted, variance_interval
from simulator.measurement.statistics.spatial_variance import spatial_variance, stack_of

HOT_SIGMAS = 6.0  # of normally distributed offsets, two in a billion lie further out


@dataclass(frozen=True)
class DsnuMeasurement:
    """Fixed pattern of dark frames, without the differences between the colour planes' black levels.

    photosite_dn, column_dn, row_dn: standard deviations [DN]; photosite_dn is DSNU without hot photosites.
    hot_share: share of photosites that lie HOT_SIGMAS or more above the median. hot_excess_dn: their mean excess [DN].
    """

    photosite_dn: Interval
    column_dn: Interval
    row_dn: Interval
    hot_share: float
    hot_excess_dn: float


def measure_dsnu(frames: list[np.ndarray], pixel_variance_dn2: float, row_variance_dn2: float) -> DsnuMeasurement:
    """Split the fixed pattern in the mean of dark frames into photosites, columns and rows.

    frames: two or more mosaics (height, width), each colour plane less its mean (`subtract_plane_means`).
    pixel_variance_dn2, row_variance_dn2: temporal noise of one frame, from pairs. A mean of L frames contains 1/L of it, which
    is subtracted from the variances of rows and columns. DSNU is the covariance of the means of two halves of the frames,
    which have no temporal noise in common; EMVA 1288 R4.0 Linear subtracts 1/L of the temporal variance instead, which has
    the same expectation. The intervals of rows and columns hold for normal offsets, that of DSNU for any distribution.
    """
    stack = stack_of(frames)
    mean_dn, hot = _without_hot(stack.mean_dn)
    rows, columns = mean_dn.shape
    still = spatial_variance(replace(stack, mean_dn=mean_dn, variance_dn2=pixel_variance_dn2))
    rest = still.pixel_dn2 + pixel_variance_dn2 / stack.frames
    of_columns = variance_interval(still.column_dn2 + rest / rows, columns - 1)
    of_rows = variance_interval(still.row_dn2 + rest / columns, rows - 1)
    halves = [_own_part(np.mean(frames[half::2], axis=0), hot) for half in (0, 1)]
    return DsnuMeasurement(
        photosite_dn=root(covariance(*halves)),
        column_dn=root(shifted(of_columns, -rest / rows)),
        row_dn=root(shifted(of_rows, -rest / columns - row_variance_dn2 / stack.frames)),
        hot_share=float(hot.mean()),
        hot_excess_dn=float(stack.mean_dn[hot].mean() - mean_dn.mean()) if hot.any() else 0.0,
    )


def subtract_plane_means(frame: np.ndarray, places: list[tuple[int, int]]) -> np.ndarray:
    """Return a mosaic (height, width) less the mean of each colour plane, float64 [DN]. places: of the planes in the block."""
    level = frame.astype(np.float64)
    step = 1 if len(places) == 1 else 2
    for y, x in places:
        level[y::step, x::step] -= level[y::step, x::step].mean()
    return level


def _without_hot(mean_dn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replace hot photosites by the mean of the others. Returns the frame and the mask of hot photosites."""
    middle, low, high = np.quantile(mean_dn, [0.5, 0.158655, 0.841345])
    hot = mean_dn > middle + HOT_SIGMAS * max(0.5 * (high - low), 1e-9)
    return np.where(hot, float(mean_dn[~hot].mean()), mean_dn), hot


def _own_part(mean_dn: np.ndarray, hot: np.ndarray) -> np.ndarray:
    """Residuals of the photosites about their row and column means, without hot photosites, scaled to be unbiased."""
    known = np.where(hot, float(mean_dn[~hot].mean()), mean_dn)
    rest = known - known.mean(axis=1, keepdims=True) - known.mean(axis=0) + known.mean()
    rows, columns = rest.shape
    return rest[~hot] * np.sqrt(rows * columns / ((rows - 1) * (columns - 1)))
