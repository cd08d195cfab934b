"""Clean pictures from spectral cubes."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

import numpy as np

from data_gen.sources.camera_view import check_illuminants, draw_name
from data_gen.sources.exposed_scene import check_exposure, expose_scene, renamed_key
from data_gen.sources.folder import FolderSource, check_extensions
from data_gen.sources.source import CleanImage
from simulator.errors import reading
from simulator.pipeline.input_files import sha256_of
from simulator.scene.spectral_cube import SpectralCubeScene
from simulator.sensor.camera.camera import Camera

KEY = "spectral_cubes"


@dataclass(frozen=True)
class SpectralCubes(FolderSource):
    """Spectral cubes, integrated over the camera's response.

    Reading is that of a shot's `scene.spectral_cube`, with the same checks.
    spectral_cubes: folder, with all folders in it.
    camera: whose colours the pictures get.
    wavelengths: file of wavelengths in nm, for cubes that do not name them.
    quantity: "reflectance" is lit by the drawn light; "radiance" is light already.
    illuminants: one is drawn for each reading; for radiance it only states the light that the white balance neutralises.
    exposed_percentile: percentile of the pixels' brightest channel that gets the signal `exposed_signal`.
    exposed_signal: 1 = saturation.
    extensions: of the files to take, in lower case.
    """

    key: ClassVar[str] = KEY
    spectral_cubes: Annotated[Path, "folder of spectral cubes"]
    camera: Camera
    wavelengths: Path | None = None
    quantity: Literal["radiance", "reflectance"] = "reflectance"
    illuminants: tuple[str, ...] = ("D65",)
    exposed_percentile: float = 99.0
    exposed_signal: float = 0.9
    extensions: tuple[str, ...] = (".exr", ".npy")

    def __post_init__(self) -> None:
        check_illuminants(self.illuminants, "illuminants")
        check_exposure(self.exposed_percentile, self.exposed_signal)
        check_extensions(self.extensions)

    def _listed(self) -> tuple[str, ...]:
        """Names without the file of wavelengths."""
        own = None if self.wavelengths is None else Path(self.wavelengths).resolve()
        return tuple(name for name in super()._listed() if (self.spectral_cubes / name).resolve() != own)

    def fingerprints(self) -> Iterator[str]:
        """Yield those of a folder, and the SHA-256 of the file of wavelengths. Raises PhotositeError when it is missing."""
        yield from super().fingerprints()
        if self.wavelengths is not None:
            with reading(self.wavelengths, "check the path", key="wavelengths"):
                digest = sha256_of(self.wavelengths)
            yield digest

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one cube; `rng` gives the light.

        Raises PhotositeError for what `SpectralCubeScene.load` refuses, and for a cube without light.
        """
        light, path = draw_name(self.illuminants, rng), self.spectral_cubes / name
        with renamed_key(KEY, "scene.spectral_cube"), renamed_key(f"wavelengths of {path}", "scene.wavelengths"):
            scene = SpectralCubeScene(
                spectral_cube=path,
                wavelengths=self.wavelengths,
                quantity=self.quantity,
                luminance_cd_m2=1.0 if self.quantity == "reflectance" else None,  # any: exposure follows from the percentile
                illuminant=light,
            ).load()
        return expose_scene(scene, self.camera, light, self.exposed_percentile, self.exposed_signal, path)
