"""Depth of a scene: one distance, a depth picture of its own, or a channel of the scene's EXR.

Depth is the distance along the optical axis (a renderer's Z), not along the ray.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.scene.pixel_file import PixelFile, first_fault, read_pixels
from simulator.units import Metres

LengthUnit = Annotated[Literal["m", "cm", "mm", "km"], "unit of the stored numbers"]
METRES_PER_UNIT = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3}


@dataclass(frozen=True)
class DepthImage:
    """Depth in a file of its own, of the scene's size; depth = stored number * scale, in `unit`.

    Integer files are read as the codes they hold (a 16-bit PNG of millimetres needs `unit: mm` only).
    """

    image: Annotated[Path, "depth picture (EXR, TIFF, PNG) or .npy array"]
    channel: Annotated[str | None, "channel to read; not needed when there is only one, or a Z"] = None
    unit: LengthUnit = "m"
    scale: Annotated[float, "factor on the stored numbers"] = 1.0

    def __post_init__(self):
        _check_scale(self.scale)


@dataclass(frozen=True)
class DepthChannel:
    """Depth in a channel of the scene's own EXR; depth = stored number * scale, in `unit`."""

    channel: Annotated[str, "channel to read, such as Z"] = "Z"
    unit: LengthUnit = "m"
    scale: Annotated[float, "factor on the stored numbers"] = 1.0

    def __post_init__(self):
        _check_scale(self.scale)


Depth = Metres | DepthImage | DepthChannel


def _check_scale(scale: float) -> None:
    require(scale > 0 and math.isfinite(scale), "scene.depth.scale", scale, "give a number above 0")


def check_depth(depth_m: float | DepthImage | DepthChannel) -> None:
    """Raise PhotositeError for a constant depth of 0 or less, or NaN."""
    if not isinstance(depth_m, DepthImage | DepthChannel):
        require(depth_m > 0, "scene.depth", f"{depth_m} m", "give a distance above 0 m, such as 2 m")


def load_depth(depth_m: float | DepthImage | DepthChannel, scene_file: PixelFile) -> float | np.ndarray:
    """Read depth for Scene.depth_m [m]: the float itself, or (height, width) float32.

    Raises PhotositeError for a missing channel, another size than the scene's, NaN, or depth of 0 or less;
    inf is allowed.
    """
    if not isinstance(depth_m, DepthImage | DepthChannel):
        return float(depth_m)
    if isinstance(depth_m, DepthChannel):
        path, stored = scene_file.path, scene_file.channel(depth_m.channel, "scene.depth.channel")
    else:
        path = depth_m.image
        stored = _depth_picture(depth_m)
    if stored.shape != scene_file.size:
        raise PhotositeError(
            f"scene.depth.image = {path}: is {stored.shape[1]}x{stored.shape[0]} pixels, but the scene is "
            f"{scene_file.size[1]}x{scene_file.size[0]}; export both at one size"
        )
    depth = stored.astype(np.float32) * np.float32(depth_m.scale * METRES_PER_UNIT[depth_m.unit])
    fault = ~(depth > 0)  # NaN too
    if fault.any():
        raise PhotositeError(
            f"scene.depth = {path}: depth is NaN, 0 or less in {first_fault(fault)}; fill these pixels (inf is allowed)"
        )
    return depth


def _depth_picture(source: DepthImage) -> np.ndarray:
    file = read_pixels(source.image, "scene.depth.image")
    names = [name for index, name in enumerate(file.channels) if index != file.alpha]
    if source.channel is not None:
        return file.channel(source.channel, "scene.depth.channel")
    if len(names) == 1:
        return file.channel(names[0], "scene.depth.image")
    require("Z" in names, "scene.depth.image", source.image, f"has channels {', '.join(names)}; add channel: and one of them")
    return file.channel("Z", "scene.depth.image")
