"""Contrast of layers that hide each other: how much their coverage and the light behind it may vary together.

Light is a sum over the layers of what each lets through of the light behind it: (1 - coverage) times light. Means of a product
differ from the product of means by a covariance, which is at most the product of both standard deviations (Cauchy and Schwarz'
inequality): over the aperture of coverage and light within their own blur circles; over a sample, at each point of the
aperture, of both within a sample, of which the mean over the aperture is at most the root of the product of their mean
variances. The light behind a layer is that of all layers behind it.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.defocus import Defocus

FULL = 4.0  # 1 over the product of standard deviations of coverage and light of which half are 0 and half are 1
MIXED_SAMPLES = 2.0  # side over which light is read between samples [samples]

Surface = tuple[np.ndarray, np.ndarray | None]  # light (rows, columns, channels) times coverage, and coverage; None: it is 1


@dataclass(frozen=True)
class LayerContrast:
    """Products of the standard deviations of coverage and of the light behind it, FULL times, (rows, columns, channels).

    over_aperture: within circles. over_samples: within samples, mean over photosites and circles.
    """

    over_aperture: np.ndarray
    over_samples: np.ndarray


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
    over_aperture = over_samples = np.zeros(behind[0].shape)
    for number, (_, coverage) in enumerate(layers[:-1]):
        if coverage is None:
            break
        light, cover = (values.astype(np.float64) for values in (behind[number + 1], coverage[..., None]))  # for the dark
        near_px, far_px = circles_px[number], max(circles_px[number + 1 :])
        widths = [_width(math.sqrt(math.pi) * radius_px + beside_px, scale) for radius_px in (near_px, far_px)]
        product = _variance(cover, widths[0]) * _variance(light, widths[1])
        over_aperture = over_aperture + FULL * np.sqrt(product)
        side = _width(MIXED_SAMPLES / samples, scale)
        cover_2, light_2 = (
            _mean(_variance(values, side), _width(math.sqrt(math.pi) * radius_px + beside_px, scale))
            for values, radius_px in ((cover, near_px), (light, far_px))
        )
        over_samples = over_samples + FULL * np.sqrt(np.maximum(cover_2, 0.0) * np.maximum(light_2, 0.0))
    return LayerContrast(over_aperture, over_samples)


def _width(side_px: float, scale: float) -> int:
    """Pixels that a square of this side [photosites] touches at most along an axis; 1: it is a point."""
    return 1 if side_px == 0.0 else math.ceil(side_px * scale) + 1


def _mean(values: np.ndarray, width: int) -> np.ndarray:
    """Mean over squares of so many pixels around each."""
    from scipy.ndimage import uniform_filter1d

    for axis in (0, 1):
        values = uniform_filter1d(values, width, axis=axis, mode="nearest")
    return values


def _variance(values: np.ndarray, width: int) -> np.ndarray:
    """Variance over squares of so many pixels around each, at least 0 but for rounding."""
    if width == 1:
        return np.zeros_like(values)
    middle = values - values.mean(axis=(0, 1))  # keeps digits
    return np.maximum(_mean(middle * middle, width) - _mean(middle, width) ** 2, 0.0)
