"""Points of the aperture through which the blur is sampled."""

from functools import lru_cache

import numpy as np

FEWEST, MOST = 32, 256
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
PLASTIC = 1.324717957244746  # the plastic number: its inverse fills an interval evenly and knows nothing of the golden angle


def points_wanted(radius_px: np.ndarray) -> np.ndarray:
    """Points for blur circles of this radius: one for each photosite of the circle, within limits, in powers of two."""
    wanted = np.clip(np.pi * (radius_px + 1.0) ** 2, FEWEST, MOST)
    return 2 ** np.ceil(np.log2(wanted)).astype(int)


@lru_cache
def lens_points(count: int) -> np.ndarray:
    """Points on a spiral of the golden angle, (count, 4) float32: x, y in the unit disk, share of the light, phase from 0 to 1.

    Equal areas between turns make the points evenly dense up to the rim (Vogel 1979, Math. Biosci. 44, 179).
    """
    number = np.arange(count) + 0.5
    radius, angle = np.sqrt(number / count), np.arange(count) * GOLDEN_ANGLE
    phase = np.modf((np.arange(count) + 0.5) / PLASTIC)[0]
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, 1.0 / count), phase], -1).astype(np.float32)
