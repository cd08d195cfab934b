"""PRNU of a user's flat fields, whose light is never quite even."""

import numpy as np
from scipy import ndimage

from simulator.measurement.statistics.interval import Interval, covariance, root

WINDOW_PX = 15  # of one colour plane: shading and dust are smooth over it, PRNU is not


def measure_prnu(first: list[np.ndarray], second: list[np.ndarray]) -> Interval:
    """Relative standard deviation of the photosites' responses (PRNU), over all planes given.

    first, second: lists of planes (height, width) float64, the dark's mean taken off [DN]; the two are of different
    frames, or means of different frames, of one flat field, so that noise is in one or the other and the pattern in both.
    Each plane is divided by its moving mean of WINDOW_PX x WINDOW_PX, and the moving mean of the result is taken off once
    more, so that curved shading leaves nothing. The covariance of the two is PRNU^2 times what this filter does to white noise,
    0.1 % more. EMVA 1288 R4.0 Linear takes the temporal variance off one mean instead, which has to be under even light.
    """
    relative = [(_relative(one), _relative(two)) for one, two in zip(first, second, strict=True)]
    one, two = (np.concatenate([pair[side].ravel() for pair in relative]) for side in (0, 1))
    return root(covariance(one, two).scaled(1.0 / _kept_share()))


def _relative(plane: np.ndarray) -> np.ndarray:
    """Deviation from the surroundings, as a share of them; without the border, where the means are not centred."""
    border = 2 * (WINDOW_PX // 2)
    relative = plane / ndimage.uniform_filter(plane.astype(np.float64), WINDOW_PX) - 1.0
    return (relative - ndimage.uniform_filter(relative, WINDOW_PX))[border:-border, border:-border]


def _kept_share() -> float:
    """Variance of white noise that `_relative` leaves: sum of the squares of the filter delta - 2 box + box * box."""
    point = np.zeros((4 * WINDOW_PX, 4 * WINDOW_PX))
    point[2 * WINDOW_PX, 2 * WINDOW_PX] = 1.0
    once = point - ndimage.uniform_filter(point, WINDOW_PX)
    return float(np.sum((once - ndimage.uniform_filter(once, WINDOW_PX)) ** 2))
