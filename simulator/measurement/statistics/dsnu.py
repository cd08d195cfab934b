"""Fixed pattern of the dark: DSNU, columns, rows and hot photosites of averaged dark frames (EMVA 1288 R4.0 Linear, 8)."""

from dataclasses import dataclass, replace

import numpy as np

from simulator.measurement.statistics.interval import Interval, covariance, root, shifted, variance_interval
from simulator.measurement.statistics.spatial_variance import spatial_variance, stack_of

HOT_SIGMAS = 6.0  # two photosites in a billion of a normal pattern lie further out


@dataclass(frozen=True)
class DsnuMeasurement:
    """What stays from frame to frame in the dark, apart from the colour planes' own black levels.

    photosite_dn, column_dn, row_dn: standard deviations [DN]; photosite_dn is DSNU without hot photosites.
    hot_share: photosites that lie HOT_SIGMAS and more above their surroundings. hot_excess_dn: by how much on average [DN].
    """

    photosite_dn: Interval
    column_dn: Interval
    row_dn: Interval
    hot_share: float
    hot_excess_dn: float


def measure_dsnu(frames: list[np.ndarray], pixel_variance_dn2: float, row_variance_dn2: float) -> DsnuMeasurement:
    """Split the mean of dark frames.

    frames: two or more mosaics (height, width) whose colour planes were brought to one level (`subtract_plane_means`).
    pixel_variance_dn2, row_variance_dn2: temporal noise of one frame, from pairs; 1/L of it is left in a mean of L frames and
    taken off rows and columns. DSNU is the covariance of the means of two halves, which have no temporal noise in common; EMVA
    1288 R4.0 Linear takes 1/L of the temporal variance off instead, which comes to the same. The intervals of rows and columns
    hold for normal patterns, that of DSNU for any noise.
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
    """Take the mean of each colour plane off a mosaic (height, width): float64 about 0 [DN]."""
    level = frame.astype(np.float64)
    step = 1 if len(places) == 1 else 2
    for y, x in places:
        level[y::step, x::step] -= level[y::step, x::step].mean()
    return level


def _without_hot(mean_dn: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Replace photosites far above the others by the mean of those: frame, and where they are."""
    middle, low, high = np.quantile(mean_dn, [0.5, 0.158655, 0.841345])
    hot = mean_dn > middle + HOT_SIGMAS * max(0.5 * (high - low), 1e-9)
    return np.where(hot, float(mean_dn[~hot].mean()), mean_dn), hot


def _own_part(mean_dn: np.ndarray, hot: np.ndarray) -> np.ndarray:
    """What neither its row nor its column explains of a photosite; hot ones are left out."""
    known = np.where(hot, float(mean_dn[~hot].mean()), mean_dn)
    rest = known - known.mean(axis=1, keepdims=True) - known.mean(axis=0) + known.mean()
    rows, columns = rest.shape
    return rest[~hot] * np.sqrt(rows * columns / ((rows - 1) * (columns - 1)))
