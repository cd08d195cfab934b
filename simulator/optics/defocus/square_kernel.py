"""Exact weights of samples that are even squares, behind a round aperture: image of the aperture * photosite * square.

The disk is a stack of chords. For a chord, the convolution of photosite and square is a product of one function of the row and
one of the column, each with a closed form. Over the chords both are analytic between the angles at which a side of the
photosite or an end of the chord crosses a border of squares, so that Gauss-Legendre quadrature between those leaves 1e-8 of the
peak.
"""

import math

import numpy as np

NODES = 5  # of the quadrature between two crossings
SAME = 12  # digits to which angles that differ are told apart [rad]


def disk_square_weights(radius_px: float, samples_per_axis: int, open_side: float = 1.0) -> np.ndarray:
    """Weights of the even squares around a photosite that sees through a disk: (n, n) float64, sum 1.

    radius_px: blur radius, above 0 [photosites]. samples_per_axis: squares per photosite and axis. open_side: side of the
    photosite's light-sensitive square [photosites].
    """
    radius, side = abs(radius_px) * samples_per_axis, open_side * samples_per_axis
    reach = max(0, math.ceil(radius + 0.5 * (side - samples_per_axis)))
    size = 2 * reach + samples_per_axis
    borders = np.arange(size + 1) - 0.5 * size
    angles, shares = _chords(radius, np.concatenate([borders - 0.5 * side, borders + 0.5 * side]))
    none = np.zeros_like(angles)
    down = _overlaps(borders, side, radius * np.sin(angles), none)
    across = _overlaps(borders, side, none, radius * np.cos(angles))
    weights = (down * shares[:, None]).T @ across
    far = np.abs(borders[:-1] + 0.5) + 0.5 * (side + 1.0)
    inside = np.hypot(far[:, None], far) <= radius  # all of it, from all of the photosite: equal to the last bit, for few taps
    if inside.any():
        weights[inside] = weights[inside].mean()
    return weights / weights.sum()


def _chords(radius: float, crossings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles from -pi/2 to pi/2 of chords of a disk, at radius * sin(angle), and their shares of its area: both (chords,).

    crossings: places at which the overlap with a square bends, of a chord's distance from the middle or of its end.
    """
    bends = np.arcsin(np.clip(crossings / radius, -1.0, 1.0))
    ends = 0.5 * math.pi - np.abs(bends)
    cuts = np.unique(np.round(np.concatenate([bends, ends, -ends]), SAME))
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    middle, half = 0.5 * (cuts[1:] + cuts[:-1]), 0.5 * (cuts[1:] - cuts[:-1])
    angles = (middle[:, None] + half[:, None] * nodes).ravel()
    shares = (half[:, None] * weights).ravel() * np.cos(angles) ** 2
    return angles, shares / shares.sum()


def _overlaps(borders: np.ndarray, side: float, shifts: np.ndarray, reaches: np.ndarray) -> np.ndarray:
    """Share of an interval of this side on each square, (chords, squares), moved by a shift and by all of -reach to reach."""
    low, reach = (shifts - 0.5 * side)[:, None] - borders, reaches[:, None]
    return np.diff(_ramp(low, reach) - _ramp(low + side, reach), axis=1) / side


def _ramp(place: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Mean of max(place + t, 0) over t from -reach to reach."""
    wide = np.maximum(reach, 1e-9)
    bent = (np.maximum(place + wide, 0.0) ** 2 - np.maximum(place - wide, 0.0) ** 2) / (4.0 * wide)
    return np.where(reach > 0.0, bent, np.maximum(place, 0.0))
