"""Weights of the samples behind a small blur circle, of a picture of one pixel per photosite that was swept along a path.

A photosite sees the light L, bilinear between the pixels, through the image D of the aperture and along its path P: on the
pixels around it, the weights D * P * T at their middles, T the tent of a pixel, are exact. What is swept first has P * T at the
middles of the photosites, so that weights W of the samples lead to W * (P * T) of the pixels, a sum. Even squares, which W is
at rest, have a twelfth of a pixel's square of variance along each axis, whatever the path is; what lacks is between nothing and
a sixth. These W come nearest to the exact weights, by the mean square that random pixels show, on some more samples.
"""

import math
from collections.abc import Callable

import numpy as np

from simulator.optics.defocus.photosite_area import RADIUS_IN_PARTS, ReadPath

SUM, SMALL = 1e3, 1e-3  # weights of the conditions that samples together have all of the light, and each of them little

ImageOf = Callable[[float], np.ndarray]


def path_weights(image_of: ImageOf, radius_px: float, path: ReadPath) -> np.ndarray:
    """Weights of the samples around a photosite: (n, n) float64, sum 1.

    image_of: returns the weights of samples that are values of smooth light, by the signed blur radius [samples]. radius_px:
    signed blur radius [photosites].
    """
    return _fit(*_lattices(image_of, radius_px, path), path)


def pixel_weights(image_of: ImageOf, radius_px: float, path: ReadPath) -> tuple[np.ndarray, np.ndarray]:
    """Weights of the pixels that photosites have by `path_weights`, and exact ones: two of (n, n) float64."""
    read, exact = _lattices(image_of, radius_px, path)
    found = np.zeros_like(read)
    for (down, right), weight in np.ndenumerate(_fit(read, exact, path)):
        found += weight * np.roll(read, (down - path.reach, right - path.reach), (0, 1))
    return found, exact


def _fit(read: np.ndarray, exact: np.ndarray, path: ReadPath) -> np.ndarray:
    """Weights of samples, of which each has weights `read` of pixels, that come nearest to exact ones of pixels."""
    around = range(-path.reach, path.reach + 1)
    moved = np.stack([np.roll(read, (down, right), (0, 1)).ravel() for down in around for right in around], axis=1)
    count = len(around) ** 2
    turned, system = np.linalg.qr(np.vstack([moved, np.full((1, count), SUM), SMALL * np.eye(count)]))
    wanted = turned.T @ np.concatenate([exact.ravel(), [SUM], np.zeros(count)])
    if path.is_positive:
        from scipy.optimize import nnls  # beside lamps alone

        found = nnls(system, wanted)[0]
    else:
        found = np.linalg.solve(system, wanted)
    return np.asarray((found / found.sum()).reshape(len(around), -1))


def _lattices(image_of: ImageOf, radius_px: float, path: ReadPath) -> tuple[np.ndarray, np.ndarray]:
    """Weights of pixels by the path alone, and with the image of the aperture: two of (n, n), that have room for its reach."""
    x, y, shares = np.array(path.places).T
    x, y = x - round(float(x.mean())), y - round(float(y.mean()))  # whole pixels change none
    half = math.ceil(float(np.abs([x, y]).max())) + path.reach + 1
    pixels = np.arange(-half, half + 1)
    per_px = math.ceil(RADIUS_IN_PARTS / abs(radius_px))
    image = image_of(per_px * radius_px)
    parts = (np.arange(len(image)) - len(image) // 2) / per_px
    read, exact = np.zeros((2, len(pixels), len(pixels)))
    for right, down, share in zip(x.tolist(), y.tolist(), shares.tolist(), strict=True):
        read += share * np.outer(_tents(down - pixels), _tents(right - pixels))
        rows, columns = (_tents(place + parts[:, None] - pixels) for place in (down, right))
        exact += share * (rows.T @ image @ columns)
    return read, exact


def _tents(away_px: np.ndarray) -> np.ndarray:
    """Share of a pixel so far away in light that is linear between pixels."""
    return np.maximum(1.0 - np.abs(away_px), 0.0)
