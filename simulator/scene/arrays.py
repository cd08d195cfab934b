"""Scenes from arrays in memory, by the same steps as scenes from files."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from simulator.errors import require
from simulator.scene.depth import unit_notes
from simulator.scene.depth_holes import fill_holes
from simulator.scene.image import ImageScene
from simulator.scene.occluded_background import Hidden
from simulator.scene.picture_light import Encoding, LuminanceOf, Negative
from simulator.scene.pixel_file import PixelFile, memory_for
from simulator.scene.scene import Scene
from simulator.scene.spectral_cube import SpectralCubeScene

ARRAY = Path("array")  # in messages and notes, in place of a file's name


def scene_from_rgb(
    rgb: npt.ArrayLike,
    *,
    luminance_cd_m2: float,
    luminance_of: LuminanceOf = "white",
    illuminant: str = "D65",
    encoding: Encoding = "auto",
    negative: Negative = "error",
    depth_m: npt.ArrayLike = math.inf,
    field_of_view_deg: float | None = None,
    hidden: Hidden = "none",
) -> Scene:
    """Scene of a picture: L(lambda) = k * illuminant * (RGB . reflectance basis), as `ImageScene` has it.

    rgb: (height, width, 3), or (height, width) for grey. Floats are linear, (1, 1, 1) is the perfect white in that light and
        values above 1 are highlights; uint8 and uint16 are sRGB codes. `encoding` says otherwise. The array is copied.
    luminance_cd_m2: of white, or the mean over the picture, as luminance_of says [cd m^-2].
    depth_m: along the optical axis [m], one number or (height, width); inf is allowed.
    field_of_view_deg: full horizontal angle of the picture [deg]; left out, it fills the sensor.
    The other arguments are those of `ImageScene`. Raises PhotositeError for an array of another shape or of other integers,
    for NaN, Inf and negative values, depth of another size, NaN, 0 or less, and for a light that is not known.
    """
    file, distance = _pixels(rgb, "rgb"), _distance(depth_m)
    colors = file.pixels.shape[2]
    require(colors in (1, 3), "rgb", f"array of shape {np.shape(rgb)}", "give (height, width, 3), or (height, width) for grey")
    source = ImageScene(
        ARRAY,
        luminance_cd_m2,
        luminance_of,
        illuminant,
        encoding=encoding,
        negative=negative,
        field_of_view_deg=field_of_view_deg,
        hidden=hidden,
        depth_m=distance if isinstance(distance, float) else math.inf,
    )
    with memory_for(ARRAY, "rgb"):
        return _with_depth(source.scene_of(file.pixels, file, "rgb"), distance)


def scene_from_spectra(
    cube: npt.ArrayLike,
    wavelengths_nm: npt.ArrayLike,
    *,
    quantity: Literal["radiance", "reflectance"] = "radiance",
    luminance_cd_m2: float | None = None,
    illuminant: str = "D65",
    depth_m: npt.ArrayLike = math.inf,
    field_of_view_deg: float | None = None,
    hidden: Hidden = "none",
) -> Scene:
    """Scene of a spectral cube, as `SpectralCubeScene` has it.

    cube: (height, width, wavelengths), radiance [W m^-2 sr^-1 nm^-1] or reflectance, as quantity says. The array is copied.
    wavelengths_nm: (wavelengths,), in any order [nm].
    luminance_cd_m2: of white (reflectance) or the mean (radiance) [cd m^-2]; left out, radiance is absolute.
    depth_m, field_of_view_deg: as `scene_from_rgb` takes them. The other arguments are those of `SpectralCubeScene`.
    Raises PhotositeError as `scene_from_rgb` does, for wavelengths that do not match or lie outside 380 to 780 nm, and for
    reflectances in integers.
    """
    file, distance = _pixels(cube, "cube"), _distance(depth_m)
    own_nm = np.asarray(wavelengths_nm, np.float64)
    count = file.pixels.shape[2]
    rule = f"the cube has {count} wavelengths; give one number in nm for each"
    require(own_nm.shape == (count,), "wavelengths_nm", f"array of shape {own_nm.shape}", rule)
    source = SpectralCubeScene(
        ARRAY,
        None,
        quantity,
        luminance_cd_m2,
        illuminant,
        field_of_view_deg=field_of_view_deg,
        hidden=hidden,
        depth_m=distance if isinstance(distance, float) else math.inf,
    )
    with memory_for(ARRAY, "cube"):
        return _with_depth(source.scene_of(file, list(zip(own_nm.tolist(), range(count), strict=True)), "cube"), distance)


def _pixels(array: npt.ArrayLike, key: str) -> PixelFile:
    """Return the array as a picture file that has been read."""
    pixels = np.asarray(array)
    good = pixels.ndim in (2, 3) and pixels.dtype.kind in "fui" and pixels.size > 0
    rule = "give numbers, (height, width) or (height, width, channels)"
    require(good, key, f"array of {pixels.dtype} of shape {pixels.shape}", rule)
    return PixelFile(ARRAY, pixels.reshape(*pixels.shape[:2], -1), ())


def _distance(depth_m: npt.ArrayLike) -> float | np.ndarray:
    """Return one distance, or a copy of the map, (height, width) float32 [m]."""
    depth = np.array(depth_m, np.float64)
    return float(depth) if depth.ndim == 0 else depth.astype(np.float32)


def _with_depth(scene: Scene, distance: float | np.ndarray) -> Scene:
    height, width, bands = scene.planes.shape
    notes: tuple[str, ...] = (f"the scene was an array of {height} x {width} pixels with {bands} bands, which no file holds",)
    if not isinstance(distance, np.ndarray):
        return replace(scene, depth_m=distance, notes=(*notes, *scene.notes))
    rule = f"the picture is {height} x {width}; give one distance, or one for each pixel"
    require(distance.shape == (height, width), "depth_m", f"array of shape {distance.shape}", rule)
    depth_m, hole_notes = fill_holes(distance, "error", "depth_m", ARRAY)
    return replace(scene, depth_m=depth_m, notes=(*notes, *scene.notes, *hole_notes, *unit_notes(depth_m, "m", ARRAY)))
