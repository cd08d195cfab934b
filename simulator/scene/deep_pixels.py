"""Samples of deep pictures as they are, unmerged, for renderers that follow rays."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class DeepPixels:
    """Samples of each pixel, from front to back.

    starts: (layers * height * width + 1,) int64, first sample of each pixel of each layer; starts[-1] is their number.
    width: pixels of a row.
    planes: (samples, bands) float32, weights of the scene's spectra, multiplied by alpha. alpha: (samples,) float32, 0 to 1.
    near_m, far_m: (samples,) float64, depths between which a sample lies [m]; equal for a surface.
    layers: what a ray meets in one layer lies over all that it meets in later ones, wherever it stands; 1 in deep pictures.
    """

    starts: np.ndarray
    width: int
    planes: np.ndarray
    alpha: np.ndarray
    near_m: np.ndarray
    far_m: np.ndarray
    layers: int = 1

    @property
    def pixel(self) -> np.ndarray:
        """Pixel of each sample: (layer * height + row) * width + column."""
        return np.repeat(np.arange(len(self.starts) - 1), np.diff(self.starts))


def surface_slopes(pixels: DeepPixels, radius_px: np.ndarray, steepest: float) -> np.ndarray:
    """Change of the blur radius along the surface that each sample belongs to, to the right and down, (2, samples).

    A sample and one of the next pixel of its layer belong to one surface where each is the other's nearest in radius, and their
    radii differ by at most `steepest`. Of the differences to both sides the smaller counts, or their mean where they are alike;
    0 where a sample has no neighbour, or is a volume. radius_px: (samples,) signed blur radius, ascending in each pixel.
    """
    surface = np.flatnonzero(pixels.far_m <= pixels.near_m)
    pixel, radius = pixels.pixel[surface], radius_px[surface].astype(np.float64)
    low = radius.min(initial=0.0) - 1.0
    span = radius.max(initial=0.0) - low + 1.0
    keys = pixel * span + (radius - low)
    row, column = np.divmod(pixel, pixels.width)
    height = (len(pixels.starts) - 1) // pixels.width // pixels.layers
    row %= height
    sides = (1, column == 0, column == pixels.width - 1), (pixels.width, row == 0, row == height - 1)
    slopes = np.zeros((2, len(radius_px)))
    for axis, (step, starts, ends) in enumerate(sides):
        after = _nearest(keys, pixel, radius, low, span, step, ends)
        before = _nearest(keys, pixel, radius, low, span, -step, starts)
        after, before = _mutual(after, before), _mutual(before, after)
        gaps = []
        for partner, sign in ((before, -1.0), (after, 1.0)):
            gap = np.where(partner >= 0, sign * (radius[partner] - radius), np.nan)
            gaps.append(np.where(np.abs(gap) <= steepest, gap, np.nan))
        one, other = (np.where(np.isnan(gap), rest, gap) for gap, rest in (gaps, gaps[::-1]))
        alike = np.abs(one - other) <= 0.25 * np.maximum(np.abs(one), np.abs(other)) + 1e-9
        slope = np.where(alike, 0.5 * (one + other), np.where(np.abs(one) < np.abs(other), one, other))
        slopes[axis, surface] = np.nan_to_num(slope)
    return slopes


def _nearest(
    keys: np.ndarray, pixel: np.ndarray, radius: np.ndarray, low: float, span: float, step: int, without: np.ndarray
) -> np.ndarray:
    """Find the sample of the pixel `step` further whose radius is nearest to each sample's: index, or -1.

    without: (samples,) bool, samples beside which no pixel is.
    """
    wanted = (pixel + step) * span + (radius - low)
    above = np.searchsorted(keys, wanted)
    best, distance = np.full(len(keys), -1), np.full(len(keys), np.inf)
    for candidate in (above - 1, above):
        valid = (candidate >= 0) & (candidate < len(keys))
        index = np.clip(candidate, 0, max(len(keys) - 1, 0))
        valid &= (pixel[index] == pixel + step) & ~without
        away = np.where(valid, np.abs(radius[index] - radius), np.inf)
        best, distance = np.where(away < distance, index, best), np.minimum(away, distance)
    return best


def _mutual(there: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Keep partners whose own partner is the sample again; -1 for the others."""
    return np.where((there >= 0) & (back[there] == np.arange(len(there))), there, -1)
