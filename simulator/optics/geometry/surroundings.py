"""What lies outside a scene that is narrower than the field of view: nothing, its edge, or the scene again."""

import math
from dataclasses import replace
from typing import Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.geometry.projection import seen_pixels
from simulator.optics.lens.lens import Lens
from simulator.scene.scene import Layer, Scene, is_depth_map
from simulator.sensor.camera.camera import Camera

MARGIN_PX = 8  # photosites that are filled beyond the frame, besides the widest blur circle
MOST_PIXELS = 2**30


def surround(scene: Scene, lens: Lens, camera: Camera) -> Scene:
    """Return the scene, made larger as it asks for where the camera sees past its edge; the scene itself where it does not.

    It is filled as far as the lens sees and the widest blur circle of its own depths reaches: with no light (black), with its
    outermost pixels (extend), or with itself (repeat). Depth continues as the light does, at the edge's distance around black.
    Raises PhotositeError for a scene that would have more than 2^30 pixels.
    """
    if scene.outside == "refuse" or scene.field_of_view_deg is None or not lens.forms_image:
        return scene
    height, width = scene.planes.shape[:2]
    seen_width, seen_height = seen_pixels(scene, lens, camera)
    if seen_width <= width + 1e-6 and seen_height <= height + 1e-6:
        return scene
    per_photosite = seen_width / camera.width_px
    reach = math.ceil(per_photosite * (widest_blur_px(scene, lens, camera) + MARGIN_PX))
    down, across = (max(0, math.ceil(0.5 * (seen - own))) + reach for seen, own in ((seen_height, height), (seen_width, width)))
    pixels = (height + 2 * down) * (width + 2 * across)
    rule = f"the camera sees {pixels:.3g} pixels of it; use a longer lens, or a scene of fewer pixels"
    require(pixels <= MOST_PIXELS, "scene.outside", scene.outside, rule)
    return scene.remember(("surroundings", down, across), lambda: _enlarge(scene, down, across))


def widest_blur_px(scene: Scene, lens: Lens, camera: Camera) -> float:
    """Return the radius of the widest blur circle of the scene's depths [photosites]."""
    if not math.isfinite(lens.f_number):
        return 0.0
    ends_m = [end for layer in scene.layers for end in (float(np.min(layer.depth_m)), float(np.max(layer.depth_m)))]
    return max(abs(float(lens.blur_radius_um(end))) for end in ends_m) / camera.pixel_pitch_um


def _enlarge(scene: Scene, down: int, across: int) -> Scene:
    """Return the scene with so many more pixels on either side."""
    if scene.deep is not None:
        raise PhotositeError("a deep picture has no surroundings; leave it out", key="scene.outside", value=scene.outside)
    assert scene.field_of_view_deg is not None
    width = scene.planes.shape[1]
    tangent = math.tan(math.radians(0.5 * scene.field_of_view_deg)) * (width + 2 * across) / width
    kind = scene.outside
    enlarged = replace(
        scene.with_layers(_enlarge_layer(layer, kind, down, across) for layer in scene.layers),
        field_of_view_deg=math.degrees(2.0 * math.atan(tangent)),
        notes=(*scene.notes, f"the camera sees past the edge of the scene: outside it is {_TOLD[kind]}"),
    )
    if not any(array.flags.writeable for array in scene.arrays()):
        for array in enlarged.arrays():
            array.setflags(write=False)
    return enlarged


_TOLD = {"black": "no light", "extend": "the colour of its edge", "repeat": "the scene again"}


def _enlarge_layer(layer: Layer, kind: str, down: int, across: int) -> Layer:
    edge: Literal["wrap", "edge"] = "wrap" if kind == "repeat" else "edge"
    sides = (down, down), (across, across)
    if kind == "black":
        planes = np.pad(layer.planes, (*sides, (0, 0)))
    else:
        planes = np.pad(layer.planes, (*sides, (0, 0)), mode=edge)
    depth_m = np.pad(layer.depth_m, sides, mode=edge) if is_depth_map(layer.depth_m) else layer.depth_m
    coverage = None if layer.coverage is None else np.pad(layer.coverage, sides, mode=edge)
    return Layer(planes, depth_m, coverage)
