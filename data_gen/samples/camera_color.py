"""From camera colours to linear sRGB by the published matrix alone, as raw readers do it."""

import numpy as np

from simulator.raw.white_balance import SRGB_TO_XYZ


def camera_to_srgb(color_matrix: tuple[tuple[float, ...], ...] | None) -> np.ndarray:
    """Matrix (3, 3) from white-balanced camera R, G, B to linear sRGB; white stays white.

    color_matrix: (3, 3) XYZ to camera under D65 (DNG ColorMatrix); None gives the identity, so colours stay the camera's.
    It is the inverse of the matrix from sRGB to camera whose rows are scaled to the sum 1: dcraw's and LibRaw's `rgb_cam`,
    the first three columns of rawpy's `color_matrix`.
    """
    if color_matrix is None:
        return np.eye(3)
    to_camera = np.asarray(color_matrix, dtype=np.float64) @ SRGB_TO_XYZ
    return np.linalg.inv(to_camera / to_camera.sum(axis=1, keepdims=True))
