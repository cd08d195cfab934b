"""Squares of the sensor over which photosites average a coarse scene, whose light is bilinear between its pixels.

Such light has closed means over any square, so that the spots of a low-pass filter and the open area of photosites are exact.
Squares beside them give samples a transfer function that falls as that of a lens does (`simulator.optics.psf.bent_light`).
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Footprint:
    """Squares about the middle of a photosite, the same along both axes.

    side_px: of each [photosites]. low_pass_px: distance of the spots of a low-pass filter on either axis.
    beside_px, share: half of this share of the light is so far to either side along each axis.
    """

    side_px: float = 1.0
    low_pass_px: float = 0.0
    beside_px: float = 0.0
    share: float = 0.0

    @property
    def places(self) -> list[tuple[float, float]]:
        """Places of the middles of the squares along an axis [photosites], and the share of each; the shares have the sum 1."""
        spots = ((-0.5 * self.low_pass_px, 0.5), (0.5 * self.low_pass_px, 0.5)) if self.low_pass_px else ((0.0, 1.0),)
        beside = ((-self.beside_px, 0.5 * self.share), (0.0, 1.0 - self.share), (self.beside_px, 0.5 * self.share))
        pairs = itertools.product(spots, beside if self.share else ((0.0, 1.0),))
        return [(spot + way, one * part) for (spot, one), (way, part) in pairs]

    @property
    def reach_px(self) -> float:
        """Distance of its border from the middle [photosites]."""
        return 0.5 * (self.side_px + self.low_pass_px) + (self.beside_px if self.share else 0.0)

    def beside_transfer(self, cycles: np.ndarray) -> np.ndarray:
        """Transfer function of the squares beside those of filter and aperture, along an axis [cycles per photosite]."""
        return np.asarray(1.0 - self.share * (1.0 - np.cos(2.0 * math.pi * self.beside_px * cycles)))

    def reads(self, scale: float) -> int:
        """Scene pixels per axis that a photosite reads, of so many pixels per photosite."""
        return math.floor(2.0 * self.reach_px * scale) + 3

    def of_pixel(self, away_px: np.ndarray, width_px: float) -> np.ndarray:
        """Mean light of photosites so far from the middle of a pixel of light 1 along an axis [photosites], same shape."""
        half, found = 0.5 * self.side_px / width_px, np.zeros(away_px.shape)
        for place, share in self.places:
            middle = (away_px + place) / width_px
            found += 0.5 * share / half * (_tent_until(middle + half) - _tent_until(middle - half))
        return found

    def pixel_shares(self, scale: float, offset_px: float, first: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Pixels of a scene in photosites from `first` on along an axis: the first that each reads, and the shares of `reads`.

        offset_px: scene position of the sensor's border. (count,) int32, (reads, count) float32.
        """
        middle = offset_px + scale * (np.arange(first, first + count) + 0.5) - 0.5  # in centres of pixels
        start = np.floor(middle - scale * self.reach_px)
        away = (middle - start - np.arange(self.reads(scale))[:, None]) / scale
        return start.astype(np.int32), self.of_pixel(away, 1.0 / scale).astype(np.float32)


def _tent_until(x: np.ndarray) -> np.ndarray:
    """Integral of the light of a pixel of radiance 1 from its centre to so far from it [px], same shape."""
    place = np.clip(x, -1.0, 1.0)
    return place - 0.5 * place * np.abs(place)
