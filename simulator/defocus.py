"""Planning of the lens blur: the radius of each surface's blur circle, and which tile of the frame needs which method.

A tile is as cheap as what it sees allows: copied where it is sharp, one mean over the aperture's image where a single surface
fills its surroundings, and points of the aperture where surfaces hide each other.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from simulator.lens import ThinLens
from simulator.scene import Scene

SHARP_PX = 0.3  # a blur circle of this radius stays inside its photosite: nothing to do
TILE_COLUMNS, TILE_ROWS = 128, 16
STEEPEST_PX = 0.2  # change of the radius from photosite to photosite up to which a surface counts as one
SAME_PX = 0.02  # radii that lie closer share one blur circle
CLASSES = 64  # one bit each in a 64-bit mask


class Method(IntEnum):
    """How a tile is computed."""

    COPY = 0
    MEAN = 1
    OCCLUSION = 2


@dataclass(frozen=True)
class Defocus:
    """Blur of a scene's layers, nearest first.

    radii_px: signed radius of each layer's blur circle on the scene's grid [photosites], > 0 behind the plane in focus: a float
        or (height, width) float32.
    opaque: whether the last layer covers everything, so that no line through the aperture ends in the dark.
    """

    radii_px: tuple[float | np.ndarray, ...]
    opaque: bool

    @property
    def least_px(self) -> float:
        """Least signed radius."""
        return min(float(np.min(radius)) for radius in self.radii_px)

    @property
    def greatest_px(self) -> float:
        """Greatest signed radius."""
        return max(float(np.max(radius)) for radius in self.radii_px)

    @property
    def largest_px(self) -> float:
        """Largest blur circle's radius."""
        return max(abs(self.least_px), abs(self.greatest_px))

    @property
    def reach_px(self) -> int:
        """Photosites that a blur needs on either side."""
        return math.ceil(self.largest_px + self.class_step_px) + 2

    @property
    def class_step_px(self) -> float:
        """Width of a class of radii, half a photosite as long as the classes suffice."""
        return max(0.5, (self.greatest_px - self.least_px) / (CLASSES - 3))


def plan_defocus(lens: ThinLens, pixel_pitch_um: float, scene: Scene) -> Defocus | None:
    """Blur of a scene, or None when no blur circle is larger than a photosite."""
    radii = tuple(_radius_px(lens, pixel_pitch_um, layer.depth_m) for layer in scene.layers)
    planned = Defocus(radii, scene.layers[-1].coverage is None)
    return planned if planned.largest_px > SHARP_PX else None


def _radius_px(lens: ThinLens, pixel_pitch_um: float, depth_m: float | np.ndarray) -> float | np.ndarray:
    signed = lens.blur_radius_um(depth_m) / pixel_pitch_um
    if np.ndim(signed) == 0 or signed.min() == signed.max():
        return float(np.min(signed))
    return signed.astype(np.float32)


@dataclass(frozen=True)
class Relief:
    """What the tiles of a frame hold of one layer, (tile rows, tile columns) each.

    least_px, greatest_px: signed radius. steepest_px: greatest step of it between neighbours.
    classes: which classes of radii occur, one bit each. covered: greatest coverage. filled: least coverage.
    """

    least_px: np.ndarray
    greatest_px: np.ndarray
    steepest_px: np.ndarray
    classes: np.ndarray
    covered: np.ndarray
    filled: np.ndarray


def seen_from(relief: Relief) -> Relief:
    """Return, for each tile, what can reach it: all tiles whose blur circles touch it, and all that its own touch."""
    largest = np.maximum(np.abs(relief.least_px), np.abs(relief.greatest_px)) + 2.0
    rows, columns = (math.ceil(float(largest.max()) / size) for size in (TILE_ROWS, TILE_COLUMNS))
    found = {name: getattr(relief, name).copy() for name in Relief.__dataclass_fields__}
    merge = {"least_px": np.minimum, "filled": np.minimum, "classes": np.bitwise_or}
    padded = {name: np.pad(plane, ((rows, rows), (columns, columns)), mode="edge") for name, plane in found.items()}
    padded_largest = np.pad(largest, ((rows, rows), (columns, columns)), mode="edge")
    height, width = largest.shape
    for down in range(-rows, rows + 1):
        for right in range(-columns, columns + 1):
            gap = math.hypot(max(abs(down) - 1, 0) * TILE_ROWS, max(abs(right) - 1, 0) * TILE_COLUMNS)
            window = slice(rows + down, rows + down + height), slice(columns + right, columns + right + width)
            near = np.maximum(padded_largest[window], largest) > gap
            for name, plane in found.items():
                joined = merge.get(name, np.maximum)(plane, padded[name][window])
                np.copyto(plane, joined, where=near)
    return Relief(**found)
