"""Points of the aperture that all photosites of a tile share."""

import math
from functools import lru_cache

import numpy as np

from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.error_laws import FEWEST, MOST
from simulator.optics.pupil.convex_area import Disk
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.pupil.pupil_points import points_of

SAVED_ON_GUESSES = 4  # where what lies behind edges is guessed, which costs more than the points
FEWEST_OF_ALL, MOST_OF_ALL = 32, 8192  # at any tolerance


def points_wanted(radius_px: np.ndarray, defocus: Defocus) -> np.ndarray:
    """Points for blur circles of this radius [photosites]: several for each scene pixel or photosite in it; powers of two.

    More or fewer for another tolerance than Accuracy's MEASURED; not more where what lies behind edges is guessed.
    """
    each = 4.0 * min(max(2.0 * defocus.scale, 0.5), 1.0)  # fewer where a scene pixel spreads over several photosites
    wanted = np.clip(each * np.pi * (radius_px * min(defocus.scale, 1.0) + 1.0) ** 2, FEWEST, MOST)
    count, factor = 2.0 ** np.ceil(np.log2(wanted)), defocus.accuracy.points_factor
    if defocus.guessed:
        count, factor = np.maximum(count / SAVED_ON_GUESSES, FEWEST), min(factor, 1.0)
    return 2 ** np.ceil(np.log2(np.clip(factor * count, FEWEST_OF_ALL, MOST_OF_ALL)) - 1e-9).astype(int)


@lru_cache
def lens_points(pupil: Pupil, count: int, over: int) -> np.ndarray:
    """Points of low discrepancy: (count, 5) float32 x, y in the pupil; x, y in the photosite; phase from 0 to 1.

    Sobol' points in five dimensions; a pupil with blades takes its own (`Pupil.points`) for the first two. The places in the
    photosite have the variance of its over x over points. count: a power of two.
    """
    from scipy.stats import qmc  # slow to import

    square = qmc.Sobol(5, seed=1).random_base2(int(count).bit_length() - 1)
    if pupil.opening == (Disk(0.0, 0.0, 1.0),):
        y, x = disk_of_square(square[:, 0], square[:, 1])
    else:
        x, y = pupil.points(count).T
    width = np.sqrt(1.0 - 1.0 / over**2)
    place = width * (square[:, 2:4] - 0.5)
    return np.stack([x, y, *place.T, square[:, 4]], axis=-1).astype(np.float32)


def lens_points_of(pupil: Pupil, fields: np.ndarray, count: int, over: int) -> np.ndarray:
    """Such points for each field (n, 2), as `Pupil` has it: (n, count, 5). Near fields have near points, one by one."""
    points = np.repeat(lens_points(pupil, count, over)[None], len(fields), axis=0)
    points[..., :2] = points_of(pupil, fields, count)
    return points


def disk_of_square(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Equal-area map of the square onto the disk that keeps neighbours (Shirley and Chiu 1997)."""
    a, b = 2.0 * first - 1.0, 2.0 * second - 1.0
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    ratio = np.where(wide, b, a) / np.where(radius == 0.0, 1.0, radius)
    angle = np.where(wide, 0.25 * math.pi * ratio, 0.5 * math.pi - 0.25 * math.pi * ratio)
    return radius * np.sin(angle), radius * np.cos(angle)
