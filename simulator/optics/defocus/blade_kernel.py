"""Exact weights of even squares behind an aperture with blades, or one that is skewed: image * open side * square.

The image is a stack of chords. For a chord, the share of the open side on a square is a product of one function of the row and
one of the column, each with a closed form. Both are polynomials between the rows in which a corner of the image lies, in which
an end of the open side crosses a border of squares, or in which the outline does so, where blades are straight, so that
Gauss-Legendre quadrature between those is exact. Along arcs it leaves 1e-7 of the peak: an end of a chord is a square root
there, beside the top of a disk from zero on, which is smooth in the angle of a half circle over those rows.
"""

import math

import numpy as np

from simulator.optics.pupil.convex_area import Disk, HalfPlane
from simulator.optics.pupil.pupil import Pupil

STRAIGHT_NODES, ARC_NODES = 2, 8  # of the quadrature between two rows: exact for cubics; along arcs, by angle
SAME = 13  # digits to which rows that differ are told apart [pupil radii]
ON_OUTLINE = 1e-9  # depth within which a point lies on the outline [pupil radii]


def blade_weights(pupil: Pupil, radius_px: float, samples_per_axis: int, side: float = 0.0) -> np.ndarray:
    """Weights of the even squares around a place that sees the image of a pupil without stops: (n, n) float64, sum 1.

    radius_px: signed blur radius, not 0 [squares]. samples_per_axis: 1 where the place is the middle of a square, or as many
    squares as a photosite has per axis. side: of the square over which the place is averaged [squares]; 0: it is not.
    A place at x sees the point x + radius u through the point u of the pupil.
    """
    radius = abs(radius_px)
    reach = max(0, math.ceil(radius * pupil.corner_radius + 0.5 * (side - samples_per_axis)))
    size = 2 * reach + samples_per_axis
    borders = np.arange(size + 1) - 0.5 * size
    across, down = pupil.skew
    rows, shares = _chords(pupil, np.unique([borders - 0.5 * side, borders + 0.5 * side]) / radius)
    ends = [part.span(rows) for part in pupil.opening]
    left, right = np.max([end[0] for end in ends], axis=0), np.min([end[1] for end in ends], axis=0)
    is_open = right > left
    rows, shares, left, right = rows[is_open], shares[is_open], left[is_open], right[is_open]
    columns = _lengths(borders, side, radius * (left + across * rows), radius * (right + across * rows))
    weights = (_shares(borders, side, radius * (1.0 + down) * rows) * shares[:, None]).T @ columns
    inside = _is_inside(pupil, (borders[:-1] + 0.5) / radius, 0.5 * (side + 1.0) / radius)
    if inside.any():  # all of it, from all of the open side: equal to the last bit, for few taps
        weights[inside] = weights[inside].mean()
    weights = np.maximum(weights, 0.0) / weights.sum()
    return weights if radius_px > 0.0 else weights[::-1, ::-1]


def _chords(pupil: Pupil, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows y of chords, and the height that each stands for: two of (chords,) [pupil radii].

    lines: places x and y in the image, skewed, at which shares bend [pupil radii].
    """
    across, down = pupil.skew
    crossings = np.concatenate([_crossings(part, across, lines) for part in pupil.opening])
    x, y = lines - across * crossings, crossings
    on_outline = np.isfinite(y) & (np.abs(pupil.depth(x, np.nan_to_num(y))) < ON_OUTLINE)
    disks = [part for part in pupil.opening if isinstance(part, Disk)]
    tops = [part.y + sign * part.radius for part in disks for sign in (-1.0, 1.0)]
    cuts = np.concatenate([lines / (1.0 + down), crossings[on_outline], pupil.corners()[:, 1], tops])
    cuts = np.unique(np.round(cuts[np.abs(cuts) < 1.0 + pupil.corner_radius], SAME))
    middle, half = 0.5 * (cuts[1:] + cuts[:-1])[:, None], 0.5 * (cuts[1:] - cuts[:-1])[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(ARC_NODES if disks else STRAIGHT_NODES)
    if disks:
        angles = 0.5 * math.pi * (nodes + 1.0)
        nodes, weights = -np.cos(angles), 0.5 * math.pi * weights * np.sin(angles)
    return (middle + half * nodes).ravel(), (half * weights).ravel()


def _crossings(part: Disk | HalfPlane, across: float, lines: np.ndarray) -> np.ndarray:
    """Rows in which the border of a part crosses lines x of the skewed image, (1 or 2, lines); nan where it does not."""
    if isinstance(part, HalfPlane):
        slope = part.ny - across * part.nx
        return ((part.offset - part.nx * lines) / (slope if slope else math.nan))[None]
    away, square = lines - part.x, 1.0 + across**2
    middle = (across * away + part.y) / square
    with np.errstate(invalid="ignore"):
        half = np.sqrt(middle**2 - (away**2 + part.y**2 - part.radius**2) / square)
    return np.stack([middle - half, middle + half])


def _is_inside(pupil: Pupil, middles: np.ndarray, half: float) -> np.ndarray:
    """Whether the corners of squares around middles (n,) lie in the image, (n, n). half: of their side [pupil radii]."""
    across, down = pupil.skew
    ends = np.stack([middles - half, middles + half])
    y = ends[:, None, :, None] / (1.0 + down)
    return np.asarray((pupil.depth(ends[None, :, None, :] - across * y, y) >= 0.0).all(axis=(0, 1)))


def _shares(borders: np.ndarray, side: float, places: np.ndarray) -> np.ndarray:
    """Share of an interval of this side around each place on each square: (places, squares)."""
    low, high = places[:, None] - 0.5 * side, places[:, None] + 0.5 * side
    if side == 0.0:
        return ((borders[:-1] <= low) & (low < borders[1:])).astype(np.float64)
    return np.diff(np.clip(borders, low, high), axis=1) / side


def _lengths(borders: np.ndarray, side: float, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Length of chords from low to high, averaged over an interval of this side, on each square: (chords, squares)."""
    if side == 0.0:
        return np.diff(np.clip(borders, low[:, None], high[:, None]), axis=1)
    return -np.diff(_before(borders, side, high) - _before(borders, side, low), axis=1)


def _before(borders: np.ndarray, side: float, places: np.ndarray) -> np.ndarray:
    """Length beyond each border of chords that end in places, averaged over an interval of this side, (places, borders)."""
    away = places[:, None] - borders
    return (np.maximum(away + 0.5 * side, 0.0) ** 2 - np.maximum(away - 0.5 * side, 0.0) ** 2) / (2.0 * side)
