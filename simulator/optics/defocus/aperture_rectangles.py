"""The aperture as rectangles of its area, over which the mean of a scene of square pixels has a closed form."""

import numpy as np

from simulator.optics.pupil.pupil import Pupil

FEWEST, MORE = 8, 4  # rectangles of an aperture for blur radii up to a quarter of a photosite; more for each further quarter
_ROWS = 64  # rows of the aperture in each of them


def rectangle_count(radius_px: np.ndarray) -> np.ndarray:
    """Rectangles of an aperture for blur circles up to this radius [photosites].

    Their error grows as radius^1.3 and falls as the square of their number (`gathered_lamp_error`), which grows as radius^0.65
    in steps.
    """
    return FEWEST + MORE * np.maximum(np.ceil(4.0 * radius_px) - 1.0, 0.0).astype(int)


def aperture_rectangles(pupil: Pupil, count: int) -> np.ndarray:
    """Aperture on the axis as a sum of rectangles: (count, 5) float64.

    Columns: x and y of the middle, half the width, half the height [pupil radii], share of the aperture. The aperture is cut
    into bands whose heights shrink towards its upper and lower end as those of equal angles on a circle. A rectangle has the
    area, the centroid and the variances of its band, so that it may overlap the next.
    """
    rows, left, right = pupil.spans()
    middle, half = 0.5 * (rows[0] + rows[-1]), 0.5 * (rows[-1] - rows[0])
    borders = middle + half * np.sin(np.pi * (np.arange(count + 1) / count - 0.5))
    places = (np.arange(_ROWS) + 0.5) / _ROWS
    y = borders[:-1, None] + np.diff(borders)[:, None] * places
    low, high = (np.interp(y, rows, end) for end in (left, right))
    light = (high - low) * np.diff(borders)[:, None]
    area = light.sum(axis=1)
    weights = light / area[:, None]
    x_mean, y_mean = (weights * 0.5 * (low + high)).sum(axis=1), (weights * y).sum(axis=1)
    x_variance = (weights * (low**2 + low * high + high**2) / 3.0).sum(axis=1) - x_mean**2
    y_variance = (weights * y**2).sum(axis=1) - y_mean**2
    return np.column_stack([x_mean, y_mean, np.sqrt(3.0 * x_variance), np.sqrt(3.0 * y_variance), area / area.sum()])
