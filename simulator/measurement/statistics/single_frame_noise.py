"""Noise of one frame, from the differences of neighbouring photosites of one colour.

A second difference along the row, a - 2 b + c, cancels linear gradients and row noise; its variance is 6 times that of a
photosite. Scene detail increases it, so variances are computed by block and the median over the blocks is used, which is
correct while less than half of the blocks of a level contain detail. Values beyond 5 sigma, such as hot pixels, are excluded.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

BLOCK_PX = 16  # side, in photosites of one colour
LEVELS = 4  # groups of blocks, darkest to brightest
FEWEST_BLOCKS = 8  # of a group; with fewer blocks there are fewer groups
# Second differences (1, -2, 1) at distance 1 and 2 correlate by -4/6 and 1/6: n of them equal n / 1.94 independent ones.
_SHARED = 1.0 + 2.0 * ((4 / 6) ** 2 + (1 / 6) ** 2)


@dataclass(frozen=True)
class LevelNoise:
    """level_dn: mean code of the blocks, pedestal included. sigma_dn: of one photosite, rounding included."""

    level_dn: float
    sigma_dn: float
    blocks: int


def single_frame_noise(planes: Sequence[np.ndarray], white_level_dn: int, most_levels: int = LEVELS) -> tuple[LevelNoise, ...]:
    """Estimate the noise at up to most_levels levels of brightness, the darkest first.

    planes: (height, width) codes [DN] of one colour; each may have a size of its own.
    The noise is that between photosites: temporal noise and fixed pattern together, without row noise.
    Blocks with a code of 0, or at the white level and above, are clipped and excluded; () when none is left.
    """
    parts = [_blocks(plane, white_level_dn) for plane in planes if min(plane.shape) >= 4]
    means = np.concatenate([part[0] for part in parts]) if parts else np.empty(0)
    variances = np.concatenate([part[1] for part in parts]) if parts else np.empty(0)
    if means.size == 0:
        return ()
    groups = np.array_split(np.argsort(means, kind="stable"), max(1, min(most_levels, means.size // FEWEST_BLOCKS)))
    return tuple(
        LevelNoise(float(means[group].mean()), float(np.sqrt(np.median(variances[group]))), len(group)) for group in groups
    )


def mean_noise(levels: Sequence[LevelNoise], planes: Sequence[np.ndarray]) -> tuple[float, float]:
    """Return the noise of an even field [DN], the root of the mean variance of all blocks, and its standard error [DN].

    levels: of `single_frame_noise` for these planes. nan, nan without a block. The median of B blocks, each of n / 1.94
    independent differences, has the relative standard error sqrt(pi / 2 / B / (2 n / 1.94)).
    """
    blocks = sum(level.blocks for level in levels)
    if blocks == 0:
        return math.nan, math.nan
    sigma_dn = math.sqrt(sum(level.blocks * level.sigma_dn**2 for level in levels) / blocks)
    tall, wide = (min(BLOCK_PX, *(plane.shape[axis] for plane in planes if min(plane.shape) >= 4)) for axis in (0, 1))
    return sigma_dn, sigma_dn * math.sqrt(0.5 * math.pi / blocks / (2.0 * tall * (wide - 2) / _SHARED))


def _blocks(plane: np.ndarray, white_level_dn: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance of each block that is not clipped [DN, DN^2]."""
    tall, wide = (min(BLOCK_PX, side) for side in plane.shape)
    rows, columns = plane.shape[0] // tall, plane.shape[1] // wide
    cut = plane[: rows * tall, : columns * wide].reshape(rows, tall, columns, wide).swapaxes(1, 2).reshape(-1, tall, wide)
    cut = cut[((cut > 0) & (cut < white_level_dn)).all(axis=(1, 2))].astype(np.float32)
    second = np.diff(cut, n=2, axis=2).reshape(len(cut), tall * (wide - 2))
    # At least one code: the median is 0 where most differences are 0, as in a dark frame of few different codes.
    scale = np.maximum(1.4826 * np.median(np.abs(second), axis=1), 1.0)[:, np.newaxis]
    kept = np.abs(second) <= 5.0 * scale
    variance = np.where(kept, second**2, 0.0).sum(axis=1, dtype=np.float64) / kept.sum(axis=1) / 6.0
    degrees = tall * (wide - 2) / _SHARED
    # The median of a chi-square lies below its mean by this factor (Wilson and Hilferty 1931).
    return cut.mean(axis=(1, 2), dtype=np.float64), variance / (1.0 - 2.0 / (9.0 * degrees)) ** 3
