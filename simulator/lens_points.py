"""Points of the aperture through which the blur is sampled."""

from functools import lru_cache

import numpy as np

FEWEST, MOST = 32, 256
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
ROOT = 1.2207440846057596  # of x^4 = x + 1


def points_wanted(radius_px: np.ndarray) -> np.ndarray:
    """Points for blur circles of this radius: one for each photosite of the circle, within limits, in powers of two."""
    wanted = np.clip(np.pi * (radius_px + 1.0) ** 2, FEWEST, MOST)
    return 2 ** np.ceil(np.log2(wanted)).astype(int)


@lru_cache
def lens_points(count: int, over: int) -> np.ndarray:
    """Points on a spiral of the golden angle: (count, 5) float32 x, y in the unit disk; x, y in the photosite; phase from 0 to 1.

    Equal areas between turns make the points evenly dense up to the rim (Vogel 1979, Math. Biosci. 44, 179). The places in the
    photosite have the variance of its over x over points, and fill it evenly with the phase (Roberts' sequence in three
    dimensions, whose steps are powers of the root of x^4 = x + 1).
    """
    number = np.arange(count) + 0.5
    radius, angle = np.sqrt(number / count), np.arange(count) * GOLDEN_ANGLE
    x, y, phase = np.modf(number[:, None] / ROOT ** np.arange(1, 4))[0].T
    width = np.sqrt(1.0 - 1.0 / over**2)
    place = [width * (x - 0.5), width * (y - 0.5)]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), *place, phase], axis=-1).astype(np.float32)
