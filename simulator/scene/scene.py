"""What stands before the lens: radiance as planes times spectra, with depth.

A scene is kept factored: L(y, x, wavelength) = sum over b of planes[y, x, b] * spectra[b, wavelength].
A spectral cube has one plane per wavelength, an RGB picture three, a grey one, a chart of n patches n.
Nothing is expanded to full spectra per pixel: the camera's response multiplies `spectra` once. All layers share the spectra.
"""

from dataclasses import dataclass
from typing import Literal, TypeGuard

import numpy as np


def is_depth_map(depth_m: float | np.ndarray) -> TypeGuard[np.ndarray]:
    """Whether depth is given for each pixel, not one distance for all."""
    return np.ndim(depth_m) > 0


@dataclass(frozen=True)
class Layer:
    """One surface of a scene, on the scene's grid; it goes on behind what stands before it.

    planes: (height, width, bands) float32, >= 0, finite: weights of the light it sends out, times coverage (as EXR stores
        colours with alpha), so that layers lie over one another as planes + (1 - coverage) * planes of the next.
    depth_m: distance along the optical axis [m], a float or (height, width) float32; inf is allowed. Where coverage is 0 it
        means nothing and should go on as beside.
    coverage: (height, width) float32, share of each pixel that it covers, 0 to 1; None: all of it.
    """

    planes: np.ndarray
    depth_m: float | np.ndarray = float("inf")
    coverage: np.ndarray | None = None


@dataclass(frozen=True)
class Scene:
    """Scene radiance on the scene's own pixel grid (a pinhole projection, row 0 on top).

    planes, depth_m, coverage: of the nearest surface, see `Layer`.
    behind: surfaces behind it, nearest first; where none covers there is no light.
    spectra_w_m2_sr_nm: (bands, wavelengths) float64 radiance of weight 1 [W m^-2 sr^-1 nm^-1].
    wavelengths_nm: (wavelengths,) float64, ascending, evenly spaced [nm].
    illuminant: (wavelengths,) float64, relative power of the light that falls on the scene;
        its colour is what the camera's white balance neutralises.
    field_of_view_deg: full horizontal angle of the grid [deg]; None: the grid fills the sensor.
    interpolation: how the sensor's pixels read the grid.
    notes: what was assumed while reading, for the log.
    hidden: whether the background is continued behind the edges of what stands before it, see `occluded_background`.
    """

    planes: np.ndarray
    spectra_w_m2_sr_nm: np.ndarray
    wavelengths_nm: np.ndarray
    illuminant: np.ndarray
    depth_m: float | np.ndarray = float("inf")
    field_of_view_deg: float | None = None
    interpolation: Literal["bilinear", "nearest"] = "bilinear"
    notes: tuple[str, ...] = ()
    coverage: np.ndarray | None = None
    behind: tuple[Layer, ...] = ()
    hidden: Literal["none", "extend"] = "none"

    def load(self) -> "Scene":
        """Return the scene itself: it can stand where something that loads one does, as in `Shot.scene`."""
        return self

    @property
    def layers(self) -> tuple[Layer, ...]:
        """All surfaces, nearest first."""
        return (Layer(self.planes, self.depth_m, self.coverage), *self.behind)
