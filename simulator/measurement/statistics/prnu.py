"""PRNU from flat fields whose illumination is not uniform."""

import numpy as np
from scipy import ndimage

from simulator.measurement.statistics.interval import Interval, covariance, root

WINDOW_PX = 15  # side of the moving mean in one colour plane; shading and dust are smooth over it, PRNU is not


def measure_prnu(first: list[np.ndarray], second: list[np.ndarray]) -> Interval:
    """Measure the relative standard deviation of the photosites' responses (PRNU) over all given planes.

    first, second: lists of planes (height, width) float64, mean dark signal subtracted [DN], of different frames (or means of
    different frames) of one flat field, so that they have PRNU in common and no temporal noise.
    Each plane is divided by its moving mean over WINDOW_PX x WINDOW_PX, and the moving mean of the result is subtracted once
    more, which removes curved shading. The covariance of the two is PRNU^2 times the filter's gain for white noise, about
    1.001. EMVA 1288 R4.0 Linear subtracts the temporal variance from one mean instead, which requires uniform light.
    """
    relative = [(_relative(one), _relative(two)) for one, two in zip(first, second, strict=True)]
    one, two = (np.concatenate([pair[side].ravel() for pair in relative]) for side in (0, 1))
    return root(covariance(one, two).scaled(1.0 / _kept_share()))


def _relative(plane: np.ndarray) -> np.ndarray:
    """Relative deviation from the moving mean, without the border, where the window is not centred."""
    border = 2 * (WINDOW_PX // 2)
    relative = plane / ndimage.uniform_filter(plane.astype(np.float64), WINDOW_PX) - 1.0
    return (relative - ndimage.uniform_filter(relative, WINDOW_PX))[border:-border, border:-border]


def _kept_share() -> float:
    """Share of the variance of white noise that `_relative` keeps: sum of squares of the filter delta - 2 box + box * box."""
    point = np.zeros((4 * WINDOW_PX, 4 * WINDOW_PX))
    point[2 * WINDOW_PX, 2 * WINDOW_PX] = 1.0
    once = point - ndimage.uniform_filter(point, WINDOW_PX)
    return float(np.sum((once - ndimage.uniform_filter(once, WINDOW_PX)) ** 2))
