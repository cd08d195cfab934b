"""How wrong instants are over random pixels: at distances that fit those of pixels the errors at bends of the light add up.

Light is linear between pixels as large as photosites. Instants (w_i, x_i) see the pixel p with the weight sum_i w_i B(x_i - p),
B the product of triangles along both axes, and the path itself with the mean of B over it. The differences of these weights,
of pixels that are independent and deviate by s, give the error the deviation s times the root of the sum of their squares. All
photosites see their pixels at the same phases, so that no mean over phases helps: it is the largest over beginnings of the path
at which an instant lies on the middle of a pixel, or parts of the distance of instants beside it. `instants` has the law for
one edge.
"""

import math

import numpy as np

from simulator.optics.geometry.instants import MOST_INSTANTS, TimedPath

FINER = 16  # times as many instants stand for the path, which are wrong by 1 / 256 of the error
PLACES = 4  # per axis at which the path begins, within the distance of its instants
OF_PHOTOSITES = 3.29  # deviations that 99.9 % of normal errors stay below
MOST_TRIES, MORE = 24, 0.6  # counts that are tried, up to so many times more: an error falls as the square of the count
LONGEST_PX = 100.0  # of the paths that are looked at [photosites]: longer ones take too long to plan
RESONANT = 4.3  # most that errors were found to be, in the law's unit of one edge and the root of the number of pixels


def texture_deviation(path: TimedPath, count: int) -> float:
    """Return the deviation of the error of so many instants of a path over pixels of deviation 1."""
    few, many = (path.longest_places(number) for number in (count, FINER * count))
    every = np.concatenate([few[0], many[0]])
    corner = few[0][0] - np.ceil(few[0][0] - every.min(axis=0)) - 1.0  # an instant lies on the middle of a pixel
    span = np.ceil(every.max(axis=0) - corner).astype(int) + 3
    step = few[0][count // 2] - few[0][max(count // 2 - 1, 0)]
    shares, worst = np.arange(PLACES) / PLACES, 0.0
    for right in step[0] * shares % 1.0:
        for down in step[1] * shares % 1.0:
            own, mean = (
                _seen_pixels(places - corner + (right, down), weights, (int(span[0]), int(span[1])))
                for places, weights in (few, many)
            )
            worst = max(worst, float(np.square(own - mean).sum()))
    return math.sqrt(worst)


def textured_instants(path: TimedPath, count: int, texture: float, allowed: float) -> tuple[int, float]:
    """Return how many instants, at least `count`, keep random pixels within what is allowed, and their error.

    texture: deviation of the difference of neighbouring pixels, as a share of the brightest light, as the error is; allowed.
    The error of a path beyond LONGEST_PX is 0: unknown.
    """
    if not path.length.longest_px <= LONGEST_PX:
        return count, 0.0
    deviation, least = texture / math.sqrt(2.0), (count, math.inf)
    step = math.ceil(MORE * count / MOST_TRIES)
    for tried in range(count, min(count + step * MOST_TRIES, MOST_INSTANTS + 1), step):
        error = OF_PHOTOSITES * deviation * texture_deviation(path, tried)
        least = min(least, (tried, error), key=lambda one: one[1])
        if error <= allowed:
            return tried, error
    return least


def _seen_pixels(places: np.ndarray, weights: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return the weights (cells,) with which places (n, 2) see pixels of a grid of this size, in either direction."""
    first = np.floor(places).astype(np.intp)
    part = places - first
    found = np.zeros(size[0] * size[1])
    for right in (0, 1):
        for down in (0, 1):
            share = np.abs(1.0 - right - part[:, 0]) * np.abs(1.0 - down - part[:, 1])
            found += np.bincount((first[:, 0] + right) * size[1] + first[:, 1] + down, share * weights, len(found))
    return found
