"""Clean pictures from scene-linear pictures: EXR, HDR, TIFF and NumPy arrays."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from data_gen.sources.camera_view import check_illuminants, draw_name
from data_gen.sources.exposed_scene import check_exposure, expose_scene, renamed_key
from data_gen.sources.folder import FolderSource, check_extensions
from data_gen.sources.source import CleanImage
from simulator.scene.image import ImageScene
from simulator.sensor.camera.camera import Camera

KEY = "linear_images"


@dataclass(frozen=True)
class LinearImages(FolderSource):
    """Linear pictures, RGB or grey, whose colours become reflectance spectra that a light falls on and the camera sees.

    Reading is that of a shot's `scene.image`: the same upsampling, the same checks.
    linear_images: folder, with all folders in it.
    camera: whose colours the pictures get.
    illuminants: lights on the scene, one drawn for each reading, all equally likely.
    exposed_percentile: percentile of the pixels' brightest channel that gets the signal `exposed_signal`.
    exposed_signal: 1 = saturation.
    encoding: "auto" takes files of integers as sRGB.
    negative: "clip" sets the small negative values of renderers to 0.
    layer: EXR layer that holds R, G, B.
    extensions: of the files to take, in lower case.
    """

    key: ClassVar[str] = KEY
    linear_images: Annotated[Path, "folder of linear pictures"]
    camera: Camera
    illuminants: tuple[str, ...] = ("D65",)
    exposed_percentile: float = 99.0
    exposed_signal: float = 0.9
    encoding: Annotated[Literal["linear", "srgb", "auto"], "of the stored numbers"] = "linear"
    negative: Literal["error", "clip"] = "error"
    layer: str | None = None
    extensions: tuple[str, ...] = (".exr", ".hdr", ".tif", ".tiff", ".npy")

    def __post_init__(self) -> None:
        check_illuminants(self.illuminants, "illuminants")
        check_exposure(self.exposed_percentile, self.exposed_signal)
        check_extensions(self.extensions)

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one picture; `rng` gives the light.

        Raises PhotositeError for what `ImageScene.load` refuses, and for a picture without light.
        """
        light, path = draw_name(self.illuminants, rng), self.linear_images / name
        with renamed_key(KEY, "scene.image"):
            scene = ImageScene(
                image=path,
                luminance_cd_m2=1.0,  # any: exposure follows from the percentile
                illuminant=light,
                encoding=self.encoding,
                layer=self.layer,
                negative=self.negative,
            ).load()
        return expose_scene(scene, self.camera, light, self.exposed_percentile, self.exposed_signal, path)
