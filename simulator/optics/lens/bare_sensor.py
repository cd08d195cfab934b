"""No lens: every photosite receives light from the whole scene.

E = integral of L cos(theta) dOmega over the hemisphere. An element dx dy of the scene at tangents (x, y) of its grid's pinhole
projection has dOmega cos(theta) = dx dy / (1 + x^2 + y^2)^2. Beyond the scene's edges the radiance is 0.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from simulator.optics.lens.nd_filter import NeutralDensity, filter_transmittance
from simulator.optics.lens.perspective import GREEN_NM
from simulator.optics.pupil.pupil import Pupil
from simulator.scene.scene import Scene


@dataclass(frozen=True)
class BareSensor:
    """Sensor without a lens. Valid for a scene whose distance is large beside the sensor: then the frame is uniform.

    model: name for the file's metadata.
    nd_filter: grey filter before the sensor; left out: none.
    """

    pupil = Pupil()
    cos4 = False
    distortion = None
    falloff = None
    veiling_glare = 0.0
    forms_image = False
    has_plane_of_focus = False
    can_have_aberrations = False
    aberrations = None
    has_diffraction = False
    psf = None
    f_number = math.nan
    diffraction_f_number = math.nan
    focal_length_mm = math.nan
    focus_distance_m = math.nan
    image_distance_mm = math.inf
    model: str = "no lens"
    nd_filter: NeutralDensity | None = None

    def irradiance_per_radiance_sr(self) -> float:
        """E / L under a hemisphere of one radiance [sr]: pi, times what the filter lets pass."""
        return math.pi * filter_transmittance(self.nd_filter)

    def field_of_view_deg(self, extent_mm: float) -> float:
        """NaN: no image, so no field of view."""
        return math.nan

    def focal_length_35mm_mm(self, diagonal_mm: float) -> float:
        """NaN: no focal length."""
        return math.nan

    def airy_diameter_um(self, wavelength_nm: float = GREEN_NM) -> float:
        """NaN: no aperture that diffracts."""
        return math.nan

    def blur_radius_um(self, depth_m: float | np.ndarray) -> np.float64 | np.ndarray:
        """A point lights all of the sensor: infinite [um]."""
        return np.full(np.shape(depth_m), np.inf)[()]

    def smaller_aperture(self, blur_ratio: float) -> tuple[str, str, str]:
        """No aperture lessens an infinite blur; only a lens does."""
        return "lens.bare_sensor", "no lens", "a lens"


def hemisphere_fractions(height: int, width: int, field_of_view_deg: float | None) -> np.ndarray:
    """Fraction of the irradiance under a uniform hemisphere that comes through each pixel of a scene: (height, width) float64.

    A grid with a field of view is a pinhole projection, row 0 on top; the integral over each pixel has a closed form, the
    configuration factor from a surface element to a rectangle parallel to it (Siegel and Howell, Thermal Radiation Heat
    Transfer, 1972). Without a field of view the scene fills the hemisphere, every pixel with the same fraction.
    """
    if field_of_view_deg is None:
        return np.full((height, width), 1.0 / (height * width))
    step = 2.0 * math.tan(math.radians(0.5 * field_of_view_deg)) / width
    x, y = step * (np.arange(width + 1) - 0.5 * width), step * (np.arange(height + 1)[:, np.newaxis] - 0.5 * height)
    across, down = x / np.sqrt(1.0 + x**2), y / np.sqrt(1.0 + y**2)
    corner = across * np.arctan(y / np.sqrt(1.0 + x**2)) + down * np.arctan(x / np.sqrt(1.0 + y**2))
    return np.diff(np.diff(corner, axis=0), axis=1) / (2.0 * math.pi)


def integrate_hemisphere(scene: Scene) -> Scene:
    """Return a scene of one infinitely distant pixel that gives a bare sensor the irradiance of this scene."""
    height, width, bands = scene.planes.shape
    fractions = hemisphere_fractions(height, width, scene.field_of_view_deg)
    radiance, transmitted = np.zeros(bands), np.ones_like(fractions)
    for layer in scene.layers:
        radiance += np.tensordot(fractions * transmitted, layer.planes.astype(np.float64), axes=2)
        transmitted = transmitted * (0.0 if layer.coverage is None else 1.0 - layer.coverage.astype(np.float64))
    note = f"without a lens every photosite gathers the whole scene, {100 * fractions.sum():.3g} % of a hemisphere's irradiance"
    return replace(
        scene,
        planes=radiance.astype(np.float32)[np.newaxis, np.newaxis],
        depth_m=math.inf,
        coverage=None,
        behind=(),
        field_of_view_deg=None,
        interpolation="nearest",
        notes=(*scene.notes, note),
    )
