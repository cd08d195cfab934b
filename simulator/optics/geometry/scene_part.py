"""The part of a scene that a window of the sensor sees."""

import math
from dataclasses import dataclass
from functools import reduce
from typing import Self

import numpy as np

from simulator.optics.geometry.projection import Projection
from simulator.sensor.camera.camera_sections import Window

ALIGNED_PX = 256  # multiple of the width of a part, so that kernels of windows anywhere run in groups of one size
BESIDE_PX = 3.0  # scene pixels that are read beside a position: the next one, and rounding of the position in float32
STEP_PX = 8  # distance of the photosites at which a distortion is evaluated


@dataclass(frozen=True)
class ScenePart:
    """A rectangle of scene pixels: the first column and row, columns, rows."""

    x: int
    y: int
    width: int
    height: int

    def joined(self, other: Self) -> Self:
        """Return the smallest rectangle that holds both."""
        x, y = min(self.x, other.x), min(self.y, other.y)
        right, bottom = (
            max(self.x + self.width, other.x + other.width),
            max(self.y + self.height, other.y + other.height),
        )
        return type(self)(x, y, right - x, bottom - y)


def find_scene_part(areas: list[tuple[Projection, Window]]) -> ScenePart:
    """Return the part of a scene that the photosites of some windows read, through a projection each.

    A part that is narrower than the scene is a multiple of ALIGNED_PX wide.
    """
    found = reduce(ScenePart.joined, (_seen(projection, window) for projection, window in areas))
    scene_width = areas[0][0].scene_width
    width = -(-found.width // ALIGNED_PX) * ALIGNED_PX
    if width >= scene_width:
        return ScenePart(0, found.y, scene_width, found.height)
    return ScenePart(min(found.x, scene_width - width), found.y, width, found.height)


def _seen(projection: Projection, window: Window) -> ScenePart:
    """Return the scene pixels that the photosites of a window read; what lies beyond the scene reads its edge."""
    x: tuple[float, float] = window.x, window.x + window.width
    y: tuple[float, float] = window.y, window.y + window.height
    beside = BESIDE_PX
    if projection.warp is not None:
        x, y = _undistorted(projection, window)
        beside += projection.scale * projection.stretch * STEP_PX
    sides = []
    for (low, high), offset, length in (
        (x, projection.offset_x, projection.scene_width),
        (y, projection.offset_y, projection.scene_height),
    ):
        first = math.floor(min(max(offset + projection.scale * low - beside, 0.0), length - 1.0))
        last = math.ceil(min(max(offset + projection.scale * high + beside, first + 1.0), length))
        sides.append((first, last - first))
    (left, wide), (top, tall) = sides
    return ScenePart(left, top, wide, tall)


def _undistorted(projection: Projection, window: Window) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the ranges of x and y in the undistorted picture of photosites of a window, at every STEP_PX of them."""
    warp = projection.warp
    assert warp is not None  # only a distorted picture asks
    across, down = (
        np.linspace(first, first + length, -(-length // STEP_PX) + 1)
        for first, length in ((window.x, window.width), (window.y, window.height))
    )
    places = [warp.undistorted(*np.meshgrid(across, down), channel) for channel in range(len(warp.magnification))]
    x, y = (np.stack([place[axis] for place in places]) for axis in (0, 1))
    if not (np.isfinite(x).all() and np.isfinite(y).all()):  # far beyond the sensor the distortion may not be invertible
        return (-math.inf, math.inf), (-math.inf, math.inf)
    return (float(x.min()), float(x.max())), (float(y.min()), float(y.max()))
