"""The image of a point out of focus: which share of its light each photosite gets, and how a kernel adds that up quickly.

A point's image is the shape of the aperture, scaled to the blur circle. Weights are the exact area that the shape has in common
with each photosite's square (of 1 px), divided by their own sum.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.clipped_kernel import shape_weights
from simulator.optics.pupil.convex_area import Disk
from simulator.optics.pupil.pupil import Pupil

SLICES = 64  # rows per photosite into which an aperture with blades is cut
MOST_AT_ONCE, MOST_WEIGHTS = 16, 4e6  # images of the clipped aperture that are computed together, and their weights
DIRECT = 49  # weights of a kernel up to which it takes no more reads than running sums do
CHUNK = 8  # taps that kernels/defocus.cl adds up at a time


def disk_weights(radius_px: float) -> np.ndarray:
    """Weights of a disk about a photosite's centre: (2 n + 1, 2 n + 1) float64, sum 1; [[1]] where it stays inside.

    The area of disk and square is exact: differences of F(x, y), the disk's area left of x and above y.
    """
    radius_px = abs(radius_px)
    if radius_px <= 0.5:
        return np.ones((1, 1))
    reach = math.ceil(radius_px - 0.5)
    borders = np.arange(-reach, reach + 2) - 0.5
    area = _corner_area(borders[None, :], borders[:, None], radius_px)
    weights = np.maximum(np.diff(np.diff(area, axis=0), axis=1), 0.0)
    return weights / weights.sum()


def aperture_weights(pupil: Pupil, radius_px: float) -> np.ndarray:
    """Weights of the aperture's image of this signed radius [px] on the axis, (2 n + 1, 2 n + 1) float64, sum 1.

    A photosite at x sees the point x + radius u through the place u of the pupil (`Pupil`). A pupil with blades is cut into
    SLICES rows per photosite, each with its exact length in each photosite.
    """
    if pupil.opening == (Disk(0.0, 0.0, 1.0),):
        return disk_weights(radius_px)
    if abs(radius_px) * pupil.corner_radius <= 0.5:
        return np.ones((1, 1))
    rows, left, right = (radius_px * places for places in pupil.spans())
    if radius_px < 0:
        rows, left, right = rows[::-1], right[::-1], left[::-1]
    reach = max(0, math.ceil(float(np.abs([*rows[[0, -1]], left.min(), right.max()]).max()) - 0.5))
    slices = (np.arange((2 * reach + 1) * SLICES) + 0.5) / SLICES - reach - 0.5
    low, high = (np.interp(slices, rows, ends, left=0.0, right=0.0)[:, None] for ends in (left, right))
    borders = np.arange(-reach, reach + 2) - 0.5
    lengths = np.diff(np.clip(borders, low, high), axis=1)
    weights = lengths.reshape(2 * reach + 1, SLICES, -1).sum(axis=1)
    return weights / weights.sum()


def photosite_weights(pupil: Pupil, radius_px: float, over: int) -> np.ndarray:
    """What a photosite sees of `over` x `over` points per photosite when a point's image has this radius [photosites].

    The aperture on the points' own squares, and the mean over the photosite's points: (n, n) float64, sum 1, n odd for an odd
    `over`; even sizes have the photosite's centre between their middle points.
    """
    return over_a_photosite(aperture_weights(pupil, over * radius_px), over)


def clipped_weights(pupil: Pupil, fields: np.ndarray, radii_px: np.ndarray, over: int) -> list[np.ndarray]:
    """What `photosite_weights` says of the pupil as its stops cut it at each of the fields (n, 2), with signed radii (n,)."""
    order, found = np.argsort(np.abs(radii_px)), [None] * len(radii_px)
    largest = 2.0 * over * pupil.corner_radius * float(np.abs(radii_px).max(initial=0.0)) + 3.0
    batch = max(1, min(MOST_AT_ONCE, int(MOST_WEIGHTS / largest**2)))
    for start in range(0, len(order), batch):  # images of nearly one size
        some = order[start : start + batch]
        images = over_a_photosite(shape_weights(pupil, fields[some], over * radii_px[some]), over)
        for number, image in zip(some, images, strict=True):
            found[number] = image
    return found


def over_a_photosite(weights: np.ndarray, over: int) -> np.ndarray:
    """Mean of weights (..., n, n) over the `over` x `over` points of a photosite: (..., n + over - 1, n + over - 1)."""
    size = weights.shape[-1]
    spread = np.zeros((*weights.shape[:-2], size + over - 1, size + over - 1))
    for down in range(over):
        for right in range(over):
            spread[..., down : down + size, right : right + size] += weights
    return spread / over**2


def _corner_area(x: np.ndarray, y: np.ndarray, radius: float) -> np.ndarray:
    """Area of the part of a disk about the origin with coordinates below x and y."""
    corner = np.sqrt(np.maximum(radius**2 - y**2, 0.0))  # where the line y leaves the disk
    left, right = np.minimum(x, -corner), np.minimum(x, corner)
    outer = _half_segment(left, radius) - _half_segment(-radius, radius)
    outer = outer + _half_segment(np.maximum(x, corner), radius) - _half_segment(corner, radius)
    middle = np.maximum(right + corner, 0.0)
    inner = y * middle + _half_segment(right, radius) - _half_segment(np.minimum(-corner, right), radius)
    return np.where(y > 0, 2.0 * outer, 0.0) + np.where(np.abs(y) < radius, inner, 0.0)


def _half_segment(t, radius: float) -> np.ndarray:
    """Integral of sqrt(radius^2 - t^2) from 0 to t, which is held within the disk."""
    t = np.clip(t, -radius, radius)
    return 0.5 * (t * np.sqrt(np.maximum(radius**2 - t**2, 0.0)) + radius**2 * np.arcsin(t / radius))


@dataclass(frozen=True)
class Taps:
    """A weighted sum over an area: of the values, or of running sums down the columns.

    rows, columns: (taps,) offset from the photosite [px] at which a value, or a column's running sum, is read; the sum at an
        offset holds all photosites above it. weights: (taps,) what it counts.
    sides: (columns,) offsets of the columns; totals: (columns,) the weights of each, added up. None are needed for values.
    direct: whether values are read.
    """

    rows: np.ndarray
    columns: np.ndarray
    weights: np.ndarray
    sides: np.ndarray
    totals: np.ndarray
    direct: bool = False


def taps_of(weights: np.ndarray, over: int = 1, direct: int = DIRECT) -> Taps:
    """Taps of a kernel (n, n): where a column's weight changes, a running sum is read.

    The photosite's own `over` x `over` points are its middle; its first one is element (n - over) // 2.

    The sum over w[i] v[i] is the sum over (w[i - 1] - w[i]) S[i], S[i] = v[0] + ... + v[i - 1] (summation by parts). Where the
    aperture is evenly bright a column changes at its two ends only: the work grows with the radius, not with its square.
    Of a small kernel the values themselves are read: as quick, and exact beside lights that a running sum drags along.
    direct: weights of the largest such kernel.
    """
    reach = (weights.shape[0] - over) // 2
    if weights.size <= direct:
        rows, columns = np.nonzero(weights)
        return Taps(rows - reach, columns - reach, weights[rows, columns], np.zeros(0, int), np.zeros(0), direct=True)
    steps = np.zeros((weights.shape[0] + 1, weights.shape[1]))
    steps[1:] = weights
    steps[:-1] -= weights
    rows, columns = np.nonzero(np.abs(steps) > 1e-12)
    sides = np.arange(weights.shape[1]) - reach
    return Taps(rows - reach, columns - reach, steps[rows, columns], sides, weights.sum(axis=0))
