"""Depth of a scene: one distance, a depth picture of its own, a channel of the scene's EXR, or the pass of a renderer.

Inside the simulator depth is the distance along the optical axis (a renderer's Z). Files may hold the distance along the
ray instead: `along: ray` converts it with the field of view.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.scene.depth_holes import Holes, fill_holes, nearest_known
from simulator.scene.length_units import METRES_PER_UNIT, LengthUnit
from simulator.scene.pixel_file import PixelFile, check_window, read_pixels
from simulator.scene.renderer_depth import RendererDepth
from simulator.units import Metres

Along = Annotated[Literal["axis", "ray"], "distance along the optical axis, or along the ray; ray needs scene.field_of_view"]
LEAST_FARTHEST_M, MOST_NEAREST_M = 1e-3, 1e5  # a scene that ends within 1 mm, or begins beyond 100 km, is noted


@dataclass(frozen=True)
class DepthImage:
    """Depth in a file of its own, of the scene's size; depth = stored number * scale, in `unit`.

    Integer files are read as the codes they hold (a 16-bit PNG of millimetres needs `unit: mm` only).
    """

    image: Annotated[Path, "depth picture (EXR, TIFF, PNG) or .npy array"]
    channel: Annotated[str | None, "channel to read; not needed when there is only one, or a Z"] = None
    unit: LengthUnit = "m"
    scale: Annotated[float, "factor on the stored numbers"] = 1.0
    along: Along = "axis"
    holes: Holes = "error"

    def __post_init__(self) -> None:
        check_scale(self.scale)


@dataclass(frozen=True)
class DepthChannel:
    """Depth in a channel of the scene's own EXR; depth = stored number * scale, in `unit`."""

    channel: Annotated[str, "channel to read, such as Z"] = "Z"
    unit: LengthUnit = "m"
    scale: Annotated[float, "factor on the stored numbers"] = 1.0
    along: Along = "axis"
    holes: Holes = "error"

    def __post_init__(self) -> None:
        check_scale(self.scale)


Depth = Metres | DepthImage | DepthChannel | RendererDepth


def check_scale(scale: float) -> None:
    """Raise PhotositeError unless a factor on depth is above 0 and finite."""
    require(scale > 0 and math.isfinite(scale), "scene.depth.scale", scale, "give a number above 0")


def check_along(along: str, field_of_view_deg: float | None, key: str = "scene.depth") -> None:
    """Raise PhotositeError for distances along the ray without a field of view."""
    rule = "needs the angles of the rays; add scene.field_of_view, the full horizontal angle of the picture"
    require(along == "axis" or field_of_view_deg is not None, f"{key}.along", along, rule)


def check_depth(depth_m: Depth, field_of_view_deg: float | None = None, key: str = "scene.depth") -> None:
    """Raise PhotositeError for a constant depth of 0 or less, or NaN, or rays without a field of view."""
    if not isinstance(depth_m, float | int):
        check_along(depth_m.along, field_of_view_deg, key)
    else:
        require(depth_m > 0, key, f"{depth_m} m", "give a distance above 0 m, such as 2 m")


def load_depth(
    depth_m: Depth,
    scene_file: PixelFile,
    field_of_view_deg: float | None = None,
    key: str = "scene",
    coverage: np.ndarray | None = None,
    layer: str | None = None,
) -> tuple[float | np.ndarray, tuple[str, ...]]:
    """Read depth for Layer.depth_m [m]: the float itself, or (height, width) float32, and notes for the log.

    field_of_view_deg: for distances along the ray. key: section of the scene or layer, for messages.
    coverage: (height, width); where it is 0, depth is that of the nearest covered pixel, whatever the file says. A renderer's
        background counts where the layer covers all of a pixel: elsewhere its one sample of depth fell beside an edge.
    layer: EXR layer of the colours, which tells between the passes of several view layers.
    Raises PhotositeError for a missing channel, another size than the scene's, and holes (NaN, 0 or less) unless the
    source says how to fill them; inf is allowed.
    """
    if isinstance(depth_m, float | int):
        return float(depth_m), ()
    if coverage is not None and not coverage.any():
        return math.inf, ()
    file_notes: tuple[str, ...] = ()
    window = scene_file.window
    if isinstance(depth_m, DepthChannel):
        path, depth = scene_file.path, scene_file.channel(depth_m.channel, f"{key}.depth.channel")
    elif isinstance(depth_m, RendererDepth):
        path, depth = scene_file.path, depth_m.read(scene_file, layer, f"{key}.depth.renderer")
    else:
        file = read_pixels(depth_m.image, f"{key}.depth.image")
        path, depth, file_notes = depth_m.image, _depth_of(file, depth_m, key), file.notes
        window = file.window
    if depth.shape != scene_file.size:
        raise PhotositeError(
            f"is {depth.shape[1]}x{depth.shape[0]} pixels, but the scene is "
            f"{scene_file.size[1]}x{scene_file.size[0]}; export both at one size",
            key=f"{key}.depth.image",
            value=path,
        )
    check_window(path, f"{key}.depth.image", window, scene_file.window, "the scene")
    if not isinstance(depth_m, RendererDepth):
        with np.errstate(over="ignore"):  # what float32 cannot hold is at infinity
            depth = depth.astype(np.float32)
        depth *= np.float32(depth_m.scale * METRES_PER_UNIT[depth_m.unit])
    if coverage is not None:
        depth[coverage == 0] = np.inf  # nothing stands there: no hole
    holes = "error" if isinstance(depth_m, RendererDepth) else depth_m.holes
    depth, notes = fill_holes(depth, holes, f"{key}.depth", path)
    if coverage is not None:
        covered = coverage > 0
        known = covered & (np.isfinite(depth) | (coverage >= 1)) if isinstance(depth_m, RendererDepth) else covered
        depth = nearest_known(depth, known if known.any() else covered)
    if depth_m.along == "ray":
        assert field_of_view_deg is not None  # `check_along`
        depth *= axis_per_ray(depth.shape, field_of_view_deg)
    if isinstance(depth_m, RendererDepth):
        depth += np.float32(depth_m.axis_offset_m)
    return depth, (*file_notes, *notes, *unit_notes(depth, depth_m.unit, path))


def unit_notes(depth: np.ndarray, unit: str, path: Path) -> tuple[str, ...]:
    """Return a note on distances that no scene has, since the file may have another unit."""
    nearest, farthest = float(depth.min()), float(depth.max(initial=0.0, where=np.isfinite(depth)))
    odd = LEAST_FARTHEST_M > farthest > 0 or MOST_NEAREST_M < nearest < math.inf
    return (f"{path.name}: depth from {nearest:g} m to {farthest:g} m; check its unit, which is {unit}",) if odd else ()


def axis_per_ray(shape: tuple[int, int], field_of_view_deg: float) -> np.ndarray:
    """Return distance along the axis over distance along the ray, (height, width) float32: the cosine of the field angle.

    The axis meets the picture's centre; tan(field of view / 2) is half the width (pinhole projection).
    """
    height, width = shape
    per_px = 2.0 * math.tan(math.radians(0.5 * field_of_view_deg)) / width
    x, y = ((np.arange(count) + 0.5 - 0.5 * count) * per_px for count in (width, height))
    return (1.0 / np.sqrt(1.0 + x**2 + y[:, None] ** 2)).astype(np.float32)


def _depth_of(file: PixelFile, source: DepthImage, key: str) -> np.ndarray:
    names = [name for index, name in enumerate(file.channels) if index != file.alpha]
    if source.channel is not None:
        return file.channel(source.channel, f"{key}.depth.channel")
    if len(names) == 1:
        return file.channel(names[0], f"{key}.depth.image")
    rule = f"has channels {', '.join(names)}; add channel: and one of them"
    require("Z" in names, f"{key}.depth.image", source.image, rule)
    return file.channel("Z", f"{key}.depth.image")
