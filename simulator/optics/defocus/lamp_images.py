"""The image of a pixel of light behind a lens out of focus, on photosites at any place: disk * pixel * light-sensitive square.

Pixel and square overlap by a trapezoid on either axis, T; light between the middles of pixels is a tent, a side of the pixel
folded with itself, whose overlap with the square is T folded with one more side. A photosite whose middle lies (x, y) from that
of the pixel sees the integral of T(x - u) T(y - v) over the disk. Along a row of the disk it is the difference of two powers;
over the rows it is analytic between the angles at which a bend of T meets the row or its end: Gauss-Legendre quadrature between
those leaves 1e-8 of the peak. Photosites whose T lies inside the disk see all of the pixel, those outside none.
"""

import itertools
import math

import numpy as np

from simulator.optics.defocus.defocus import Defocus
from simulator.optics.geometry.projection import Projection

NODES, NODE_SHARES = np.polynomial.legendre.leggauss(6)  # of the quadrature between two bends
SHORTEST = 1e-12  # angle between two bends that is looked at
MOST_KEPT = 64  # images, of lamps at different places in their photosites


def square_image(
    radius_px: float, width_px: float, open_side: float, down_px: np.ndarray, across_px: np.ndarray, *, is_tent: bool = False
) -> np.ndarray:
    """Mean light of photosites around a pixel of radiance 1 behind a disk, (rows, columns) float64.

    radius_px: of the disk, above 0. width_px: side of the pixel. open_side: of the light-sensitive squares. down_px, across_px:
    (rows,) and (columns,) middles of the photosites, from that of the pixel. All in photosites. is_tent: whether the light of
    the pixel falls to the middles of those beside it; else it is an even square.
    """
    radius, sides = abs(radius_px), (width_px, open_side, *([width_px] if is_tent else []))
    reach = 0.5 * sum(sides)
    y, x = np.meshgrid(np.abs(down_px), np.abs(across_px), indexing="ij")
    image = np.where(np.hypot(y + reach, x + reach) <= radius, (width_px * open_side) ** 2, 0.0)
    nearest = np.hypot(np.maximum(y - reach, 0.0), np.maximum(x - reach, 0.0))
    rim = (image == 0.0) & (nearest < radius)
    image[rim] = _rim(radius, sides, y[rim], x[rim])
    return image / (math.pi * (radius * open_side) ** 2)


def _rim(radius: float, sides: tuple[float, ...], y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Integral over the disk for photosites (photosites,) on its rim, at distances y and x; sides: that overlap."""
    bends, signs = _bends(sides)
    rows, ends = y[:, None] + bends, np.abs(x[:, None] + bends)
    at_ends = np.arccos(np.clip(ends / radius, 0.0, 1.0))
    rows = np.arcsin(np.clip(rows / radius, -1.0, 1.0))
    angles = np.concatenate([rows, at_ends, -at_ends], axis=1)
    angles = np.sort(np.clip(angles, rows[:, :1], rows[:, -1:]), axis=1)  # rows that overlap the pixel at all
    middle, half = 0.5 * (angles[:, 1:] + angles[:, :-1]), 0.5 * (angles[:, 1:] - angles[:, :-1])
    photosite, segment = np.nonzero(half > SHORTEST)  # others are between bends that meet, or beyond the rows
    middle, half = middle[photosite, segment], half[photosite, segment]
    angle = middle[:, None] + half[:, None] * NODES
    end, down, across, power = radius * np.cos(angle), y[photosite, None], x[photosite, None], len(sides) - 1
    length = _overlap(radius * np.sin(angle) - down, bends, signs, power)
    width = _overlap(end - across, bends, signs, power + 1) - _overlap(-end - across, bends, signs, power + 1)
    whole = sides[0] ** (2 * (power - 1))  # a tent is the side of the pixel folded with itself, over that side
    parts = (length * width * end) @ NODE_SHARES * half / whole
    return np.bincount(photosite, parts, minlength=len(y))


def _bends(sides: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Places at which the overlap of sides bends, from where their middles meet, in order, and how: (bends,) each."""
    ends = np.array([sum(one) for one in itertools.product(*((-0.5 * side, 0.5 * side) for side in sides))])
    ways = [math.prod(one) for one in itertools.product((1.0, -1.0), repeat=len(sides))]
    _, first, number = np.unique(np.round(ends, 12), return_index=True, return_inverse=True)
    return ends[first], np.bincount(number.ravel(), ways)


def _overlap(place: np.ndarray, bends: np.ndarray, signs: np.ndarray, power: int) -> np.ndarray:
    """Overlap of sides whose middles lie so far apart (power: their number, less one), or its integral from the left (it)."""
    found = np.zeros(place.shape)
    for bend, sign in zip(bends.tolist(), signs.tolist(), strict=True):
        ramp = np.maximum(place - bend, 0.0)
        term = sign * ramp
        for _ in range(power - 1):  # a product takes a tenth of the time of a power
            term *= ramp
        found += term
    return found / math.factorial(power)


class DefocusedSpots:
    """Images of the pixels of a scene behind blur circles of one radius, with the interface of `LampSpots`.

    radius_px: of the circles. width_px: side of a pixel. open_side: of the light-sensitive squares. All in photosites.
    is_tent: of `square_image`.
    """

    psf = None  # it is the same all over the sensor

    def __init__(self, radius_px: float, width_px: float, open_side: float, *, is_tent: bool = False) -> None:
        self.radius_px, self.width_px, self.open_side, self.is_tent = abs(radius_px), width_px, open_side, is_tent
        self.reach_px = math.ceil(self.radius_px + 0.5 * ((1 + is_tent) * width_px + open_side)) + 1
        self._found: dict[tuple[float, float], np.ndarray] = {}

    def image(self, channel: int, node: tuple[int, int], place: tuple[float, float]) -> np.ndarray:
        """Light of photosites around a pixel of radiance 1, (2 reach_px + 1, 2 reach_px + 1) float64, its own in the middle.

        place: of the pixel in its photosite, down and right. It is the same for each channel and node.
        """
        if place not in self._found:
            if len(self._found) >= MOST_KEPT:
                self._found.clear()
            away = np.arange(-self.reach_px, self.reach_px + 1) + 0.5
            down, across = away - place[0], away - place[1]
            self._found[place] = square_image(self.radius_px, self.width_px, self.open_side, down, across, is_tent=self.is_tent)
        return self._found[place]


def drawn_spots(defocus: Defocus, projection: Projection) -> DefocusedSpots:
    """Return the images of the pixels of a scene at one distance."""
    radius_px = defocus.radii_px[0]
    assert isinstance(radius_px, float)  # lamps are drawn behind these alone
    return DefocusedSpots(radius_px, 1.0 / projection.scale, projection.open_side, is_tent=projection.is_bilinear)
