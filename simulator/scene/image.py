"""Scenes from RGB or grey pictures with depth."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from simulator.color.spectra import check_illuminant
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.color_channels import color_alpha, color_channels, to_linear
from simulator.scene.depth import Depth, DepthChannel, check_depth, load_depth
from simulator.scene.occluded_background import Hidden
from simulator.scene.picture_light import (
    Encoding,
    Illuminant,
    LuminanceOf,
    Negative,
    Upsampling,
    clip_negative,
    light_scene,
)
from simulator.scene.pixel_file import PixelFile, check_angle, check_finite, memory_for, read_pixels
from simulator.scene.renderer_depth import RendererDepth
from simulator.scene.scene import Layer, Outside, Scene
from simulator.units import CandelasPerSquareMetre, Degrees


@dataclass(frozen=True)
class ImageScene:
    """A picture lit by an illuminant: L(lambda) = k * illuminant * (RGB . reflectance basis), linear in RGB.

    RGB (1, 1, 1) is the perfect white in that light; values above 1 are highlights or lamps and stay linear.
    luminance_cd_m2: of white, or the mean over the picture, as luminance_of says; it sets k.
    negative: renderers' filters leave small negative values; "clip" sets them to 0 and says how many.
    depth_m: one distance, {image: FILE, ...}, {channel: Z, ...} of the scene's own EXR, or
        {renderer: blender}, the pass that a renderer wrote into it.
    field_of_view_deg: full horizontal angle of the picture; left out, it fills the sensor.
    outside: what a camera sees past its edge: an error (refuse), no light (black), the edge (extend), or it again (repeat).
    """

    image: Annotated[Path, "EXR, HDR, TIFF, PNG, JPEG or .npy; RGB or grey"]
    luminance_cd_m2: CandelasPerSquareMetre
    luminance_of: LuminanceOf = "white"
    illuminant: Illuminant = "D65"
    upsampling: Upsampling = "mallett2019"
    encoding: Encoding = "auto"
    layer: Annotated[str | None, "EXR layer that holds R, G, B"] = None
    negative: Negative = "error"
    depth_m: Depth = math.inf
    field_of_view_deg: Degrees | None = None
    hidden: Hidden = "none"
    outside: Outside = "refuse"

    def __post_init__(self) -> None:
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_depth(self.depth_m, self.field_of_view_deg)
        check_field_of_view(self.field_of_view_deg)

    def load(self) -> Scene:
        """Read the files; three planes for RGB, one for grey.

        Raises PhotositeError for a file that is missing, damaged, of a wrong number of channels, or holds NaN,
        Inf or negative values, or does not fit into memory; for depth of another size or data window, NaN, 0 or less; for a
        black picture with a mean anchor; for a field of view of a part of a display window.
        """
        with memory_for(self.image, "scene.image"):
            return self._load()

    def _load(self) -> Scene:
        file = read_pixels(self.image, "scene.image")
        check_angle(file, self.field_of_view_deg)
        depth_channel = self.depth_m.channel if isinstance(self.depth_m, DepthChannel) else "Z"
        scene = self.scene_of(color_channels(file, self.layer, depth_channel), file)
        depth_m, depth_notes = load_depth(self.depth_m, file, self.field_of_view_deg, layer=self.layer)
        has_alpha = color_alpha(file, self.layer, depth_channel) is not None
        notes = *file.notes, *_alpha_notes(file, has_alpha), *scene.notes, *depth_notes, *_depth_notes(self.depth_m, file)
        return replace(scene, depth_m=depth_m, notes=notes, window=file.window)

    def scene_of(self, stored: np.ndarray, file: PixelFile, key: str = "scene.image") -> Scene:
        """Scene of colours as they are stored, (height, width, 3 or 1), without its depth; errors name `key` and the file.

        Raises PhotositeError for NaN, Inf and negative values, and for a black picture with a mean anchor.
        """
        planes, notes = to_linear(stored, self.encoding, file, key)
        check_finite(planes, key, self.image)
        clip_notes = clip_negative(planes, self.negative, key, self.image)
        return replace(
            light_scene(self, [Layer(planes)], self.image, (*notes, *clip_notes)), hidden=self.hidden, outside=self.outside
        )


def _alpha_notes(file: PixelFile, has_alpha: bool) -> tuple[str, ...]:
    note = f"{file.path.name}: alpha dropped; the colours are used as stored (scene.layers uses alpha)"
    return (note,) if has_alpha else ()


def _depth_notes(depth_m: object, file: PixelFile) -> tuple[str, ...]:
    unused = "Z" in file.channels and not isinstance(depth_m, DepthChannel | RendererDepth)
    return (f"{file.path.name}: its channel Z is not used; write depth: {{channel: Z}} to use it",) if unused else ()
