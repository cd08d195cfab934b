"""The area of a photosite on a grid of samples, and the weights of samples that are even squares.

A photosite at x sees the light L of a surface, blurred by the image D of the aperture, over its open area B: (L * D * B)(x),
with * the convolution. Where samples are even squares Q, a sample's weight is (D * B * Q) at its centre, which is exact. Where
samples are values of smooth light, B becomes the mean over the places of the photosite's own samples, and a weight the mean of
D * Q over them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

FINEST = 64  # most parts per photosite and axis on which weights of even squares are computed
RADIUS_IN_PARTS = 24.0  # least blur radius in these parts, if FINEST allows
PART_OPEN = 2  # factor on both for photosites whose open area ends within parts
MOST_REACH = 3  # samples to either side of a path's weights that are all read one by one (`aperture_kernel.DIRECT`)
PATH_PX = 24.0  # largest radius of an image of the aperture whose weights follow the path of the samples
TILTED_IN_PARTS = 12.0  # the same for tilted surfaces
SQUARE = np.array([1.0, 22.0, 1.0]) / 24.0  # an even square, as three points one side apart with its variance of 1/12

Gather = Callable[[float, int], np.ndarray]
Way = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class ReadPath:
    """Where photosites read a picture of one pixel per photosite that is swept before a blur.

    ways: x, y of each instant from the pixel that has the photosite's number, and its share of the light [pixels]; of some
    photosites, one where all read alike. beside: rings of samples around the image of the aperture that have weights. inside:
    rings within its rim that have weights of their own; farther in they have one in common. is_positive: whether none is
    negative, beside lamps.
    """

    ways: tuple[Way, ...]
    beside: int
    inside: int
    is_positive: bool = False


@dataclass(frozen=True)
class PhotositeArea:
    """How a photosite gathers the samples around it.

    fine: whether the scene is finer than the photosites: even squares.
    whole_pixels: least samples per photosite and axis that divide each pixel of a fine scene into whole samples, which are even
        squares, too; 0: none do. Other samples count as values of smooth light.
    open_side: side of its light-sensitive square [photosites].
    path: along which samples were swept, one per photosite, behind images up to PATH_PX; None: they were not.
    """

    fine: bool = False
    whole_pixels: int = 0
    open_side: float = 1.0
    path: ReadPath | None = None

    def path_behind(self, radius_px: float, samples_per_axis: int) -> ReadPath | None:
        """Path of the samples that weights of this blur circle take into account; None: they have none."""
        return self.path if samples_per_axis == 1 and 0.0 < abs(radius_px) <= PATH_PX else None

    def has_squares(self, samples_per_axis: int) -> bool:
        """Whether samples are even squares."""
        return 0 < self.whole_pixels <= samples_per_axis

    def shares(self, samples_per_axis: int) -> np.ndarray:
        """Share of the open side on each of the photosite's own samples along one axis, float64, sum 1."""
        half = 0.5 * self.open_side
        borders = np.clip(np.arange(samples_per_axis + 1) / samples_per_axis - 0.5, -half, half)
        return np.diff(borders) / self.open_side

    def spread_by(self, samples_per_axis: int) -> float:
        """Variance along an axis that samples of smooth light add to the open area [square photosites].

        A sample is a mean over its square, and weighs by its area in the image of the aperture, which is another such mean.
        """
        middles = (np.arange(samples_per_axis) + 0.5) / samples_per_axis - 0.5
        own = float(self.shares(samples_per_axis) @ middles**2)
        return own + 2.0 / (12.0 * samples_per_axis**2) - self.open_side**2 / 12.0

    def beyond(self, samples_per_axis: int) -> float:
        """Share of what even samples with these shares see that lies beyond one border of the open side."""
        ends = np.arange(1, samples_per_axis + 1) / samples_per_axis - 0.5
        return float(self.shares(samples_per_axis) @ np.clip((ends - 0.5 * self.open_side) * samples_per_axis, 0.0, 1.0))

    def mean(self, weights: np.ndarray, samples_per_axis: int) -> np.ndarray:
        """Mean of weights (..., n, n) over the photosite's own samples: (..., m, m) with m = n + samples_per_axis - 1.

        Shares of both axes multiply, so that rows are averaged first and columns after them.
        """
        if samples_per_axis == 1:
            return weights
        size = weights.shape[-1]
        rows = np.zeros((*weights.shape[:-1], size + samples_per_axis - 1))
        spread = np.zeros((*weights.shape[:-2], size + samples_per_axis - 1, size + samples_per_axis - 1))
        open_ = [(place, share) for place, share in enumerate(self.shares(samples_per_axis).tolist()) if share > 0.0]
        for right, share in open_:
            rows[..., right : right + size] += share * weights
        for down, share in open_:
            spread[..., down : down + size, :] += share * rows
        return spread

    def _finer(self, parts: float) -> float:
        return (1, PART_OPEN)[self.open_side < 1.0] * parts

    def parts(self, radius_px: float, samples_per_axis: int, least_parts: float = RADIUS_IN_PARTS) -> int:
        """Parts per sample and axis on which the weights of a blur circle are computed; arguments as of `weights`."""
        if not self.has_squares(samples_per_axis) or radius_px == 0.0:
            return 1
        wanted = math.ceil(self._finer(least_parts) / (abs(radius_px) * samples_per_axis))
        return max(1, min(wanted, int(self._finer(FINEST)) // samples_per_axis))

    def weights(
        self, gather: Gather, radius_px: float, samples_per_axis: int, least_parts: float = RADIUS_IN_PARTS
    ) -> np.ndarray:
        """Weights of the samples around a photosite, (n, n) or (images, n, n), from `gather`.

        gather: weights of samples that are values of smooth light, by blur radius [photosites] and samples per photosite and
        axis. least_parts: least radius in parts on which weights of even squares are computed.
        """
        if not self.has_squares(samples_per_axis) or radius_px == 0.0:
            return gather(radius_px, samples_per_axis)
        least_px = 1.0 / self._finer(FINEST)
        if abs(radius_px) < least_px:  # light crosses the borders of squares in proportion to the radius
            none, some = (
                gather(0.0, samples_per_axis),
                self.weights(gather, math.copysign(least_px, radius_px), samples_per_axis),
            )
            share, reach = abs(radius_px) / least_px, (some.shape[-1] - none.shape[-1]) // 2
            return share * some + (1.0 - share) * _pad(none, reach)
        parts = self.parts(radius_px, samples_per_axis, least_parts)
        return self.add_parts(gather(radius_px, samples_per_axis * parts), samples_per_axis, parts)

    def add_parts(self, weights: np.ndarray, samples_per_axis: int, parts: int) -> np.ndarray:
        """Weights of samples that are even squares, from those of parts x parts of each that are values, (..., n, n)."""
        return _add_parts(_blur_by_square(weights), samples_per_axis, parts)


WHOLE = PhotositeArea()


def _pad(weights: np.ndarray, reach: int) -> np.ndarray:
    """Weights with `reach` more zeros on each side of the last two axes."""
    return np.pad(weights, [(0, 0)] * (weights.ndim - 2) + [(reach, reach)] * 2)


def _blur_by_square(weights: np.ndarray) -> np.ndarray:
    """Convolve weights (..., n, n) with an even square of one sample: (..., n + 2, n + 2)."""
    padded = _pad(weights, 2)
    before, own, after = SQUARE.tolist()
    rows = before * padded[..., :-2, :] + own * padded[..., 1:-1, :] + after * padded[..., 2:, :]
    return before * rows[..., :-2] + own * rows[..., 1:-1] + after * rows[..., 2:]


def _add_parts(weights: np.ndarray, samples_per_axis: int, parts: int) -> np.ndarray:
    """Sums of weights (..., n, n) over parts x parts, the photosite's own in the middle of the result."""
    reach = (weights.shape[-1] - samples_per_axis * parts) // 2
    weights = _pad(weights, -reach % parts)
    size = weights.shape[-1] // parts
    return weights.reshape(*weights.shape[:-2], size, parts, size, parts).sum(axis=(-3, -1))
