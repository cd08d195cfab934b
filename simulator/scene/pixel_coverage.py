"""Exact share of a square pixel that a half-plane or a disk covers."""

import math

import numpy as np


def half_plane_coverage(distance_px: np.ndarray, angle_deg: float) -> np.ndarray:
    """Return the share of unit squares that lies on the positive side of a line, as `distance_px` has it.

    distance_px: signed distances of the squares' centres from the line [px]. angle_deg: between the line and an axis of the
    squares. A square seen along the normal is the convolution of two boxes of |cos| and |sin| of the angle, so the share is
    their integral: second differences of x^2 / 2, or of x where the line lies along an axis.
    """
    wide, narrow = sorted((abs(math.cos(math.radians(angle_deg))), abs(math.sin(math.radians(angle_deg)))), reverse=True)
    if narrow < 1e-9:
        return np.clip(distance_px / wide + 0.5, 0.0, 1.0)
    shifts = [(0.5 * (wide + narrow), 1.0), (0.5 * (wide - narrow), -1.0), (-0.5 * (wide - narrow), -1.0)]
    share = sum(sign * np.maximum(distance_px + shift, 0.0) ** 2 for shift, sign in shifts)
    share = share + np.maximum(distance_px - 0.5 * (wide + narrow), 0.0) ** 2
    return np.clip(share / (2.0 * wide * narrow), 0.0, 1.0)


def disk_coverage(x_px: float, y_px: float, radius_px: float, left: int, top: int, width: int, height: int) -> np.ndarray:
    """Return the share of each pixel of a part of a grid that a disk covers, (height, width) float64.

    x_px, y_px: centre of the disk; pixel (i, j) of the grid reaches from i to i + 1. left, top, width, height: of the part.
    The area of the disk in a rectangle is that of the quadrants of its four corners, `_quadrant_area`, added with their signs.
    """
    across = (left + np.arange(width + 1) - x_px) / radius_px
    down = (top + np.arange(height + 1) - y_px) / radius_px
    area = _quadrant_area(across[np.newaxis, :], down[:, np.newaxis])
    return np.clip(np.diff(np.diff(area, axis=0), axis=1) * radius_px**2, 0.0, 1.0)


def _quadrant_area(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the area of the unit disk with x < a and y < b: the integral over x of min(b, s) + s, s = sqrt(1 - x^2)."""
    a, b = np.clip(a, -1.0, 1.0), np.clip(b, -1.0, 1.0)
    half = np.sqrt(1.0 - b * b)  # where the height s of the disk is |b|
    inner = np.clip(a, -half, half)
    area = b * (inner + half) + _integral(inner) + _integral(half)
    outside = np.minimum(a, -half), np.maximum(a, half)  # where the disk is lower than b
    caps = 2.0 * (_integral(outside[0]) + 0.25 * math.pi + _integral(outside[1]) - _integral(half))
    return area + np.where(b > 0.0, caps, 0.0)


def _integral(t: np.ndarray) -> np.ndarray:
    """Integral of sqrt(1 - x^2) from 0 to t."""
    return 0.5 * (t * np.sqrt(np.maximum(1.0 - t * t, 0.0)) + np.arcsin(t))
