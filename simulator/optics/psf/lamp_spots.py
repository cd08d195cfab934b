"""The image of a pixel of light behind a lens, a low-pass filter and the aperture of photosites, at any place among them.

A pixel is an even square; of a scene of fewer pixels than photosites, whose light is bilinear, a tent. Its image is the
convolution of that with the lens's point spread function, the filter's spots and the light-sensitive square.
"""

import math
from functools import cached_property

import numpy as np

from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.square_light import line_weights

FINER = 4  # places per cell and axis between which images are interpolated where lamps lie at many places
POINTS = 8  # of a polynomial between them


class LampSpots:
    """Images of pixels of light behind a point spread function in focus.

    width_px: side of a pixel [photosites]. is_tent: whether its light is bilinear. places: (n,) places of all pixels within
    their photosites on either axis, from 0 to below 1 [photosites].
    """

    def __init__(self, psf: FieldPsf, width_px: float, places: np.ndarray, *, is_tent: bool) -> None:
        self.psf, self.width_px, self.is_tent = psf, width_px, is_tent
        self.reach_px = psf.reach_px + psf.sample_reach_px + math.ceil(width_px * (1.0 if is_tent else 0.5)) + 1
        self._few = len(set(places.tolist())) <= 2 * FINER * self._per_photosite
        self._lines: dict[float, np.ndarray] = {}
        self._halves: dict[tuple[int, int, int, float], np.ndarray] = {}
        self._spots: dict[tuple[int, int, int, float, float], np.ndarray] = {}

    def image(self, channel: int, node: tuple[int, int], place: tuple[float, float]) -> np.ndarray:
        """Light of photosites around a pixel of radiance 1, (2 reach_px + 1, 2 reach_px + 1) float64, its own in the middle.

        node: of the point spread functions over the sensor. place: of the pixel in its photosite, down and right.
        """
        key = channel, *node, *place
        if key not in self._spots:
            half = *key[:3], place[0]
            if half not in self._halves:
                self._halves[half] = self._line(place[0]) @ self.psf.point_cells(channel, *node)[0]
            found = np.maximum(self._halves[half] @ self._line(place[1]).T, 0.0)
            if not self._few:
                return found
            self._spots[key] = found
        return self._spots[key]

    @property
    def _per_photosite(self) -> int:
        return self._size[1]

    @cached_property
    def _size(self) -> tuple[int, int]:
        """Cells across the lens's point spread function, and per photosite."""
        cells, per_photosite = self.psf.point_cells(0, 0, 0)
        return len(cells), per_photosite

    def _line(self, place: float) -> np.ndarray:
        """Weights of one axis from cells to photosites, (photosites, cells)."""
        if place not in self._lines:
            self._lines[place] = self._exact_line(place) if self._few else self._interpolated_line(place)
        return self._lines[place]

    def _exact_line(self, place: float) -> np.ndarray:
        away = np.arange(-self.reach_px, self.reach_px + 1) + 0.5 - place
        return line_weights(self.psf.sampling, self.psf.pitch_um, away, self.width_px, self._size, is_tent=self.is_tent)

    def _interpolated_line(self, place: float) -> np.ndarray:
        """Polynomials through the nearest POINTS of a table, whose error is 1e-6 of what is seen at half the lens's cut-off."""
        per_place = FINER * self._per_photosite
        first = math.floor(place * per_place) + 1
        near = np.arange(POINTS) - 0.5 * POINTS + 1.0 - (place * per_place - math.floor(place * per_place))
        weights = [math.prod(x / (x - one) for x in near if x != one) for one in near]
        return np.tensordot(weights, self._tabulated[first : first + POINTS], axes=1)

    @cached_property
    def _tabulated(self) -> np.ndarray:
        count = FINER * self._per_photosite
        return np.array([self._exact_line(number / count) for number in range(-POINTS // 2, count + POINTS // 2 + 1)])
