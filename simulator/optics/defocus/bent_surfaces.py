"""Surfaces that bend within a blur circle: what their means miss, since they take a surface for a plane there.

Through the point u of the pupil a photosite at x sees the light L at x + s u, where s is the radius of the surface that the ray
meets. Of a plane that is known at x. What a surface's radius has beyond it, d, moves the ray by u d, so that the mean is wrong
by E[grad L . u d]. With the even and the odd parts of grad L and d around x only the products of unlike ones are left, and of
each at most the product of the roots of their mean squares (Cauchy and Schwarz' inequality):

    rms(grad L) rms(odd d) + deviation(grad L) rms(even d)    [over the circle].

Where the scene's own pixels are gathered, the image on a plane of the slope g is the upright one moved by s g / 4, the mean of
s u (g . u). What is left of that, even in u, has the root mean square s |g| sqrt(1/6 - 1/16), of rays uniform in a round pupil.
"""

import math

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy

DIRECTIONS, RINGS = 8, (0.5, 1.0)  # of places in a circle at which surfaces are compared with planes; in its radius
OF_MOVED = math.sqrt(1.0 / 6.0 - 1.0 / 16.0)  # of slope times radius
WIDER = 1.5  # factor from one width over which slopes of the light are averaged to the next


def bent_error(light: np.ndarray, radius_px: np.ndarray, scale: float, accuracy: Accuracy, *, is_moved: bool) -> np.ndarray:
    """Error of taking a surface for a plane, (rows, columns, channels), as a share of the brightest light in its own noise.

    light: (rows, columns, channels) of pixels, in shares of the brightest light. radius_px: (rows, columns), signed blur radius
    [photosites]. scale: pixels per photosite. is_moved: whether images on planes are upright ones that are moved.
    """
    from scipy.ndimage import uniform_filter

    side = max(round(scale), 1)
    seen = uniform_filter(light.astype(np.float64), side, mode="nearest", axes=(0, 1))
    slopes = [scale * np.gradient(seen, axis=axis) for axis in (0, 1)]  # per photosite
    odd, even, steep = _beyond_planes(radius_px.astype(np.float64), scale)
    if is_moved:
        even = even + OF_MOVED * np.abs(radius_px) * steep
    square, deviation = _over_circles(slopes, np.abs(radius_px), scale)
    moved = np.sqrt(square) * odd[..., None] + np.sqrt(deviation) * even[..., None]
    noise_e2 = accuracy.electrons * np.maximum(seen, 0.0) + accuracy.read_noise_e**2
    return np.asarray(moved * np.sqrt((accuracy.electrons + accuracy.read_noise_e**2) / np.maximum(noise_e2, 1.0)))


def _beyond_planes(radius_px: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Roots of the mean squares of what radii have beyond planes within circles, odd and even around their middles; slopes.

    A plane has the slope between the photosites beside its middle [photosites per photosite].
    """
    last = np.array(radius_px.shape)[:, None, None] - 1
    middle = np.indices(radius_px.shape)

    def at(away_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Radius at the pixels nearest to places (2, rows, columns) beside the middle, and what a plane has there beyond it."""
        place = np.clip(np.rint(middle + scale * away_px).astype(np.intp), 0, last)
        return radius_px[*place], (slope * (place - middle)).sum(axis=0) / scale

    slope = np.stack([scale * _difference(radius_px, max(round(scale), 1), axis) for axis in (0, 1)])
    odd, even, count = np.zeros(radius_px.shape), np.zeros(radius_px.shape), 0
    for ring in RINGS:
        for angle in np.arange(DIRECTIONS // 2) * 2.0 * math.pi / DIRECTIONS:
            away = ring * np.abs(radius_px) * np.array([math.sin(angle), math.cos(angle)])[:, None, None]
            (before, plane_before), (behind, plane_behind) = at(-away), at(away)
            odd += 0.25 * (behind - before - plane_behind + plane_before) ** 2
            even += (0.5 * (behind + before - plane_behind - plane_before) - radius_px) ** 2
            count += 1
    return np.sqrt(odd / count), np.sqrt(even / count), np.hypot(*slope)


def _difference(values: np.ndarray, side: int, axis: int) -> np.ndarray:
    """Mean slope from so many pixels before each to so many behind it, of those that there are."""
    size = values.shape[axis]
    before, behind = np.maximum(np.arange(size) - side, 0), np.minimum(np.arange(size) + side, size - 1)
    span = np.expand_dims(np.maximum(behind - before, 1), 1 - axis)
    return np.asarray((np.take(values, behind, axis=axis) - np.take(values, before, axis=axis)) / span)


def _over_circles(slopes: list[np.ndarray], size_px: np.ndarray, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Mean square of the light's slope over squares as wide as circles of these radii, and its variance."""
    from scipy.ndimage import uniform_filter

    widths = np.maximum(2.0 * size_px * scale + 1.0, 1.0)
    steps = np.ceil(np.log(widths) / math.log(WIDER)).astype(int)
    square, deviation = np.zeros(slopes[0].shape), np.zeros(slopes[0].shape)
    for step in np.unique(steps).tolist():
        width, here = min(math.ceil(WIDER**step), max(size_px.shape)), steps == step
        means = [uniform_filter(slope, width, mode="nearest", axes=(0, 1)) for slope in slopes]
        squares = sum(uniform_filter(slope**2, width, mode="nearest", axes=(0, 1)) for slope in slopes)
        square[here] = np.maximum(squares, 0.0)[here]
        deviation[here] = np.maximum(squares - sum(mean**2 for mean in means), 0.0)[here]
    return square, deviation
