"""Fixed pattern of the dark: DSNU, columns, rows and hot photosites of averaged dark frames (EMVA 1288 R4.0 Linear, 8)."""

import math
from dataclasses import dataclass, replace

import numpy as np

from simulator.measurement.interval import Interval, normal_interval, root, shifted, variance_interval
from simulator.measurement.stacks import Stack, spatial_variance

HOT_SIGMAS = 6.0  # two photosites in a billion of a normal pattern lie further out


@dataclass(frozen=True)
class DarkPattern:
    """What stays from frame to frame in the dark, apart from the colour planes' own black levels.

    photosite_dn, column_dn, row_dn: standard deviations [DN]; photosite_dn is DSNU without hot photosites.
    hot_share: photosites that lie HOT_SIGMAS and more above their surroundings. hot_excess_dn: by how much on average [DN].
    """

    photosite_dn: Interval
    column_dn: Interval
    row_dn: Interval
    hot_share: float
    hot_excess_dn: float


def dark_pattern(stack: Stack, pixel_variance_dn2: float, row_variance_dn2: float) -> DarkPattern:
    """Split the mean of dark frames.

    stack: of whole mosaics whose colour planes were brought to one level (`levelled`). pixel_variance_dn2,
    row_variance_dn2: temporal noise of one frame, from pairs; 1/L of it is left in a mean of L frames and taken off.
    Intervals hold for normal patterns.
    """
    mean_dn, hot_share, hot_excess_dn = _without_hot(stack.mean_dn)
    frames, (rows, columns) = stack.frames, mean_dn.shape
    still = spatial_variance(replace(stack, mean_dn=mean_dn, variance_dn2=pixel_variance_dn2))
    left = pixel_variance_dn2 / frames
    rest = still.pixel_dn2 + left
    # The mean and the differences of frames are independent, so their errors add as squares.
    error = math.sqrt(2.0 / (rows * columns) * (rest**2 + left**2 * 2.0 / frames))
    of_columns = variance_interval(still.column_dn2 + rest / rows, columns - 1)
    of_rows = variance_interval(still.row_dn2 + rest / columns, rows - 1)
    return DarkPattern(
        photosite_dn=root(normal_interval(still.pixel_dn2, error)),
        column_dn=root(shifted(of_columns, -rest / rows)),
        row_dn=root(shifted(of_rows, -rest / columns - row_variance_dn2 / frames)),
        hot_share=hot_share,
        hot_excess_dn=hot_excess_dn,
    )


def levelled(frame: np.ndarray, places: list[tuple[int, int]]) -> np.ndarray:
    """Take the mean of each colour plane off a mosaic (height, width): float64 about 0 [DN]."""
    level = frame.astype(np.float64)
    step = 1 if len(places) == 1 else 2
    for y, x in places:
        level[y::step, x::step] -= level[y::step, x::step].mean()
    return level


def _without_hot(mean_dn: np.ndarray) -> tuple[np.ndarray, float, float]:
    """Replace photosites far above the others by the mean of those: frame, share, mean excess [DN]."""
    middle, low, high = np.quantile(mean_dn, [0.5, 0.158655, 0.841345])
    hot = mean_dn > middle + HOT_SIGMAS * max(0.5 * (high - low), 1e-9)
    if not hot.any():
        return mean_dn, 0.0, 0.0
    usual = float(mean_dn[~hot].mean())
    return np.where(hot, usual, mean_dn), float(hot.mean()), float(mean_dn[hot].mean()) - usual
