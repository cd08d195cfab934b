"""A demonstration scene with measured depth: the Middlebury 2014 "Motorcycle" stereo pair, as scikit-image ships it.

Source: D. Scharstein et al., "High-resolution stereo datasets with subpixel-accurate ground truth", GCPR 2014;
the quarter-size pair and its calibration are those of skimage.data.stereo_motorcycle.
"""

import math
import os
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError
from simulator.raw.image_files import write_picture
from simulator.scene.color_channels import srgb_to_linear

SOURCE = "Middlebury Stereo 2014, Motorcycle (Scharstein et al., GCPR 2014), quarter size, left picture"
FOCAL_LENGTH_PX = 994.978
DISPARITY_OFFSET_PX = 31.086  # x of the right principal point minus the left's ("doffs")
BASELINE_M = 0.193001


def motorcycle_scene(path: str | os.PathLike) -> Path:
    """Write the scene as a float EXR: R, G, B linear sRGB, and Z, the depth along the optical axis [m].

    741 x 500 pixels, 2.1 to 5.0 m. The attribute `field_of_view_deg` holds the full horizontal angle (40.85 deg),
    `filled_share` the share of pixels whose depth was not measured and was filled.
    Returns the path. Raises PhotositeError when scikit-image is missing or the file cannot be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".exr":
        raise PhotositeError("the scene is an EXR; give a name that ends in .exr", file=path)
    left, depth_m, filled_share = motorcycle_pair()
    planes = np.dstack([srgb_to_linear(left / 255.0), depth_m]).astype(np.float32)
    measures = {"field_of_view_deg": field_of_view_deg(left.shape[1]), "filled_share": filled_share}
    write_picture(path, planes, ("R", "G", "B", "Z"), compression="zip", ImageDescription=SOURCE, **measures)
    return path


def motorcycle_pair() -> tuple[np.ndarray, np.ndarray, float]:
    """Return the picture, (500, 741, 3) uint8 sRGB, its depth without holes [m], (500, 741), and the share that was filled.

    Raises PhotositeError when scikit-image is missing.
    """
    left, disparity = _stereo_pair()
    return left, *fill_holes(depth_from_disparity(disparity))


def depth_from_disparity(disparity_px: np.ndarray) -> np.ndarray:
    """Z = baseline * f / (disparity + doffs) [m] (Middlebury 2014 calibration); NaN where there is no disparity."""
    known = np.where(np.isfinite(disparity_px), disparity_px, np.nan).astype(np.float64)
    return BASELINE_M * FOCAL_LENGTH_PX / (known + DISPARITY_OFFSET_PX)


def field_of_view_deg(width_px: int) -> float:
    """Full horizontal angle: 2 atan(width / 2 f) [deg]."""
    return math.degrees(2.0 * math.atan(0.5 * width_px / FOCAL_LENGTH_PX))


def fill_holes(depth_m: np.ndarray) -> tuple[np.ndarray, float]:
    """Depth without NaN, and the share of pixels that was filled.

    A hole takes the farther of its two nearest measured neighbours in the row, because most holes are background
    that only one of the two cameras saw. A row without any measured pixel takes the nearest row that has one.
    """
    known = np.isfinite(depth_m)
    filled_share = 1.0 - float(known.mean())
    measured_rows = np.flatnonzero(known.any(axis=1))
    nearest = measured_rows[np.abs(np.arange(len(depth_m))[:, None] - measured_rows).argmin(axis=1)]
    depth_m, known = depth_m[nearest], known[nearest]
    columns = np.arange(depth_m.shape[1])
    before = np.maximum.accumulate(np.where(known, columns, -1), axis=1)
    after = np.minimum.accumulate(np.where(known, columns, columns.size)[:, ::-1], axis=1)[:, ::-1]
    before = np.where(before < 0, after, before)
    after = np.where(after == columns.size, before, after)
    farther = np.maximum(np.take_along_axis(depth_m, before, axis=1), np.take_along_axis(depth_m, after, axis=1))
    return farther, filled_share


def _stereo_pair() -> tuple[np.ndarray, np.ndarray]:
    """Left picture (height, width, 3) uint8 and its disparity (height, width) [px]."""
    try:
        from skimage.data import stereo_motorcycle

        left, _, disparity = stereo_motorcycle()
    except (ImportError, OSError) as error:
        raise PhotositeError(
            f"the motorcycle scene needs scikit-image and its pictures ({error}): pip install 'photosite[demo]'"
        ) from error
    return left, disparity
