"""Holes of a depth map: pixels without a measured distance."""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError
from simulator.scene.pixel_file import first_fault

Holes = Annotated[
    Literal["error", "infinity", "nearest"], "what NaN, 0 and negative numbers become: refused, infinity, the nearest depth"
]


def fill_holes(depth_m: np.ndarray, holes: Holes, key: str, path: Path) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return depth (height, width) float32 [m] with its holes filled, and a note that counts them.

    Raises PhotositeError, which names `key`, `path`, count and first pixel, for holes that are not to be filled.
    """
    fault = ~(depth_m > 0)  # NaN too
    if not fault.any():
        return depth_m, ()
    if holes == "error":
        raise PhotositeError(
            f"depth is NaN, 0 or less in {first_fault(fault)}; fill these pixels (inf is allowed), "
            "or write holes: infinity or holes: nearest in the depth section",
            key=key,
            value=path,
        )
    if holes == "infinity":
        return np.where(fault, np.float32(np.inf), depth_m), (f"{path.name}: depth set to infinity in {first_fault(fault)}",)
    if fault.all():
        raise PhotositeError(
            "all of it is NaN, 0 or less, so there is no nearest depth; check its channel", key=key, value=path
        )
    return nearest_known(depth_m, ~fault), (f"{path.name}: depth taken from the nearest pixel in {first_fault(fault)}",)


def nearest_known(values: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Return values (height, width), each unknown one taken from the nearest known pixel (Euclidean). One or more are known."""
    if known.all():
        return values
    from scipy.ndimage import distance_transform_edt

    nearest = np.empty((2, *known.shape), np.int32)
    distance_transform_edt(~known, return_distances=False, return_indices=True, indices=nearest)
    return values[nearest[0], nearest[1]]
