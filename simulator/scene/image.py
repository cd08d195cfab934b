"""Scenes from RGB or grey pictures with depth."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.scene import Scene
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.color_channels import color_channels, to_linear
from simulator.scene.depth import Depth, DepthChannel, check_depth, load_depth
from simulator.scene.pixel_file import PixelFile, check_finite, first_fault, memory_for, read_pixels
from simulator.spectra import WAVELENGTHS_NM, check_illuminant, illuminant, luminance_cd_m2, reflectance_basis
from simulator.units import CandelasPerSquareMetre, Degrees


@dataclass(frozen=True)
class ImageScene:
    """A picture lit by an illuminant: L(lambda) = k * illuminant * (RGB . reflectance basis), linear in RGB.

    RGB (1, 1, 1) is the perfect white in that light; values above 1 are highlights or lamps and stay linear.
    luminance_cd_m2: of white, or the mean over the picture, as luminance_of says; it sets k.
    negative: renderers' filters leave small negative values; "clip" sets them to 0 and says how many.
    depth_m: one distance, {image: FILE, ...}, or {channel: Z, ...} of the scene's own EXR.
    field_of_view_deg: full horizontal angle of the picture; left out, it fills the sensor.
    """

    image: Annotated[Path, "EXR, HDR, TIFF, PNG, JPEG or .npy; RGB or grey"]
    luminance_cd_m2: CandelasPerSquareMetre
    luminance_of: Annotated[Literal["white", "mean"], "what has that luminance: RGB (1, 1, 1), or the picture's mean"] = "white"
    illuminant: Annotated[str, 'CIE name such as D65 or A, or "3200 K"'] = "D65"
    upsampling: Annotated[Literal["mallett2019"], "how RGB becomes a reflectance spectrum"] = "mallett2019"
    encoding: Annotated[Literal["auto", "linear", "srgb"], "auto: integer files are sRGB, float files linear"] = "auto"
    layer: Annotated[str | None, "EXR layer that holds R, G, B"] = None
    negative: Annotated[Literal["error", "clip"], "what to do with negative radiance"] = "error"
    depth_m: Depth = math.inf
    field_of_view_deg: Degrees | None = None

    def __post_init__(self):
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_depth(self.depth_m)
        check_field_of_view(self.field_of_view_deg)

    def load(self) -> Scene:
        """Read the files; three planes for RGB, one for grey.

        Raises PhotositeError for a file that is missing, damaged, of a wrong number of channels, or holds NaN,
        Inf or negative values, or does not fit into memory; for depth of another size, NaN, 0 or less; for a black
        picture with a mean anchor.
        """
        with memory_for(self.image, "scene.image"):
            return self._load()

    def _load(self) -> Scene:
        file = read_pixels(self.image, "scene.image")
        depth_channel = self.depth_m.channel if isinstance(self.depth_m, DepthChannel) else "Z"
        stored, notes = color_channels(file, self.layer, depth_channel)
        planes, more_notes = to_linear(stored, self.encoding, file)
        check_finite(planes, "scene.image", self.image)
        planes, clip_notes = self._without_negative(planes)
        light = illuminant(self.illuminant)
        basis = reflectance_basis(self.upsampling) if planes.shape[2] == 3 else np.ones((1, light.size))
        spectra = light * basis
        return Scene(
            planes=planes,
            spectra_w_m2_sr_nm=spectra * self._radiance_scale(planes, spectra),
            wavelengths_nm=WAVELENGTHS_NM,
            illuminant=light,
            depth_m=load_depth(self.depth_m, file),
            field_of_view_deg=self.field_of_view_deg,
            notes=(*file.notes, *notes, *more_notes, *clip_notes, *_depth_notes(self.depth_m, file)),
        )

    def _without_negative(self, planes: np.ndarray) -> tuple[np.ndarray, tuple[str, ...]]:
        if planes.min() >= 0:
            return planes, ()
        fault = first_fault(planes < 0)
        if self.negative == "error":
            raise PhotositeError(
                f"scene.image = {self.image}: negative radiance in {fault}, down to {planes.min():.3g}; "
                "light is never negative: export it again, or write negative: clip to set these to 0"
            )
        return np.maximum(planes, np.float32(0)), (f"{self.image.name}: negative radiance set to 0 in {fault}",)

    def _radiance_scale(self, planes: np.ndarray, spectra: np.ndarray) -> float:
        """Factor that gives white, or the mean, its luminance."""
        weights = planes.mean(axis=(0, 1), dtype=np.float64) if self.luminance_of == "mean" else np.ones(len(spectra))
        relative = float(weights @ luminance_cd_m2(spectra))
        require(
            relative > 0,
            "scene.luminance_of",
            "mean",
            f"{self.image} is black, so it has no mean to scale; write luminance_of: white",
        )
        return self.luminance_cd_m2 / relative


def _depth_notes(depth_m: object, file: PixelFile) -> tuple[str, ...]:
    unused = "Z" in file.channels and not isinstance(depth_m, DepthChannel)
    return (f"{file.path.name}: its channel Z is not used; write depth: {{channel: Z}} to use it",) if unused else ()
