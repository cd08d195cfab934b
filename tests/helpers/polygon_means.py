"""Means of even squares over polygons in float64, by clipping each polygon at the borders of each pixel."""

import numpy as np


def clipped(corners: np.ndarray, axis: int, border: float, side: float) -> np.ndarray:
    """Corners (n, 2) of the part of a convex polygon where `side` times a coordinate is at most `side` times a border."""
    away = side * (corners[:, axis] - border)
    kept = []
    for number, after in enumerate(np.roll(np.arange(len(corners)), -1)):
        if away[number] <= 0.0:
            kept.append(corners[number])
        if away[number] * away[after] < 0.0:
            share = away[number] / (away[number] - away[after])
            kept.append(corners[number] + share * (corners[after] - corners[number]))
    return np.array(kept).reshape(-1, 2)


def area_of(corners: np.ndarray) -> float:
    """Area of a polygon, by the shoelace formula."""
    x, y = corners.T if len(corners) else np.zeros((2, 0))
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def polygon_mean(pixels: np.ndarray, corners: np.ndarray) -> float:
    """Mean of pixels (height, width), each an even square, over a convex polygon of corners (n, 2), x and y [px].

    Beyond the grid its edge pixels continue.
    """
    total = 0.0
    (left, top), (right, bottom) = np.floor(corners.min(axis=0)), np.ceil(corners.max(axis=0))
    for row in range(int(top), int(bottom)):
        strip = clipped(clipped(corners, 1, row, -1.0), 1, row + 1, 1.0)
        for column in range(int(left), int(right)):
            inside = clipped(clipped(strip, 0, column, -1.0), 0, column + 1, 1.0) if len(strip) else strip
            value = pixels[min(max(row, 0), pixels.shape[0] - 1), min(max(column, 0), pixels.shape[1] - 1)]
            total += value * area_of(inside)
    return total / area_of(corners)
