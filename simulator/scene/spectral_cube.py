"""Scenes from spectral cubes: one plane per measured wavelength."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, check_illuminant, illuminant, luminance_cd_m2
from simulator.errors import PhotositeError, require
from simulator.scene.bands import mean_of_bands
from simulator.scene.checks import check_field_of_view, check_luminance
from simulator.scene.cube_file import files_beside_cube, read_cube
from simulator.scene.depth import Depth, check_depth, load_depth
from simulator.scene.occluded_background import Hidden
from simulator.scene.pixel_file import PixelFile, check_angle, check_finite, first_fault, memory_for
from simulator.scene.scene import Outside, Scene
from simulator.scene.wavelengths import common_grid, named_wavelengths, read_wavelengths, resample
from simulator.units import CandelasPerSquareMetre, Degrees


@dataclass(frozen=True)
class SpectralCubeScene:
    """A spectral cube.

    quantity: "radiance" is in W m^-2 sr^-1 nm^-1; with a luminance it is rescaled to that mean luminance, whatever
        its unit. "reflectance" is lit by the illuminant, and the luminance is that of the perfect white.
        Both are linear between the cube's wavelengths and dark outside them.
    luminance_cd_m2: of white (reflectance) or the mean (radiance); left out, radiance is absolute.
    illuminant: for radiance it only states the light that the camera's white balance neutralises.
    depth_m: one distance, {image: FILE, ...}, or {channel: Z, ...} of the cube's own EXR.
    field_of_view_deg: full horizontal angle of the cube; left out, it fills the sensor.
    outside: what a camera sees past its edge: an error (refuse), no light (black), the edge (extend), or it again (repeat).
    """

    spectral_cube: Annotated[
        Path, "EXR with channels named by wavelength, ENVI, .mat of ISETCam, or .npy (rows, columns, bands)"
    ]
    wavelengths: Annotated[Path | None, "wavelengths in nm, .npy, .txt or .csv; needed for cubes that name none"] = None
    quantity: Literal["radiance", "reflectance"] = "radiance"
    luminance_cd_m2: CandelasPerSquareMetre | None = None
    illuminant: Annotated[str, 'CIE name such as D65 or A, or "3200 K"'] = "D65"
    depth_m: Depth = math.inf
    field_of_view_deg: Degrees | None = None
    hidden: Hidden = "none"
    outside: Outside = "refuse"

    def __post_init__(self) -> None:
        if self.luminance_cd_m2 is not None:
            check_luminance(self.luminance_cd_m2)
        needed = self.quantity == "radiance" or self.luminance_cd_m2 is not None
        require(needed, "scene.luminance", "nothing", "a reflectance cube needs the luminance of white, such as 100 cd/m^2")
        check_illuminant(self.illuminant, "scene.illuminant")
        check_depth(self.depth_m, self.field_of_view_deg)
        check_field_of_view(self.field_of_view_deg)

    def companion_files(self) -> dict[str, tuple[Path, ...]]:
        """Return the other file of an ENVI cube, see `content_keys.companion_files`."""
        return {"spectral_cube": files_beside_cube(self.spectral_cube)}

    def load(self) -> Scene:
        """Read the cube.

        Raises PhotositeError for files that are missing, damaged or of the wrong size, for wavelengths that do not
        match or lie outside 380 to 780 nm, for reflectances in integers without a scale, for NaN, Inf and negative values,
        for a black cube with a luminance, and for a cube that does not fit into memory.
        """
        with memory_for(self.spectral_cube, "scene.spectral_cube"):
            return self._load()

    def _load(self) -> Scene:
        file = read_cube(self.spectral_cube, "scene.spectral_cube")
        check_angle(file, self.field_of_view_deg)
        scene = self.scene_of(file, self._bands(file))
        depth_m, depth_notes = load_depth(self.depth_m, file, self.field_of_view_deg)
        return replace(scene, depth_m=depth_m, notes=(*file.notes, *scene.notes, *depth_notes), window=file.window)

    def scene_of(self, file: PixelFile, bands: list[tuple[float, int]], key: str = "scene.spectral_cube") -> Scene:
        """Scene of a cube, without its depth; errors name `key`.

        bands: (wavelength [nm], channel) of each channel to use. Raises PhotositeError as `load` does.
        """
        if self.quantity == "reflectance" and (file.is_unscaled or file.pixels.dtype.kind in "ui"):
            rule = (
                "holds integers without a scale, of which nothing tells which is a reflectance of 1; give floats, or, in the "
                "header of an ENVI cube, reflectance scale factor"
            )
            raise PhotositeError(rule, key=key, value=self.spectral_cube)
        own_nm, channels = (np.array(column) for column in zip(*sorted(bands), strict=True))
        distinct = len(own_nm) > 1 and np.diff(own_nm).min() > 0
        require(distinct, "scene.wavelengths", f"{own_nm} nm", "give two or more wavelengths, each once")
        keep, grid_nm, basis, notes = common_grid(own_nm.astype(np.float64), self.spectral_cube.name)
        planes = np.ascontiguousarray(file.pixels[..., channels[keep]], dtype=np.float32)
        if file.no_data and (missing := np.isnan(planes)).any():
            rule = f"has no data ({file.no_data}) in {first_fault(missing)}; crop these pixels away or fill them"
            raise PhotositeError(rule, key=key, value=self.spectral_cube)
        check_finite(planes, key, self.spectral_cube)
        if planes.min() < 0:
            fault = first_fault(planes < 0)
            rule = f"negative in {fault}; light is never negative: clip it first"
            raise PhotositeError(rule, key=key, value=self.spectral_cube)
        if self.quantity == "reflectance":  # the light may vary between the cube's wavelengths
            between = WAVELENGTHS_NM[(WAVELENGTHS_NM > grid_nm[0]) & (WAVELENGTHS_NM < grid_nm[-1])]
            finer_nm = np.union1d(grid_nm, between)
            grid_nm, basis = finer_nm, resample(basis, grid_nm, finer_nm)
        light = illuminant(self.illuminant, grid_nm)
        return Scene(
            planes=planes,
            spectra_w_m2_sr_nm=self._spectra(planes, basis, light, grid_nm),
            wavelengths_nm=grid_nm,
            illuminant=light,
            field_of_view_deg=self.field_of_view_deg,
            notes=notes,
            hidden=self.hidden,
            outside=self.outside,
            white=self._white() if self.quantity == "reflectance" else None,
        )

    def _white(self) -> float:
        """Radiance of a perfectly white surface over the illuminant; of reflectances, which have a luminance."""
        assert self.luminance_cd_m2 is not None  # __post_init__
        return self.luminance_cd_m2 / float(luminance_cd_m2(illuminant(self.illuminant)))

    def _bands(self, file: PixelFile) -> list[tuple[float, int]]:
        """Wavelength [nm] and index of each channel that is not bad."""
        if self.wavelengths is None:
            return named_wavelengths(file, self.quantity)
        given = read_wavelengths(self.wavelengths)
        if len(given) != len(file.channels):
            raise PhotositeError(
                f"holds {len(given)} wavelengths, but {file.path} has "
                f"{len(file.channels)} channels; give one wavelength per channel",
                key="scene.wavelengths",
                value=self.wavelengths,
            )
        return [(float(nm), index) for index, nm in enumerate(given) if index not in file.bad]

    def _spectra(self, planes: np.ndarray, basis: np.ndarray, light: np.ndarray, grid_nm: np.ndarray) -> np.ndarray:
        if self.quantity == "reflectance":
            return basis * light * self._white()
        if self.luminance_cd_m2 is None:
            return basis
        mean = float(mean_of_bands(planes) @ luminance_cd_m2(basis, grid_nm))
        require(
            mean > 0,
            "scene.luminance",
            f"{self.luminance_cd_m2} cd/m^2",
            f"{self.spectral_cube} is black, so it cannot be scaled",
        )
        return basis * (self.luminance_cd_m2 / mean)
