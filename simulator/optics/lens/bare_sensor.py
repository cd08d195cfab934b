"""No lens: every photosite looks at the whole scene at once.

E = integral of L cos(theta) dOmega over the hemisphere. A place of the scene at tangents (x, y) of its grid's pinhole
projection takes up dOmega cos(theta) = dx dy / (1 + x^2 + y^2)^2. Beyond the scene's edges it is dark.
"""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Scene


@dataclass(frozen=True)
class BareSensor:
    """Sensor without a lens. Valid for a scene whose distance is large beside the sensor: then the frame is uniform.

    model: name for the file's metadata.
    """

    pupil: ClassVar[Pupil] = Pupil()
    cos4: ClassVar[bool] = False
    distortion: ClassVar[None] = None
    veiling_glare: ClassVar[float] = 0.0
    f_number: ClassVar[float] = math.nan
    focal_length_mm: ClassVar[float] = math.nan
    focus_distance_m: ClassVar[float] = math.nan
    image_distance_mm: ClassVar[float] = math.inf
    model: str = "no lens"

    def irradiance_per_radiance_sr(self) -> float:
        """E / L under a hemisphere of one radiance [sr]: pi."""
        return math.pi

    def focal_length_35mm_mm(self, diagonal_mm: float) -> float:
        """None: not a number."""
        return math.nan

    def blur_radius_um(self, depth_m):
        """A point lights all of the sensor: infinite [um]."""
        return np.full(np.shape(depth_m), np.inf)


def hemisphere_shares(height: int, width: int, field_of_view_deg: float | None) -> np.ndarray:
    """Share of a hemisphere's irradiance that each pixel of a scene takes up if all are equally bright: (height, width).

    A grid with a field of view is a pinhole projection, row 0 on top; the integral over each pixel is in closed form, the
    configuration factor of a small surface and a rectangle parallel to it (Siegel and Howell, Thermal Radiation Heat
    Transfer, 1972). Without one the scene fills the hemisphere, every pixel with the same share.
    """
    if field_of_view_deg is None:
        return np.full((height, width), 1.0 / (height * width))
    step = 2.0 * math.tan(math.radians(0.5 * field_of_view_deg)) / width
    x, y = step * (np.arange(width + 1) - 0.5 * width), step * (np.arange(height + 1)[:, np.newaxis] - 0.5 * height)
    across, down = x / np.sqrt(1.0 + x**2), y / np.sqrt(1.0 + y**2)
    corner = across * np.arctan(y / np.sqrt(1.0 + x**2)) + down * np.arctan(x / np.sqrt(1.0 + y**2))
    return np.diff(np.diff(corner, axis=0), axis=1) / (2.0 * math.pi)


def gathered(scene: Scene) -> Scene:
    """Return the hemisphere of one radiance that lights a bare sensor as this scene does: one pixel, infinitely far."""
    shares = hemisphere_shares(*scene.planes.shape[:2], scene.field_of_view_deg)
    light, passed = np.zeros(scene.planes.shape[2]), np.ones_like(shares)
    for layer in scene.layers:
        light += np.tensordot(shares * passed, layer.planes.astype(np.float64), axes=2)
        passed = passed * (0.0 if layer.coverage is None else 1.0 - layer.coverage.astype(np.float64))
    note = f"without a lens every photosite gathers the whole scene, {100 * shares.sum():.3g} % of a hemisphere's irradiance"
    return replace(
        scene,
        planes=light.astype(np.float32)[np.newaxis, np.newaxis],
        depth_m=math.inf,
        coverage=None,
        behind=(),
        field_of_view_deg=None,
        interpolation="nearest",
        notes=(*scene.notes, note),
    )
