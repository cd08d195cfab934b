"""Depth as renderers write it: which pass holds it, what it counts, and what stands for the background.

Blender's Cycles (kernel/camera/camera.h, kernel/film/data_passes.h) writes in its Depth pass the distance along the optical
axis, and 1e10 where no surface is; in its Mist pass ((distance along the ray - start) / depth), cut to 0 to 1, to the power of
the falloff. Mitsuba 3's `depth` (src/integrators/aov.cpp) is the length of the ray behind the near clip plane
(src/sensors/perspective.cpp), mean of the samples of a pixel, of which those that hit nothing count 0.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.scene.color_channels import color_alpha
from simulator.scene.length_units import METRES_PER_UNIT, LengthUnit
from simulator.scene.pixel_file import PixelFile
from simulator.units import Metres

BACKGROUND = 1e9  # Blender writes 1e10 where no surface is; a half float holds that as infinity
FALLOFF_POWERS = {"linear": 1.0, "quadratic": 2.0, "inverse_quadratic": 0.5}


@dataclass(frozen=True)
class Mist:
    """Settings of Blender's world, Mist Pass, with which its Mist pass tells distances.

    start_m: distance along the ray from which on there is mist [m].
    depth_m: from there to full mist [m]; what lies behind is taken as infinitely far.
    """

    start_m: Metres
    depth_m: Metres
    falloff: Annotated[
        Literal["quadratic", "linear", "inverse_quadratic"], "how the mist rises; Blender's own setting is quadratic"
    ] = "quadratic"

    def __post_init__(self) -> None:
        require(0 <= self.start_m < math.inf, "scene.depth.mist.start", f"{self.start_m:g} m", "give 0 m or more")
        require(0 < self.depth_m < math.inf, "scene.depth.mist.depth", f"{self.depth_m:g} m", "give a length above 0 m")


@dataclass(frozen=True)
class RendererDepth:
    """Depth in the scene's own EXR as a renderer wrote it: pass, background, axis or ray are known from its name.

    mist: of Blender: distances from the Mist pass, which is smoothed at edges, and not from the Depth pass.
    near_clip_m: of Mitsuba: its sensor's near_clip, from where it counts distances [m].
    """

    renderer: Annotated[Literal["blender", "mitsuba"], "what rendered the scene's EXR"]
    mist: Mist | None = None
    near_clip_m: Metres | None = None
    unit: LengthUnit = "m"

    def __post_init__(self) -> None:
        rule = "only Blender has a Mist pass; leave it out"
        require(self.mist is None or self.renderer == "blender", "scene.depth.mist", "given", rule)
        rule = "only Mitsuba counts from its near clip plane; leave it out"
        clip_m = self.near_clip_m
        require(clip_m is None or self.renderer == "mitsuba", "scene.depth.near_clip", f"{clip_m} m", rule)
        require(clip_m is None or 0 <= clip_m < math.inf, "scene.depth.near_clip", f"{clip_m} m", "give 0 m or more")

    @property
    def along(self) -> Literal["axis", "ray"]:
        """Whether the pass holds distances along the optical axis or along the ray."""
        return "ray" if self.renderer == "mitsuba" or self.mist is not None else "axis"

    @property
    def axis_offset_m(self) -> float:
        """What is to be added to the distance along the axis [m]: Mitsuba counts from its near clip plane, 0.01 by default."""
        if self.renderer != "mitsuba":
            return 0.0
        return 1e-2 * METRES_PER_UNIT[self.unit] if self.near_clip_m is None else self.near_clip_m

    def read(self, file: PixelFile, layer: str | None, key: str) -> np.ndarray:
        """Return distances (height, width) float32 [m] along `along`, without `axis_offset_m`; inf where no surface is.

        layer: EXR layer of the colours, which tells between several view layers, and alphas. Raises PhotositeError for a file
        without the pass, or with several.
        """
        if self.renderer == "mitsuba":
            return self._length_of_ray(file, layer, key)
        kind = "Depth" if self.mist is None else "Mist"
        stored = file.channel(_find_pass(file, kind, layer, key), key).astype(np.float32)
        if self.mist is None:
            metres = stored * np.float32(METRES_PER_UNIT[self.unit])
            return np.where(stored >= BACKGROUND, np.float32(np.inf), metres)
        share = np.power(np.clip(stored, 0.0, 1.0), 1.0 / FALLOFF_POWERS[self.mist.falloff])
        metres = self.mist.start_m + self.mist.depth_m * share
        return np.where(stored >= 1.0, np.float32(np.inf), metres).astype(np.float32)

    def _length_of_ray(self, file: PixelFile, layer: str | None, key: str) -> np.ndarray:
        names = [name for name in file.channels if name == "T" or name.endswith(".T")]
        rule = "has {} channels of depth ({}); render with an aov integrator whose aovs has one depth"
        if len(names) != 1:
            raise PhotositeError(rule.format(len(names), ", ".join(names) or "none ends with .T"), key=key, value=file.path)
        length = file.channel(names[0], key).astype(np.float32) * np.float32(METRES_PER_UNIT[self.unit])
        alpha = color_alpha(file, layer)
        hit = np.ones_like(length) if alpha is None else alpha.astype(np.float32)
        with np.errstate(divide="ignore", invalid="ignore"):  # samples that hit nothing count 0
            return np.where((length > 0) & (hit > 0), length / hit, np.float32(np.inf))


def _find_pass(file: PixelFile, kind: str, layer: str | None, key: str) -> str:
    """Return the channel of Blender's Depth or Mist pass: ViewLayer.Depth.Z, with .V since Blender 5, or Z beside R, G, B."""
    names = [name for name in file.channels if name.split(".")[-2:] in ([kind, "Z"], [kind, "V"])]
    if layer is not None:
        view = layer.removesuffix(".Combined")
        names = [name for name in names if name.rpartition(".")[0] == f"{view}.{kind}"]
    if not names and kind == "Depth" and "Z" in file.channels:
        names = ["Z"]
    if len(names) == 1:
        return names[0]
    switch = "Passes, Data, Z" if kind == "Depth" else "Passes, Data, Mist"
    problem = f"has no {kind} pass; switch it on in Blender (View Layer, {switch}) and render again as OpenEXR MultiLayer"
    if names:
        problem = f"has {len(names)} {kind} passes ({', '.join(names)}); name the view layer of the colours as scene.layer"
    raise PhotositeError(problem, key=key, value=file.path)
