"""Contrast of layers that hide each other: how much their coverage and the light behind it may vary together.

Light is a sum over the layers of what each lets through of the light behind it: (1 - coverage) times light. Means of a product
differ from the product of means by a covariance, which is at most the product of both standard deviations (Cauchy and Schwarz'
inequality): over a sample, at each point of the aperture, of both within a sample, of which the mean over the aperture is at
most the root of the product of their mean variances, and at most the largest deviation of the one times the mean of the other,
which is less around lamps. The light behind a layer is that of all layers behind it.

Sums over n points that lie evenly in a circle miss what varies within the share of the circle that each has, sqrt(pi / n) radii
wide, as stratified samples do (Cochran, Sampling Techniques, chapter 5). At borders the variance within a square grows with its
side, so that it is measured once, within photosites. What one of the two misses counts by how much the other one varies.

Where each photosite has a pixel, light that is read between samples rises over one where even squares end at its border: half
a sample too soon and half one too late, an eighth of it each. Over random pixels that cancels out. Long edges of both layers in
the same direction do not: as the smaller circle R crosses the border, all of the aperture's chord sees the larger one's edge,
2 / (8 pi R) of the product of both steps.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import Defocus
from simulator.scene.window_filters import window_maximum

FULL = 4.0  # 1 over the product of standard deviations of coverage and light of which half are 0 and half are 1
SPREAD = 1.0 / math.sqrt(math.pi)  # radius of a circle as large as a photosite, over which the points of samples lie, too
MIXED_SAMPLES = 2.0  # side over which light is read between samples [samples]

Surface = tuple[np.ndarray, np.ndarray | None]  # light (rows, columns, channels) times coverage, and coverage; None: it is 1


@dataclass(frozen=True)
class LayerContrast:
    """Products of the standard deviations of coverage and of the light behind it, FULL times, (rows, columns, channels).

    over_points: root of the sum over both of the variance of one within photosites, times its radius [photosites], times that
    of the other within its circle. over_samples: within samples, mean over photosites and circles. over_edges: products of
        steps along edges as long as the circles, over the smaller radius [1 / photosites], where circles see several pixels
        of a scene of one per photosite; else 0.
    """

    over_points: np.ndarray
    over_samples: np.ndarray
    over_edges: np.ndarray


def layer_contrast(layers: list[Surface], behind: list[np.ndarray], defocus: Defocus, scale: float) -> LayerContrast:
    """Measure the contrast of layers at rest, front to back.

    layers: with all scene pixels, or every so many. behind: light of each layer with all that are behind it. scale: of these
    pixels per photosite.
    """
    own = defocus.of_scene()
    ends_px = [max(abs(least), abs(most)) for least, most in own.ranges_px]
    circles_px = [0.0 if end <= own.copied_px else end for end in ends_px]  # what is copied is seen through one point
    smallest = np.array([min(circles_px)])
    samples = int(own.samples_per_axis(smallest, np.array([max(circles_px)]))[0])
    beside_px = 1.0 if samples > 1 else 0.0  # points are places in the photosite, too
    over_points = over_samples = over_edges = np.zeros(behind[0].shape)
    photosite, sample = _width(1.0, scale), _width(MIXED_SAMPLES / samples, scale)
    for number, (_, coverage) in enumerate(layers[:-1]):
        if coverage is None:
            break
        pair = [values.astype(np.float64) for values in (coverage[..., None], behind[number + 1])]  # for the dark
        radii_px = circles_px[number], max(circles_px[number + 1 :])
        widths = [_width(math.sqrt(math.pi) * radius_px + beside_px, scale) for radius_px in radii_px]
        wide = [_variance(values, width) for values, width in zip(pair, widths, strict=True)]
        fine = [
            (radius_px + SPREAD * beside_px) * min(scale, 1.0) * _mean_above_0(_variance(values, photosite), width)
            for values, radius_px, width in zip(pair, radii_px, widths, strict=True)
        ]
        over_points = over_points + FULL * np.sqrt(fine[0] * wide[1] + wide[0] * fine[1])
        squares = [_variance(values, sample) for values in pair]
        over_samples = over_samples + FULL * _mean_product(squares[0], widths[0], squares[1], widths[1])
        if abs(defocus.scale - 1.0) < 1e-3 and min(radii_px) > 0.5:
            steps = [_steps_along(values, width) for values, width in zip(pair, widths, strict=True)]
            over_edges = over_edges + sum(one * other for one, other in zip(*steps, strict=True)) / min(radii_px)
    return LayerContrast(over_points, over_samples, over_edges)


def _steps_along(values: np.ndarray, width: int) -> list[np.ndarray]:
    """Largest step from pixel to pixel in squares of so many, mean along as many in the other direction; of both axes."""
    from scipy.ndimage import uniform_filter1d

    found = []
    for axis in (0, 1):
        step = np.diff(values, axis=axis, append=values.take([-1], axis))
        mean = uniform_filter1d(step, width, axis=1 - axis, mode="nearest")
        found.append(window_maximum(np.abs(mean), width, "nearest"))
    return found


def _mean_product(cover_2: np.ndarray, cover_px: int, light_2: np.ndarray, light_px: int) -> np.ndarray:
    """Largest mean product of two deviations within squares of so many pixels, from their squares (rows, columns, channels)."""
    cover, light = np.sqrt(cover_2), np.sqrt(light_2)
    root_mean = np.sqrt(_mean_above_0(cover_2, cover_px) * _mean_above_0(light_2, light_px))
    most_cover, most_light = (window_maximum(one, width, "nearest") for one, width in ((cover, cover_px), (light, light_px)))
    least = np.minimum(root_mean, most_cover * _mean_above_0(light, light_px))
    return np.minimum(least, most_light * _mean_above_0(cover, cover_px))


def _width(side_px: float, scale: float) -> int:
    """Pixels that a square of this side [photosites] touches at most along an axis; 1: it is a point."""
    return 1 if side_px == 0.0 else math.ceil(side_px * scale) + 1


def _mean(values: np.ndarray, width: int) -> np.ndarray:
    """Mean over squares of so many pixels around each."""
    from scipy.ndimage import uniform_filter1d

    for axis in (0, 1):
        values = uniform_filter1d(values, width, axis=axis, mode="nearest")
    return values


def _mean_above_0(values: np.ndarray, width: int) -> np.ndarray:
    """The same of values from 0 on, which rounding leaves below 0."""
    return np.maximum(_mean(values, width), 0.0)


def _variance(values: np.ndarray, width: int) -> np.ndarray:
    """Variance over squares of so many pixels around each, at least 0 but for rounding."""
    if width == 1:
        return np.zeros_like(values)
    middle = values - values.mean(axis=(0, 1))  # keeps digits
    return np.maximum(_mean(middle * middle, width) - _mean(middle, width) ** 2, 0.0)
