"""Scenes of several pictures one behind the other, each with coverage (alpha) and depth: the occluded background is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Annotated

import numpy as np

from simulator.color.spectra import check_illuminant
from simulator.errors import PhotositeError, require
from simulator.scene.alpha import Alpha, cover_light, load_coverage
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.color_channels import color_alpha, color_channels, to_linear
from simulator.scene.depth import Depth, DepthChannel, check_depth, load_depth
from simulator.scene.picture_light import (
    Encoding,
    Illuminant,
    LuminanceOf,
    Negative,
    Upsampling,
    clip_negative,
    light_scene,
)
from simulator.scene.pixel_file import DataWindow, check_angle, check_finite, check_window, memory_for, read_pixels
from simulator.scene.scene import Layer, Outside, Scene
from simulator.units import CandelasPerSquareMetre, Degrees


@dataclass(frozen=True)
class PictureLayer:
    """One picture of a scene of layers.

    depth_m: one distance, {image: FILE, ...}, or {channel: Z, ...} of the layer's own EXR.
    """

    image: Annotated[Path, "EXR, HDR, TIFF, PNG, JPEG or .npy; RGB or grey, with or without alpha"]
    depth_m: Depth
    alpha: Alpha = "auto"
    alpha_image: Annotated[Path | None, "alpha in a picture of its own, 0 to 1 or integer codes; replaces the picture's"] = None
    layer: Annotated[str | None, "EXR layer that holds R, G, B and perhaps A"] = None

    def __post_init__(self) -> None:
        check_depth(self.depth_m, field_of_view_deg=90.0)  # whether one is given, the scene knows

    def load(self, key: str, scene: "LayeredScene") -> tuple[Layer, tuple[str, ...], DataWindow | None]:
        """Read one layer, whose planes are colour times coverage, notes, and where it lies in its display window.

        Raises PhotositeError that names `key`.
        """
        file = read_pixels(self.image, f"{key}.image")
        check_angle(file, scene.field_of_view_deg)
        depth_channel = self.depth_m.channel if isinstance(self.depth_m, DepthChannel) else "Z"
        stored = color_channels(file, self.layer, depth_channel, f"{key}.image")
        planes, notes = to_linear(stored, scene.encoding, file, f"{key}.image")
        check_finite(planes, f"{key}.image", self.image)
        clip_notes = clip_negative(planes, scene.negative, f"{key}.image", self.image)
        own = color_alpha(file, self.layer, depth_channel)
        coverage, straight, alpha_notes = load_coverage(file, own, self.alpha, self.alpha_image, key)
        if coverage is not None and straight:
            planes *= coverage[..., None]
        elif coverage is not None and (scene.encoding == "srgb" or scene.encoding == "auto" and stored.dtype.kind in "ui"):
            raise PhotositeError(
                f"the colours of {self.image} are sRGB codes, which are not in proportion to light; "
                "write encoding: linear, or alpha: straight",
                key=f"{key}.alpha",
                value="associated",
            )
        coverage = cover_light(planes, coverage)
        depth_m, depth_notes = load_depth(self.depth_m, file, scene.field_of_view_deg, key, coverage, self.layer)
        told = *file.notes, *notes, *clip_notes, *alpha_notes, *depth_notes
        return Layer(planes, depth_m, coverage), told, file.window


@dataclass(frozen=True)
class LayeredScene:
    """Pictures one behind the other, lit by one light, as `ImageScene` is.

    layers: front to back, all of one size; a layer covers what is written after it by its alpha.
    luminance_cd_m2: of white, or the mean over what a pinhole sees of all layers, as luminance_of says.
    negative: renderers' filters leave small negative values; "clip" sets them to 0 and says how many.
    field_of_view_deg: full horizontal angle of the pictures; left out, they fill the sensor.
    outside: what a camera sees past its edge: an error (refuse), no light (black), the edge (extend), or it again (repeat).
    """

    layers: tuple[PictureLayer, ...]
    luminance_cd_m2: CandelasPerSquareMetre
    luminance_of: LuminanceOf = "white"
    illuminant: Illuminant = "D65"
    upsampling: Upsampling = "mallett2019"
    encoding: Encoding = "auto"
    negative: Negative = "error"
    field_of_view_deg: Degrees | None = None
    outside: Outside = "refuse"

    def __post_init__(self) -> None:
        require(len(self.layers) > 0, "scene.layers", "[]", "give one layer or more, such as - {image: FILE, depth: 2 m}")
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_field_of_view(self.field_of_view_deg)
        for index, layer in enumerate(self.layers):
            check_depth(layer.depth_m, self.field_of_view_deg, f"scene.layers.{index}.depth")

    def load(self) -> Scene:
        """Read all layers.

        Raises PhotositeError as `ImageScene.load` does, and for layers of different size or data window, alpha outside 0 to
        1, and a layer that stands wholly before an earlier one.
        """
        with memory_for(self.layers[0].image, "scene.layers.0.image"):
            read = [layer.load(f"scene.layers.{index}", self) for index, layer in enumerate(self.layers)]
            layers, notes, windows = zip(*read, strict=True)
            self._check_sizes(layers)
            scene = self._scene(layers, tuple(note for told in notes for note in told))
            return replace(scene, window=self._common_window(windows))

    def _scene(self, layers: Sequence[Layer], notes: tuple[str, ...]) -> Scene:
        self._check_order(layers)
        bands = max(layer.planes.shape[2] for layer in layers)
        same = [_with_bands(layer, bands) for layer in layers]
        scene = light_scene(self, same, self.layers[0].image, (*notes, *self._occlusion_notes(layers)))
        return replace(scene, outside=self.outside)

    def _check_sizes(self, layers: Sequence[Layer]) -> None:
        (height, width), *others = (layer.planes.shape[:2] for layer in layers)
        for index, other in enumerate(others, 1):
            rule = f"is {other[1]}x{other[0]} pixels, but the first layer is {width}x{height}; export all at one size"
            require(other == (height, width), f"scene.layers.{index}.image", self.layers[index].image, rule)

    def _common_window(self, windows: Sequence[DataWindow | None]) -> DataWindow | None:
        """Return where the layers lie in their display window. Raises PhotositeError for layers that lie apart."""
        first = next((index for index, window in enumerate(windows) if window is not None), 0)
        for index, window in enumerate(windows):
            check_window(self.layers[index].image, f"scene.layers.{index}.image", window, windows[first], f"layer {first}")
        return windows[first]

    def _check_order(self, layers: Sequence[Layer]) -> None:
        ranges = [_depth_range_m(layer) for layer in layers]
        for (earlier, (nearest, _)), (later, (_, farthest)) in combinations(enumerate(ranges), 2):
            if farthest < nearest:
                raise PhotositeError(
                    f"stands wholly before layer {earlier}, which begins at {nearest:g} m; write layers from front to back",
                    key=f"scene.layers.{later}.depth",
                    value=f"up to {farthest:g} m",
                )

    def _occlusion_notes(self, layers: Sequence[Layer]) -> tuple[str, ...]:
        full = [index for index, layer in enumerate(layers[:-1]) if layer.coverage is None]
        reason = "covers all of the picture, so that nothing behind it is seen; give it alpha or alpha_image"
        return tuple(f"scene.layers.{index} ({self.layers[index].image.name}) {reason}" for index in full)


def _depth_range_m(layer: Layer) -> tuple[float, float]:
    """Return nearest and farthest distance of what a layer covers [m]; of an empty layer, 0 to infinity: in any order."""
    if layer.coverage is not None and not layer.coverage.any():
        return 0.0, np.inf
    # Where a layer covers nothing its depth is that of a covered pixel, so that all pixels can be compared.
    return float(np.min(layer.depth_m)), float(np.max(layer.depth_m))


def _with_bands(layer: Layer, bands: int) -> Layer:
    """Return the layer with this many bands; a grey one gets R = G = B."""
    own = layer.planes.shape[2]
    return layer if own == bands else replace(layer, planes=np.repeat(layer.planes, bands, axis=2))
