"""The scene before the lens: radiance as planes times spectra, with depth.

A scene is kept factored: L(y, x, wavelength) = sum over b of planes[y, x, b] * spectra[b, wavelength].
A spectral cube has one plane per wavelength, an RGB picture three, a grey one, a chart of n patches n.
No pixel is expanded to a full spectrum: the camera's response is applied to `spectra` once. All layers share the spectra.
"""

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, field, replace
from typing import Literal, Self, TypeGuard, TypeVar

import numpy as np

from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.memo import Memo
from simulator.scene.pixel_file import DataWindow

T = TypeVar("T")
Outside = Literal["refuse", "black", "extend", "repeat"]


def is_depth_map(depth_m: float | np.ndarray) -> TypeGuard[np.ndarray]:
    """Whether depth is given for each pixel, not one distance for all."""
    return np.ndim(depth_m) > 0


@dataclass(frozen=True)
class Layer:
    """One surface of a scene, on the scene's grid; it continues behind nearer layers.

    planes: (height, width, bands) float32, >= 0, finite: weights of the spectra, multiplied by coverage (as EXR stores colours
        with alpha), so that layers are composited as planes + (1 - coverage) * planes of the next.
    depth_m: distance along the optical axis [m], a float or (height, width) float32; inf is allowed. Where coverage is 0 it
        has no meaning and should continue that of the pixels beside.
    coverage: (height, width) float32, share of each pixel that the layer covers, 0 to 1; None: 1 everywhere. A shot takes
        1e-6 where it is less and the planes have light.
    """

    planes: np.ndarray
    depth_m: float | np.ndarray = float("inf")
    coverage: np.ndarray | None = None


@dataclass(frozen=True)
class Scene:
    """Scene radiance on the scene's own pixel grid (a pinhole projection, row 0 on top).

    planes, depth_m, coverage: of the nearest layer, see `Layer`.
    behind: layers behind it, nearest first; where no layer covers there is no light.
    spectra_w_m2_sr_nm: (bands, wavelengths) float64 radiance of weight 1 [W m^-2 sr^-1 nm^-1], linear between its samples and
        zero outside them.
    wavelengths_nm: (wavelengths,) float64, ascending [nm].
    illuminant: (wavelengths,) float64, relative power of the light that falls on the scene;
        its colour is what the camera's white balance neutralises.
    field_of_view_deg: full horizontal angle of the grid [deg]; None: the grid fills the sensor.
    interpolation: how the grid is sampled.
    notes: what was assumed while reading, for the log.
    deep: samples of a deep picture as they are, of which the layers are composites; None: the layers are the scene.
    white: radiance of a perfectly white surface in the light of the scene is `white` times `illuminant`; None: not known, as of
        radiance that was measured.
    hidden: whether the background is continued behind the edges of near objects, see `extend_background`.
    outside: what the camera sees past the edge of the grid: an error (refuse), no light (black), the edge (extend), or the grid
        again (repeat).
    window: where the grid lies in the display window of the EXR that it was read from; None: not known.
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
    deep: DeepPixels | None = None
    white: float | None = None
    outside: Outside = "refuse"
    window: DataWindow | None = None
    _memo: Memo = field(default_factory=Memo, init=False, repr=False, compare=False)

    def load(self) -> "Scene":
        """Return the scene itself, so that a `Scene` can be given as `Shot.scene`."""
        return self

    @property
    def layers(self) -> tuple[Layer, ...]:
        """All layers, nearest first."""
        return (Layer(self.planes, self.depth_m, self.coverage), *self.behind)

    def with_layers(self, layers: Iterable[Layer]) -> Self:
        """Return the scene with other layers, nearest first, of any size."""
        first, *behind = layers
        return replace(self, planes=first.planes, depth_m=first.depth_m, coverage=first.coverage, behind=tuple(behind))

    def arrays(self) -> list[np.ndarray]:
        """Arrays of all layers, planes, depths and coverages, and those of a deep picture's samples."""
        held = [value for layer in self.layers for value in (layer.planes, layer.depth_m, layer.coverage)]
        held += [] if self.deep is None else vars(self.deep).values()
        return [value for value in held if isinstance(value, np.ndarray)]

    def remember(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return `make()`, a number or plan that depends on the scene and the key alone, and keep it with the scene.

        It is made anew each time where an array of the scene can be written to, since nothing tells then that none changed.
        """
        if any(array.flags.writeable for array in self.arrays()):
            return make()
        return self._memo.get(key, make)
