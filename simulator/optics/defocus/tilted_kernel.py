"""What a photosite sees of a tilted surface: points whose own blur circles reach it.

On a plane the signed radius is s(x + w) = s + g . w. The line through the place u of the pupil meets it at x + w with
w = s(x + w) u, so w = s v with v = u / (1 - g . u): straight lines stay straight, and a round pupil becomes an ellipse whose
focus is the photosite and whose eccentricity is |g|. Even light on the pupil is spread as du/dv = (1 + g . v)^-3.
"""

import math
from functools import lru_cache

import numpy as np

from simulator.optics.pupil.pupil import Pupil

OUTLINE_POINTS = 1024  # of the pupil's edge: a polygon within 1e-5 of its radius
SLICES = 256  # rows into which the image's radius is cut
MOST_SLICES = 64  # of them in one point
STEP = 0.15  # change of the weight down a column that is left as one step


def tilted_weights(pupil: Pupil, radius_px: float, slope: tuple[float, float], over: int) -> np.ndarray:
    """What a photosite sees of `over` x `over` points per photosite of a plane, (n, n) float64, sum 1, as `photosite_weights`.

    radius_px: signed radius at the photosite's centre [photosites]; each of its points has its own. slope: (x, y) of the radius
    [photosites per photosite], shorter than 1 / pupil.corner_radius.
    Inside the image, weights are constant over steps down the columns, so that `taps_of` finds few taps; columns step at
    different rows, and each keeps its sum and its centre.
    """
    corner = pupil.corner_radius
    places = np.arange(over) - 0.5 * (over - 1)
    radii = over * radius_px + slope[0] * places[None, :] + slope[1] * places[:, None]
    farthest = float(np.abs(radii).max()) * corner / (1.0 - math.hypot(*slope) * corner)
    reach = max(0, math.ceil(farthest - 0.5))
    size = 2 * reach + over
    spread, inside = np.zeros((size, size)), np.zeros((size, size))
    for (down, right), radius in np.ndenumerate(radii):
        weights, covered = _cells(pupil, float(radius), slope, reach)
        spread[down : down + 2 * reach + 1, right : right + 2 * reach + 1] += weights
        inside[down : down + 2 * reach + 1, right : right + 2 * reach + 1] += covered
    rows = math.floor(over * abs(radius_px) * min(STEP / max(3.0 * abs(slope[1]), 1e-9), 0.5))
    return _in_steps(spread, inside > over**2 - 1e-6, rows) / spread.sum()


def _cells(pupil: Pupil, radius: float, slope: tuple[float, float], reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Light that each cell about a point gives, sum 1, and its share inside the image; (2 reach + 1, 2 reach + 1)."""
    size = 2 * reach + 1
    if abs(radius) * pupil.corner_radius <= 0.5 * (1.0 - math.hypot(*slope)):  # stays in its cell
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
    """Left and right end of rows of the pupil's image v; both 0 beside it."""
    edge = _outline(pupil)
    edge = edge / (1.0 - edge @ slope)[:, None]
    edge = np.roll(edge, -int(edge[:, 1].argmin()), axis=0)
    bottom = int(edge[:, 1].argmax())
    right, left = edge[: bottom + 1], np.concatenate([edge[bottom:], edge[:1]])[::-1]
    return tuple(np.interp(rows, chain[:, 1], chain[:, 0], left=0.0, right=0.0) for chain in (left, right))


@lru_cache
def _outline(pupil: Pupil) -> np.ndarray:
    outline = pupil.outline()
    return outline[:: max(1, len(outline) // OUTLINE_POINTS)]


def _in_steps(weights: np.ndarray, inside: np.ndarray, rows: int) -> np.ndarray:
    """Make the weights inside constant over so many rows of a column, from a row that differs from column to column.

    Sum and centre of each column stay; a column too short for that stays as it is.
    """
    if rows < 2:
        return weights
    row, column = np.indices(weights.shape)
    offsets = np.floor(rows * np.mod(0.5 * (math.sqrt(5.0) - 1.0) * column, 1.0)).astype(int)
    steps = _means(weights, inside, ((row + offsets) // rows) * weights.shape[1] + column)
    mean = _means(weights, inside, column)
    exact, found = ((inside * (part - mean) * row).sum(axis=0) for part in (weights, steps))
    long = np.abs(found) > 0.5 * np.abs(exact)
    lift = exact / np.where(long, found, 1.0)
    return np.where(inside & long, mean + lift * (steps - mean), weights)


def _means(weights: np.ndarray, inside: np.ndarray, groups: np.ndarray) -> np.ndarray:
    """Mean of the weights inside over those of one group."""
    count = np.bincount(groups[inside], minlength=groups.max() + 1)
    total = np.bincount(groups[inside], weights[inside], minlength=groups.max() + 1)
    return (total / np.maximum(count, 1))[groups]
