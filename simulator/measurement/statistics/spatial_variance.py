"""Spatial variance of a stack of equally exposed frames, split into rows, columns and photosites (EMVA 1288 R4.0 Linear)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from simulator.errors import PhotositeError

LEAST_SIDE_PX = 3  # of a plane with rows and columns


@dataclass(frozen=True)
class Stack:
    """Statistics of a stack of equally exposed frames.

    mean_dn: (height, width) float64 mean of the frames [DN]. variance_dn2: temporal variance, mean over the
    photosites [DN^2]. frames: how many. kept_shares: of the variance of photosites, and of rows and columns, that a filter of
    the mean frame has left in it.
    """

    mean_dn: np.ndarray
    variance_dn2: float
    frames: int
    kept_shares: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True)
class SpatialVariance:
    """Variance of the fixed pattern, temporal noise subtracted [DN^2]; an estimate near 0 may be negative.

    total = row + column + pixel.
    """

    total_dn2: float
    row_dn2: float
    column_dn2: float
    pixel_dn2: float


def stack_of(frames: Iterable[np.ndarray]) -> Stack:
    """Average frames of one plane, (height, width) codes; they are read one by one and need not fit into memory together.

    Raises PhotositeError for fewer than two frames or frames of different shapes.
    """
    total, squares, offset_dn = np.zeros(0), np.zeros(0), np.float64(0.0)
    count = 0
    for frame in frames:
        if count == 0:
            # Sums of deviations from the first frame's mean keep the sum of squares exact in float64.
            offset_dn = np.rint(frame.mean(dtype=np.float64))
            total, squares = np.zeros(frame.shape), np.zeros(frame.shape)
        if frame.shape != total.shape:
            raise PhotositeError(f"a stack of {total.shape} and {frame.shape}: all frames of a stack must have one size")
        deviation = frame - offset_dn
        total += deviation
        squares += deviation**2
        count += 1
    if count < 2:
        raise PhotositeError(f"a stack of {count} frames: give two or more; EMVA 1288 asks for 16 at least")
    variance = float(np.mean(squares - total**2 / count)) / (count - 1)
    return Stack(offset_dn + total / count, variance, count)


def spatial_variance(stack: Stack) -> SpatialVariance:
    """Split the variance of the mean frame into rows, columns and photosites.

    Two-way analysis of variance of M rows and N columns: the variance of the row means is row + rest / N, that of the column
    means column + rest / M, and that of the residuals rest = pixel + 1/L of the temporal variance of L frames.
    EMVA 1288 R4.0 Linear solves the same equations with the total variance in place of that of the residuals; the results
    agree but for relative bias of 1/M and 1/N. What a filter has taken of the variances is given back.
    Raises PhotositeError for planes below 3 x 3.
    """
    mean = stack.mean_dn
    rows, columns = mean.shape
    if min(rows, columns) < LEAST_SIDE_PX:
        raise PhotositeError(f"a plane of {rows} x {columns} photosites: too small for rows and columns; use larger frames")
    row_means, column_means = mean.mean(axis=1), mean.mean(axis=0)
    rest_map = mean - row_means[:, np.newaxis] - column_means + mean.mean()
    of_pixels, of_lines = stack.kept_shares
    rest = float(np.sum(rest_map**2)) / ((rows - 1) * (columns - 1)) / of_pixels
    pixel = rest - stack.variance_dn2 / stack.frames
    row = float(np.var(row_means, ddof=1)) / of_lines - rest / columns
    column = float(np.var(column_means, ddof=1)) / of_lines - rest / rows
    return SpatialVariance(row + column + pixel, row, column, pixel)
