"""Common to all scenes in RGB: reflectance spectra of colours, and the light and luminance that make them radiance."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal, Protocol

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, illuminant, luminance_cd_m2, reflectance_basis
from simulator.errors import PhotositeError, require
from simulator.scene.bands import mean_of_bands
from simulator.scene.compositing import composite_planes
from simulator.scene.pixel_file import first_fault
from simulator.scene.scene import Layer, Scene

LuminanceOf = Annotated[Literal["white", "mean"], "what has that luminance: RGB (1, 1, 1), or the picture's mean"]
Illuminant = Annotated[str, 'CIE name such as D65 or A, or "3200 K"']
Upsampling = Annotated[Literal["mallett2019"], "how RGB becomes a reflectance spectrum"]
Encoding = Annotated[Literal["auto", "linear", "srgb"], "auto: integer files are sRGB, float files linear"]
Negative = Annotated[Literal["error", "clip"], "what to do with negative radiance"]


def clip_negative(planes: np.ndarray, negative: Negative, key: str, path: Path) -> tuple[str, ...]:
    """Set negative values of planes (height, width, bands) to 0 in place, and return a note that counts them.

    Raises PhotositeError, which names `key` and `path`, unless `negative` is "clip".
    """
    if planes.min() >= 0:
        return ()
    fault = first_fault(planes < 0)
    if negative == "error":
        raise PhotositeError(
            f"negative radiance in {fault}, down to {planes.min():.3g}; "
            "light is never negative: export it again, or write negative: clip to set these to 0",
            key=key,
            value=path,
        )
    np.maximum(planes, np.float32(0), out=planes)
    return (f"{path.name}: negative radiance set to 0 in {fault}",)


class LitSource(Protocol):
    """Settings that all scenes in RGB have: their light and their field of view. Read only: the scenes are frozen."""

    @property
    def illuminant(self) -> str:
        """Name of the light source."""
        ...

    @property
    def upsampling(self) -> Upsampling:
        """How RGB becomes a reflectance spectrum."""
        ...

    @property
    def luminance_cd_m2(self) -> float:
        """Luminance of white, or of the mean [cd m^-2]."""
        ...

    @property
    def luminance_of(self) -> LuminanceOf:
        """Which of the two has that luminance."""
        ...

    @property
    def field_of_view_deg(self) -> float | None:
        """Full horizontal angle [deg]; None: the scene fills the sensor."""
        ...


def light_scene(source: LitSource, layers: Sequence[Layer], path: Path, notes: tuple[str, ...]) -> Scene:
    """Return the scene of layers, nearest first, whose planes are grey or RGB.

    L(lambda) = k * illuminant * (RGB . reflectance basis); k is such that white, or the mean of the composited picture, has
    the source's luminance. path: of the first picture, for the message when it is black.
    """
    first, *behind = layers
    spectra, relative, white = _spectra(source, tuple(layers), path)
    return Scene(
        planes=first.planes,
        spectra_w_m2_sr_nm=spectra,
        wavelengths_nm=WAVELENGTHS_NM,
        illuminant=relative,
        depth_m=first.depth_m,
        field_of_view_deg=source.field_of_view_deg,
        notes=notes,
        coverage=first.coverage,
        behind=tuple(behind),
        white=white,
    )


def _spectra(source: LitSource, layers: tuple[Layer, ...], path: Path) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the spectra of the planes, (bands, 81) [W m^-2 sr^-1 nm^-1], the illuminant's relative power, (81,), and k."""
    relative = illuminant(source.illuminant)
    basis = reflectance_basis(source.upsampling) if layers[0].planes.shape[2] == 3 else np.ones((1, relative.size))
    spectra, weights = relative * basis, np.ones(len(basis))
    if source.luminance_of == "mean":
        weights = mean_of_bands(composite_planes(layers)[0])
    own = float(weights @ luminance_cd_m2(spectra))
    rule = f"{path} is black, so it has no mean to scale; write luminance_of: white"
    require(own > 0, "scene.luminance_of", "mean", rule)
    return spectra * (source.luminance_cd_m2 / own), relative, source.luminance_cd_m2 / own
