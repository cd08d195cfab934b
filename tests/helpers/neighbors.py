"""What neighbouring photosites share, in float64 NumPy: binning and crosstalk by their definitions."""

import numpy as np


def binned(mosaic: np.ndarray, factor: int, step: int) -> np.ndarray:
    """Sums by the definition: photosite (X, Y) of the result collects factor x factor places of its colour."""
    height, width = (side // (factor * step) * step for side in mosaic.shape)
    result = np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            y, x = (place // step * factor * step + place % step for place in (row, column))
            result[row, column] = mosaic[y : y + factor * step : step, x : x + factor * step : step].sum()
    return result


def crosstalk_stencil(side: float, corner: float) -> np.ndarray:
    """Shares that a photosite gets of its own light and of its neighbours'."""
    return np.array([[corner, side, corner], [side, 1 - 4 * side - 4 * corner, side], [corner, side, corner]])


def stencil_sum(mosaic: np.ndarray, stencil: np.ndarray) -> np.ndarray:
    """Sum of the 3 x 3 photosites around each, weighted; beyond the edge the nearest is repeated.

    SciPy's `correlate` leaves out weights below 2.2e-16, which count where lights stand over black.
    """
    height, width = mosaic.shape
    padded = np.pad(mosaic, 1, mode="edge")
    return sum(stencil[y, x] * padded[y : y + height, x : x + width] for y in range(3) for x in range(3))
