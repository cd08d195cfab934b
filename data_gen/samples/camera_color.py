"""From camera colours to linear sRGB by the published matrix alone, as raw readers do it."""

import numpy as np

from simulator.raw.white_balance import SRGB_TO_XYZ


def camera_to_srgb(color_matrix: tuple[tuple[float, ...], ...] | None) -> np.ndarray:
    """Return the matrix (3, 3) from white-balanced camera R, G, B to linear sRGB; white stays white.

    color_matrix: (3, 3) XYZ to camera under D65 (DNG ColorMatrix); None gives the identity, so colours stay the camera's.
    It is the inverse of the matrix from sRGB to camera whose rows are scaled to the sum 1: dcraw's and LibRaw's `rgb_cam`,
    the first three columns of rawpy's `color_matrix`.

    Files hold these numbers, so they are computed with scalar arithmetic: NumPy's `@` and `inv` call a BLAS whose last bit
    depends on the processor, and the same data set would have other bytes on another machine.
    """
    if color_matrix is None:
        return np.eye(3)
    srgb_to_xyz = SRGB_TO_XYZ.tolist()
    from_srgb = [[sum(row[k] * srgb_to_xyz[k][column] for k in range(3)) for column in range(3)] for row in color_matrix]
    return _inverse([[value / sum(row) for value in row] for row in from_srgb])


def _inverse(matrix: list[list[float]]) -> np.ndarray:
    """Return the inverse of a (3, 3) matrix by Cramer's rule."""
    rows = [_cross_product(matrix[(place + 1) % 3], matrix[(place + 2) % 3]) for place in range(3)]  # the adjugate's columns
    determinant = sum(value * cofactor for value, cofactor in zip(matrix[0], rows[0], strict=True))
    return np.ascontiguousarray(np.transpose(rows)) / determinant  # row by row: an .npy file says the order in its header


def _cross_product(one: list[float], other: list[float]) -> list[float]:
    """Return the cross product of two vectors of 3 numbers."""
    (x, y, z), (u, v, w) = one, other
    return [y * w - z * v, z * u - x * w, x * v - y * u]
