"""Cores of kernels in a smooth scene: weights of near photosites that show in it what a kernel shows that reaches farther.

A kernel between samples of light ends at half a cycle per photosite, and rings along the axes wherever its light does not fall
on the middle of a photosite. A scene whose pixels are wider than two photosites hardly shows that. What it shows are its
pixels, tents at any place among the photosites: a core has the weights with which they differ least, in the mean over all
places, from what they are through the whole kernel.
"""

from functools import lru_cache

import numpy as np

from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.rotated_kernels import SAMPLES
from simulator.optics.psf.visibility import Visibility

PLACES = 8  # of a pixel among the photosites, along an axis, over which weights are chosen
SHOWN_PLACES = (0.0, 0.5)  # at which their error is asked [photosites]
LEAST_SHOWN = 1e-6  # share of the light of a photosite, squared, below which what pixels show of a pattern does not count


def pixel_light(away_px: np.ndarray, width_px: float, side_px: float = 1.0, apart_px: float = 0.0) -> np.ndarray:
    """Light of a scene pixel of light 1 on photosites at these distances from it, along one axis.

    width_px: half width of its tent. side_px: of the open part of a photosite. apart_px: distance of a low-pass filter's spots.
    """
    found = np.zeros(np.shape(away_px))
    for spot in (-0.5 * apart_px, 0.5 * apart_px):
        above, below = (_below(away_px + spot + end, width_px) for end in (0.5 * side_px, -0.5 * side_px))
        found += 0.5 * (above - below) / side_px
    return found


def _below(place: np.ndarray, width_px: float) -> np.ndarray:
    """Light of a tent of area 1 and this half width below a place."""
    x = np.clip(place / width_px, -1.0, 1.0)
    return np.asarray(0.5 + x - 0.5 * x * np.abs(x))


@lru_cache(maxsize=64)
def core_matrix(size: int, reach_px: int, width_px: float) -> np.ndarray:
    """Matrix of one axis from weights of photosites (size,) to those of the near ones, (2 reach_px + 1, size); keeps sums.

    Least squares over pixels at all places; size is odd. width_px: half width of the tent of a scene pixel.
    """
    half = size // 2
    reach_px = min(reach_px, half)
    last = half + np.ceil(width_px) + 1
    places = np.arange(-last, last + 1.0 / PLACES, 1.0 / PLACES)
    shown = pixel_light(places[:, None] - np.arange(-half, half + 1)[None, :], width_px)
    products = shown.T @ shown
    near = np.arange(half - reach_px, half + reach_px + 1)
    own = products[np.ix_(near, near)] + LEAST_SHOWN * products[half, half] * np.eye(len(near))
    found = np.linalg.solve(own, products[near] + LEAST_SHOWN * products[half, half] * np.eye(size)[near])
    one = np.linalg.solve(own, np.ones(len(near)))
    return np.asarray(found + np.outer(one / one.sum(), 1.0 - found.sum(axis=0)))


class ShownKernel:
    """A kernel as the pixels of a smooth scene show it.

    samples: light of a point, (SAMPLES * photosites, ...) float64, without the aperture of photosites, which is that of
    `sampling`.
    """

    def __init__(self, samples: np.ndarray, sampling: Sampling, pitch_um: float, seen: Visibility) -> None:
        self.seen, self.width_px = seen, 1.0 / seen.scale
        count = len(samples)
        self.half = count // SAMPLES // 2 + int(np.ceil(self.width_px)) + sampling.margin_px(pitch_um)
        open_part = self.width_px, float(np.sqrt(sampling.fill_factor)), sampling.low_pass_um / pitch_um
        exact = _shown_lines(self.half, count, SAMPLES, *open_part)
        light = samples / samples.sum()
        self.truth = [[down @ light @ across.T for across in exact] for down in exact]

    def error(self, table: np.ndarray) -> float:
        """Error of gathering with a table (size, size) of weights of sum 1, as of `Visibility.error`, at the worst place."""
        lines = _shown_lines(self.half, len(table), 1, self.width_px)
        table = table / table.sum()
        return max(
            self.seen.shown_error(down @ table @ across.T - truth)
            for down, row in zip(lines, self.truth, strict=True)
            for across, truth in zip(lines, row, strict=True)
        )


@lru_cache(maxsize=64)
def _shown_lines(half: int, count: int, per_photosite: int, *shape: float) -> list[np.ndarray]:
    """Light of scene pixels at SHOWN_PLACES on each of (2 half + 1) photosites, by their place (..., count) along an axis.

    per_photosite: of the places. shape: width and further arguments of `pixel_light`.
    """
    photosites = np.arange(-half, half + 1.0)[:, None]
    places = (np.arange(count) - count // 2)[None, :] / per_photosite
    return [pixel_light(photosites + place - places, *shape) for place in SHOWN_PLACES]
