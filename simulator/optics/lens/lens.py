"""What the simulator asks of every kind of lens: focus, field of view, blur, pupil, irradiance and wavefront."""

from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.falloff import Falloff
from simulator.optics.lens.nd_filter import NeutralDensity
from simulator.optics.lens.perspective import GREEN_NM
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.pupil.pupil import Pupil


@runtime_checkable
class Lens(Protocol):
    """What stands in front of the sensor: ThinLens, Pinhole or BareSensor.

    A quantity that a kind of lens does not have is NaN, None or False.
    """

    @property
    def model(self) -> str:
        """Name for the file's metadata."""
        ...

    @property
    def pupil(self) -> Pupil:
        """Shape of the pupil, by field."""
        ...

    @property
    def f_number(self) -> float:
        """N."""
        ...

    @property
    def diffraction_f_number(self) -> float:
        """f-number of the cone of light that reaches the sensor, which sets the size of the Airy disk."""
        ...

    @property
    def focal_length_mm(self) -> float:
        """Focal length f [mm]."""
        ...

    @property
    def focus_distance_m(self) -> float:
        """Lens to the plane in focus, along the axis [m]."""
        ...

    @property
    def image_distance_mm(self) -> float:
        """Lens to sensor z_i [mm]."""
        ...

    @property
    def cos4(self) -> bool:
        """Whether irradiance falls with the fourth power of the cosine of the field angle."""
        ...

    @property
    def distortion(self) -> Distortion | None:
        """Geometric distortion and lateral colour; None: none."""
        ...

    @property
    def falloff(self) -> Falloff | None:
        """Measured fall-off over the field; None: none."""
        ...

    @property
    def veiling_glare(self) -> float:
        """Fraction of the light that is scattered evenly over the sensor (ISO 9358)."""
        ...

    @property
    def forms_image(self) -> bool:
        """Whether a point of the scene lights one place of the sensor rather than all of it."""
        ...

    @property
    def has_plane_of_focus(self) -> bool:
        """Whether points at some distance are imaged sharply by geometrical optics."""
        ...

    @property
    def can_have_aberrations(self) -> bool:
        """Whether light is refracted, so that the wavefront may have an error."""
        ...

    @property
    def aberrations(self) -> Aberrations | None:
        """Wavefront error; None: none is stated."""
        ...

    @property
    def has_diffraction(self) -> bool:
        """Whether the aperture spreads light, by wave optics; a stated wavefront error implies it."""
        ...

    @property
    def psf(self) -> Path | None:
        """File of point spread functions that replaces diffraction and aberrations; None: none."""
        ...

    @property
    def nd_filter(self) -> NeutralDensity | None:
        """Grey filter; None: none."""
        ...

    def irradiance_per_radiance_sr(self) -> float:
        """E / L on the axis [sr], behind the filter."""
        ...

    def field_of_view_deg(self, extent_mm: float) -> float:
        """Full angle that a sensor of this width, height or diagonal sees [deg]."""
        ...

    def focal_length_35mm_mm(self, diagonal_mm: float) -> float:
        """Focal length with the same diagonal field of view on 36 mm x 24 mm [mm]."""
        ...

    def blur_radius_um(self, depth_m: float | np.ndarray) -> np.float64 | np.ndarray:
        """Signed radius of the circle of confusion on the sensor [um]; positive behind the plane in focus."""
        ...

    def airy_diameter_um(self, wavelength_nm: float = GREEN_NM) -> float:
        """Diameter of the first dark ring of diffraction alone [um]."""
        ...

    def smaller_aperture(self, blur_ratio: float) -> tuple[str, str, str]:
        """YAML key of the aperture, its value, and what to give instead to make blur `blur_ratio` times smaller."""
        ...
