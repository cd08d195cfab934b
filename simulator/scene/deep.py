"""Scenes from deep EXR files, whose pixels hold any number of samples at different depths."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import numpy as np

from simulator.color.spectra import check_illuminant
from simulator.errors import require
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.color_channels import to_linear
from simulator.scene.deep_file import DeepSamples, read_deep
from simulator.scene.deep_layers import deep_layers, deep_pixels
from simulator.scene.depth import Along, axis_per_ray, check_along, check_scale
from simulator.scene.length_units import METRES_PER_UNIT, LengthUnit
from simulator.scene.picture_light import Illuminant, LuminanceOf, Negative, Upsampling, clip_negative, light_scene
from simulator.scene.pixel_file import PixelFile, memory_for
from simulator.scene.scene import Scene
from simulator.units import CandelasPerSquareMetre, Degrees


@dataclass(frozen=True)
class DeepDepth:
    """What Z and ZBack of a deep file mean; depth = stored number * scale, in `unit`."""

    unit: LengthUnit = "m"
    scale: Annotated[float, "factor on the stored numbers"] = 1.0
    along: Along = "axis"

    def __post_init__(self) -> None:
        check_scale(self.scale)


@dataclass(frozen=True)
class DeepScene:
    """A deep EXR, lit as `ImageScene` is; its display window is the picture.

    luminance_cd_m2: of white, or the mean over what a pinhole sees, as luminance_of says.
    negative: renderers' filters leave small negative values; "clip" sets them to 0 and says how many.
    depth: unit of Z and ZBack, factor on them, and whether they go along the axis or the ray.
    most_layers: samples are put together into at most so many layers, 1 to 16.
    field_of_view_deg: full horizontal angle of the display window; left out, it fills the sensor.
    """

    deep: Annotated[Path, "deep EXR with R, G, B or Y, Z, and perhaps A and ZBack"]
    luminance_cd_m2: CandelasPerSquareMetre
    luminance_of: LuminanceOf = "white"
    illuminant: Illuminant = "D65"
    upsampling: Upsampling = "mallett2019"
    negative: Negative = "error"
    depth: DeepDepth = DeepDepth()
    most_layers: int = 4
    field_of_view_deg: Degrees | None = None

    def __post_init__(self) -> None:
        check_luminance(self.luminance_cd_m2)
        check_illuminant(self.illuminant, "scene.illuminant")
        check_field_of_view(self.field_of_view_deg)
        check_along(self.depth.along, self.field_of_view_deg)
        require(1 <= self.most_layers <= 16, "scene.most_layers", self.most_layers, "give 1 to 16")

    def load(self) -> Scene:
        """Read the file; three planes for RGB, one for Y.

        Raises PhotositeError as `read_deep` does, and for a file without samples or with negative radiance.
        """
        with memory_for(self.deep, "scene.deep"):
            samples, chromaticities, notes = read_deep(self.deep)
            require(len(samples.pixel) > 0, "scene.deep", self.deep, "holds no samples; render it again")
            samples, colour_notes = self._in_metres_and_light(samples, chromaticities)
            layers, joined = deep_layers(samples, self.most_layers)
            summary = f"{len(layers)} layers; in {100 * joined:.1f} % of its pixels one joins depths over 1 % apart"
            scene = light_scene(self, layers, self.deep, (*notes, *colour_notes, f"{self.deep.name}: {summary}"))
            return replace(scene, deep=deep_pixels(samples))

    def _in_metres_and_light(
        self, samples: DeepSamples, chromaticities: tuple[float, ...] | None
    ) -> tuple[DeepSamples, tuple[str, ...]]:
        """Convert samples to linear sRGB >= 0 and to depth in metres along the axis; and notes for the log."""
        colour = samples.colour[:, None, :]
        as_file = PixelFile(self.deep, colour, ("R", "G", "B")[: colour.shape[2]], chromaticities=chromaticities)
        planes, notes = to_linear(colour, "linear", as_file, "scene.deep")
        fault: np.ndarray = np.any(planes < 0, axis=(1, 2))
        if fault.any():
            pixels = np.where(samples.where(fault), planes.min(), np.float32(0))[..., None]
            notes += clip_negative(pixels, self.negative, "scene.deep", self.deep)
            np.maximum(planes, 0.0, out=planes)
        metres = self.depth.scale * METRES_PER_UNIT[self.depth.unit]
        if self.depth.along == "ray":
            assert self.field_of_view_deg is not None  # `check_along`
            metres = metres * axis_per_ray(samples.size, self.field_of_view_deg).ravel()[samples.pixel].astype(np.float64)
        near, far = samples.near * metres, samples.far * metres
        return replace(samples, colour=planes[:, 0].astype(np.float64), near=near, far=far), notes
