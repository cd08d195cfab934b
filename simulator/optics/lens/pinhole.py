"""A small hole instead of a lens: no plane is in focus, and blur hardly depends on distance.

The image of a point is the geometric projection of the hole, d (1 + v / z) wide, convolved with diffraction at N = v / d.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.optics.lens.nd_filter import NeutralDensity, filter_transmittance
from simulator.optics.lens.perspective import AIRY_ZERO, GREEN_NM, Perspective
from simulator.optics.lens.relative_illumination import check_veiling_glare
from simulator.optics.pupil.pupil import Pupil
from simulator.units import Millimetres

# Hole diameter over sqrt(lambda v) that minimises the circle with half of a distant point's light: the Fresnel integral of a
# round hole, minimised in float64 (tests/optics/lens/test_lens_pinhole.py). Other criteria give other constants: 1.723 for the
# highest peak per light, 1.945 for the circle with 90 % of the light. The root-mean-square width is no criterion: its integral
# diverges, since the diffracted light of a hard edge falls off too slowly. Rayleigh (1891) advised 1.9.
SHARPEST = 1.4944
RAYLEIGH = 1.9


@dataclass(frozen=True)
class Pinhole(Perspective):
    """Round hole in a thin plate.

    diameter_mm: d of the hole [mm], > 0 and below its distance.
    distance_mm: v, hole to sensor along the axis [mm].
    cos4: whether irradiance falls with the fourth power of the cosine of the field angle.
    veiling_glare: share of the light that is scattered evenly over the sensor, 0 <= share < 1 (ISO 9358).
    model: name for the file's metadata.
    diffraction: whether the hole spreads light, by wave optics; true unless switched off, since a small hole spreads much.
    nd_filter: grey filter before the hole; left out: none.
    """

    pupil = Pupil()
    focus_distance_m = math.nan  # no distance is in focus
    distortion = None
    falloff = None
    forms_image = True
    has_plane_of_focus = False
    can_have_aberrations = False
    aberrations = None
    psf = None
    diameter_mm: Millimetres
    distance_mm: Millimetres
    cos4: bool = True
    model: str = "pinhole"
    veiling_glare: float = 0.0
    diffraction: bool = True
    nd_filter: NeutralDensity | None = None

    def __post_init__(self) -> None:
        distance_mm, diameter_mm, key = self.distance_mm, self.diameter_mm, "lens.pinhole"
        good = 0 < distance_mm < math.inf
        require(good, f"{key}.distance", f"{distance_mm:g} mm", "give hole to sensor, above 0 mm, such as 50 mm")
        rule = f"no small hole {distance_mm:g} mm before the sensor; the sharpest is {self.sharpest_diameter_mm():.2g} mm wide"
        require(0 < diameter_mm < distance_mm, f"{key}.diameter", f"{diameter_mm:g} mm", rule)
        check_veiling_glare(self.veiling_glare, f"{key}.veiling_glare")

    @property
    def image_distance_mm(self) -> float:
        """v, which sets the field of view and the scale of the image [mm]."""
        return self.distance_mm

    @property
    def focal_length_mm(self) -> float:
        """v: focal length of the lens that, focused at infinity, gives an image of the same scale [mm]."""
        return self.distance_mm

    @property
    def pupil_diameter_mm(self) -> float:
        """D [mm]."""
        return self.diameter_mm

    @property
    def f_number(self) -> float:
        """N = v / d."""
        return self.distance_mm / self.diameter_mm

    @property
    def has_diffraction(self) -> bool:
        """Whether the hole spreads light, by wave optics."""
        return self.diffraction

    @property
    def diffraction_f_number(self) -> float:
        """N = v / d, of the Airy disk that the image of a point approaches where sqrt(lambda v) is much larger than d."""
        return self.f_number

    def irradiance_per_radiance_sr(self) -> float:
        """E / L on the axis [sr]: pi sin^2 of the half angle of the hole = pi / (1 + 4 N^2).

        The integral of cos over the cone of a disk; radiance does not change along a ray, so no distance enters. Off the
        axis it falls with cos^4, exactly for a hole much smaller than its distance. Times what the filter lets pass.
        """
        return math.pi * filter_transmittance(self.nd_filter) / (1.0 + 4.0 * self.f_number**2)

    def blur_radius_um(self, depth_m: float | np.ndarray) -> np.float64 | np.ndarray:
        """Signed radius of the hole's geometric image of a point on the sensor [um]: -(d/2) (1 + v / z), similar triangles.

        Always negative, as of points nearer than the plane in focus: a hole is a lens focused beyond infinity, at -v.
        depth_m: float or array, > 0; inf is allowed.
        """
        return -500.0 * self.diameter_mm * (1.0 + 1e-3 * self.distance_mm / np.asarray(depth_m, dtype=np.float64))

    def smaller_aperture(self, blur_ratio: float) -> tuple[str, str, str]:
        """Key, value and replacement of the hole's diameter that make blur `blur_ratio` times smaller."""
        return "lens.pinhole.diameter", f"{self.diameter_mm:g} mm", f"{self.diameter_mm / blur_ratio:.3g} mm or less"

    def airy_diameter_um(self, wavelength_nm: float = GREEN_NM) -> float:
        """Diameter of the first dark ring of diffraction alone [um]: 2.44 lambda v / d."""
        return 2e-3 * AIRY_ZERO * wavelength_nm * self.diffraction_f_number

    def sharpest_diameter_mm(self, wavelength_nm: float = GREEN_NM, constant: float = SHARPEST) -> float:
        """Diameter of the hole that images distant points most sharply at this distance [mm]: constant * sqrt(lambda v)."""
        return constant * math.sqrt(1e-6 * wavelength_nm * self.distance_mm)
