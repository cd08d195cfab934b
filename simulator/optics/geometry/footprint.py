"""Squares of the sensor over which samples of light average a scene whose pixels are even squares, or tents of bilinear light.

Such light has closed means over any square, so that the spots of a low-pass filter and the open area of photosites are exact.
A square more, and others beside them, give samples a transfer function that falls as that of a lens does
(`simulator.optics.psf.sampled_light`).
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Footprint:
    """Squares about the middle of a photosite, or of a sample of it, the same along both axes.

    side_px: of each [photosites]. low_pass_px: distance of the spots of a low-pass filter on either axis [photosites].
    beside_px, share: half of this share of the light is so far to either side along each axis.
    blur_px: side of a square over which all of it is averaged once more [photosites]; 0: none.
    """

    side_px: float = 1.0
    low_pass_px: float = 0.0
    beside_px: float = 0.0
    share: float = 0.0
    blur_px: float = 0.0

    @property
    def places(self) -> list[tuple[float, float]]:
        """Places of the middles of the squares along an axis [photosites], and the share of each; the shares have the sum 1."""
        spots = ((-0.5 * self.low_pass_px, 0.5), (0.5 * self.low_pass_px, 0.5)) if self.low_pass_px else ((0.0, 1.0),)
        beside = ((-self.beside_px, 0.5 * self.share), (0.0, 1.0 - self.share), (self.beside_px, 0.5 * self.share))
        pairs = itertools.product(spots, beside if self.share else ((0.0, 1.0),))
        return [(spot + way, one * part) for (spot, one), (way, part) in pairs]

    @property
    def reach_px(self) -> float:
        """Distance of its border from the middle of a sample [photosites]."""
        return 0.5 * (self.side_px + self.low_pass_px + self.blur_px) + (self.beside_px if self.share else 0.0)

    def beside_transfer(self, cycles: np.ndarray) -> np.ndarray:
        """Transfer function of all that is not filter and aperture, along an axis [cycles per photosite], same shape."""
        beside = 1.0 - self.share * (1.0 - np.cos(2.0 * math.pi * self.beside_px * cycles))
        return np.asarray(np.sinc(self.blur_px * cycles) * beside)

    def of_pixel(self, away_px: np.ndarray, width_px: float, *, is_tent: bool) -> np.ndarray:
        """Mean light of samples so far from the middle of a pixel of light 1 along an axis [photosites], same shape.

        width_px: of the pixel, an even square. is_tent: its light is bilinear instead, and twice as wide at its foot.
        """
        sides = [self.side_px, width_px, *([width_px] if is_tent else []), *([self.blur_px] if self.blur_px else [])]
        found = np.zeros(away_px.shape)
        for place, share in self.places:
            found += share * width_px * _boxes(away_px + place, sides)
        return found


def footprint_of(footprints: tuple[Footprint, ...], channel: int) -> Footprint | None:
    """Return that of a channel; one is that of all; None: there are none."""
    return footprints[min(channel, len(footprints) - 1)] if footprints else None


def pixels_read(reach_px: float, scale: float, *, is_tent: bool) -> int:
    """Scene pixels per axis that a sample reads, of so many pixels per photosite; is_tent: as of `Footprint.of_pixel`.

    reach_px: of the largest footprint [photosites].
    """
    return math.floor(2.0 * reach_px * scale) + (3 if is_tent else 2)


def pixel_shares(
    footprints: Sequence[Footprint], scale: float, offset_px: float, over: int, first: int, count: int, *, is_tent: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Pixels of a scene in samples from `first` on along an axis: the first that each reads, and the shares of all.

    footprints: of each channel. offset_px: scene position of the sensor's border. over: samples per photosite.
    (count,) int32, (channels, pixels read, count) float32.
    """
    reach_px = max(one.reach_px for one in footprints)
    middle = offset_px + scale * ((np.arange(first, first + count) + 0.5) / over) - 0.5  # in centres of pixels
    start = np.floor(middle - scale * reach_px + (0.0 if is_tent else 0.5))
    away = (middle - start - np.arange(pixels_read(reach_px, scale, is_tent=is_tent))[:, None]) / scale
    found = {one: one.of_pixel(away, 1.0 / scale, is_tent=is_tent).astype(np.float32) for one in set(footprints)}
    return start.astype(np.int32), np.stack([found[one] for one in footprints])


def _boxes(x: np.ndarray, sides: list[float]) -> np.ndarray:
    """Convolution of boxes of these sides and area 1, same shape as x: differences of a power of x, whose sign changes at 0."""
    order, found = len(sides), np.zeros(x.shape)
    for ways in itertools.product((1.0, -1.0), repeat=order):
        at = x + 0.5 * sum(way * side for way, side in zip(ways, sides, strict=True))
        found += math.prod(ways) * np.abs(at) * at ** (order - 2)
    found[np.abs(x) >= 0.5 * sum(sides)] = 0.0
    return found / (2.0 * math.factorial(order - 1) * math.prod(sides))
