"""Planning of the lens blur: which depths share a blur circle, and which photosites a disk covers."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.lens import Lens

SHARP_PX = 0.3  # a blur circle of this radius stays inside its photosite: nothing to do
LAYER_STEP_PX = 1.0  # radius step between layers; doubled until the layers fit
MAX_LAYERS = 64  # one bit each in a 64-bit presence mask


@dataclass(frozen=True)
class Layers:
    """Layers of constant blur circle, nearest first.

    radii_px: blur radius of each layer [px].
    scene_layers: (height, width) uint8 layer of each scene pixel; None when there is one layer.
    """

    radii_px: tuple[float, ...]
    scene_layers: np.ndarray | None

    @property
    def reach_px(self) -> int:
        """Photosites that a blur needs on either side."""
        return math.ceil(max(self.radii_px)) + 1


def plan_layers(lens: Lens, pixel_pitch_um: float, depth_m: float | np.ndarray) -> Layers | None:
    """Layers of a depth map, or None when no blur circle is larger than a photosite.

    One depth keeps its exact radius. A depth map is cut in steps of the signed radius, which is linear in
    the inverse of the distance; index 0 is the nearest surface.
    """
    signed_px = np.asarray(lens.blur_radius_um(depth_m) / pixel_pitch_um, dtype=np.float64)
    nearest, farthest = float(signed_px.min()), float(signed_px.max())
    if max(abs(nearest), abs(farthest)) <= SHARP_PX:
        return None
    if nearest == farthest:
        return Layers((abs(nearest),), None)
    step = LAYER_STEP_PX
    while round(farthest / step) - round(nearest / step) >= MAX_LAYERS:
        step *= 2.0
    indices = np.rint(signed_px / step).astype(np.int64)
    first = int(indices.min())
    radii = tuple(abs(index) * step for index in range(first, int(indices.max()) + 1))
    return Layers(radii, (indices - first).astype(np.uint8))


def disk_chords(radius_px: float) -> tuple[np.ndarray, float]:
    """A disk as one centred run of photosites per row, with the disk's exact area in that row.

    Returns (rows, 2) float32 [whole photosites n on either side of the centre (-1: none), share g of the next], an odd
    number of rows from top to bottom, and the sum of all weights. A disk inside one photosite is that photosite.
    """
    if radius_px <= 0.5:
        return np.array([[0.0, 0.0]], dtype=np.float32), 1.0
    last = math.ceil(radius_px - 0.5)
    borders = np.clip(np.arange(-last, last + 2) - 0.5, -radius_px, radius_px)
    half_width = np.diff(_half_segment(borders, radius_px))
    whole = np.floor(half_width - 0.5)
    return np.stack([whole, half_width - 0.5 - whole], axis=-1).astype(np.float32), float(2.0 * half_width.sum())


def _half_segment(t: np.ndarray, radius: float) -> np.ndarray:
    """Integral of sqrt(radius^2 - t^2) dt."""
    return 0.5 * (t * np.sqrt(np.maximum(radius**2 - t**2, 0.0)) + radius**2 * np.arcsin(np.clip(t / radius, -1.0, 1.0)))
