"""Weights of the aperture's image on a tilted surface, whose blur radius varies across the image.

On a plane the signed radius is s(x + w) = s + g . w. The ray through the point u of the pupil meets it at x + w with
w = s(x + w) u, so w = s v with v = u / (1 - g . u): straight lines stay straight, and a round pupil becomes an ellipse whose
focus is the photosite and whose eccentricity is |g|. Uniform light on the pupil is distributed as du/dv = (1 + g . v)^-3.
"""

import math
from functools import lru_cache

import numpy as np

from simulator.optics.defocus.photosite_area import TILTED_IN_PARTS, WHOLE, PhotositeArea
from simulator.optics.pupil.pupil import Pupil

OUTLINE_POINTS = 1024  # vertices of the pupil's outline: a polygon within 1e-5 of its radius
SLICES = 256  # rows into which the image's radius is cut
MOST_SLICES = 64  # largest number of them in one sample
KEPT_PX = 24.0  # largest blur radius of weights that are kept [samples]
STEP = 0.15  # largest relative change of the weight within one step down a column


def tilted_weights(
    pupil: Pupil, radius_px: float, slope: tuple[float, float], samples_per_axis: int, area: PhotositeArea = WHOLE
) -> np.ndarray:
    """Weights of the samples of a tilted plane that a photosite sees, (n, n) float64, sum 1, as `photosite_weights`.

    radius_px: signed radius at the photosite's centre [photosites]; each of its samples has its own. slope: (x, y) of the
    radius [photosites per photosite], shorter than 1 / pupil.corner_radius.
    Inside the image, weights are rounded to steps down the columns, so that `make_taps` needs few taps. Columns step at
    different rows, and each keeps its sum and its centroid.
    A round pupil has no direction: images of mirrored slopes, and of radii of either sign, are mirror images of one another.
    """
    if not pupil.is_round:
        return _weights(pupil, radius_px, slope, samples_per_axis, area)
    make = _upright_weights if abs(radius_px) * samples_per_axis <= KEPT_PX else _weights
    weights = make(pupil, abs(radius_px), (abs(slope[0]), abs(slope[1])), samples_per_axis, area)
    across, down = (-1 if (part < 0.0) != (radius_px < 0.0) else 1 for part in slope)
    return weights[::down, ::across]


def _weights(
    pupil: Pupil, radius_px: float, slope: tuple[float, float], samples_per_axis: int, area: PhotositeArea
) -> np.ndarray:
    """`tilted_weights`, computed."""

    def gather(radius_px: float, samples: int) -> np.ndarray:
        return _gathered(pupil, radius_px, slope, samples, area.shares(samples))

    return area.weights(gather, radius_px, samples_per_axis, TILTED_IN_PARTS)


@lru_cache(maxsize=1024)
def _upright_weights(
    pupil: Pupil, radius_px: float, slope: tuple[float, float], samples_per_axis: int, area: PhotositeArea
) -> np.ndarray:
    """`_weights` of radii and slopes above 0, which images of both signs share; nobody may change them."""
    weights = _weights(pupil, radius_px, slope, samples_per_axis, area)
    weights.flags.writeable = False
    return weights


def _gathered(
    pupil: Pupil, radius_px: float, slope: tuple[float, float], samples_per_axis: int, shares: np.ndarray
) -> np.ndarray:
    """`tilted_weights` of samples that are values. shares: of a photosite's open side on each of its samples."""
    corner = pupil.corner_radius
    places = np.arange(samples_per_axis) - 0.5 * (samples_per_axis - 1)
    radii = samples_per_axis * radius_px + slope[0] * places[None, :] + slope[1] * places[:, None]
    farthest = float(np.abs(radii).max()) * corner / (1.0 - math.hypot(*slope) * corner)
    reach = max(0, math.ceil(farthest - 0.5))
    size = 2 * reach + samples_per_axis
    spread, inside = np.zeros((size, size)), np.zeros((size, size))
    for (down, right), radius in np.ndenumerate(radii):
        weights, covered = _cells(pupil, float(radius), slope, reach)
        weights = weights * (shares[down] * shares[right])
        spread[down : down + 2 * reach + 1, right : right + 2 * reach + 1] += weights
        inside[down : down + 2 * reach + 1, right : right + 2 * reach + 1] += covered
    rows = math.floor(samples_per_axis * abs(radius_px) * min(STEP / max(3.0 * abs(slope[1]), 1e-9), 0.5))
    return _in_steps(spread, inside > samples_per_axis**2 - 1e-6, rows) / spread.sum()


def _cells(pupil: Pupil, radius: float, slope: tuple[float, float], reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Weight of each sample's cell around a sample, sum 1, and the share of the cell inside the image; both (2 reach + 1)^2."""
    size = 2 * reach + 1
    if abs(radius) * pupil.corner_radius <= 0.5 * (1.0 - math.hypot(*slope)):  # the image stays in one cell
        weights = np.zeros((size, size))
        weights[reach, reach] = 1.0
        return weights, weights
    slices = min(math.ceil(SLICES / abs(radius)), MOST_SLICES)
    rows = ((np.arange(size * slices) + 0.5) / slices - reach - 0.5) / radius
    low, high = _spans(pupil, slope, rows)
    borders = np.clip((np.arange(size + 1) - reach - 0.5) / radius, low[:, None], high[:, None])
    lengths = np.abs(np.diff(borders, axis=1))
    stretch = 1.0 + slope[1] * rows[:, None] + slope[0] * borders
    left, right = stretch[:, :-1], stretch[:, 1:]
    light = 0.5 * lengths * (left + right) / (left * right) ** 2  # integral of stretch^-3
    light, lengths = (part.reshape(size, slices, size).sum(axis=1) for part in (light, lengths))
    return light / light.sum(), lengths * abs(radius) / slices


def _spans(pupil: Pupil, slope: tuple[float, float], rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right end of rows of the pupil's image v; both 0 in rows outside it."""
    low, high = (np.interp(rows, y, x, left=0.0, right=0.0) for x, y in _sides(pupil, slope))
    return low, high


@lru_cache(maxsize=16)
def _sides(pupil: Pupil, slope: tuple[float, float]) -> list[tuple[np.ndarray, np.ndarray]]:
    """Places (x, y) of the left and of the right side of the pupil's image v, from top to bottom."""
    edge = _outline(pupil)
    edge = edge / (1.0 - edge @ slope)[:, None]
    edge = np.roll(edge, -int(edge[:, 1].argmin()), axis=0)
    bottom = int(edge[:, 1].argmax())
    right, left = edge[: bottom + 1], np.concatenate([edge[bottom:], edge[:1]])[::-1]
    return [(np.ascontiguousarray(chain[:, 0]), np.ascontiguousarray(chain[:, 1])) for chain in (left, right)]


@lru_cache
def _outline(pupil: Pupil) -> np.ndarray:
    """Outline of the pupil with about OUTLINE_POINTS vertices."""
    outline = pupil.outline()
    return outline[:: max(1, len(outline) // OUTLINE_POINTS)]


def _in_steps(weights: np.ndarray, inside: np.ndarray, rows: int) -> np.ndarray:
    """Round the weights inside the image to steps of so many rows, which begin at a different row in each column.

    The sum and the centroid of each column are kept; a column too short for that is not changed.
    """
    if rows < 2:
        return weights
    places = np.indices(weights.shape)
    row, column = places[0], places[1]
    offsets = np.floor(rows * np.mod(0.5 * (math.sqrt(5.0) - 1.0) * column, 1.0)).astype(int)
    steps = _means(weights, inside, ((row + offsets) // rows) * weights.shape[1] + column)
    mean = _means(weights, inside, column)
    exact, stepped = ((inside * (part - mean) * row).sum(axis=0) for part in (weights, steps))
    long = np.abs(stepped) > 0.5 * np.abs(exact)
    lift = exact / np.where(long, stepped, 1.0)
    return np.where(inside & long, mean + lift * (steps - mean), weights)


def _means(weights: np.ndarray, inside: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Mean of the weights inside the image over each group."""
    count = np.bincount(groups[inside], minlength=groups.max() + 1)
    total = np.bincount(groups[inside], weights[inside], minlength=groups.max() + 1)
    return (total / np.maximum(count, 1))[groups]
