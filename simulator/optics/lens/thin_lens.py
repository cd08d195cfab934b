"""The ideal thin lens: one object for focus, field of view, depth of field, blur circle and irradiance.

Distances are along the optical axis. Sources: 1/f = 1/z_i + 1/z_o (Gauss); irradiance by ISETCam's
form E = pi L tau / (1 + 4 N^2 (1 + |m|)^2), exact on the axis of a uniform disk pupil, or the aplanatic
form E = pi L tau / (4 N^2 (1 + |m|)^2), exact when the sine condition holds.
"""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.falloff import Falloff
from simulator.optics.lens.nd_filter import NeutralDensity, filter_transmittance
from simulator.optics.lens.perspective import AIRY_ZERO, GREEN_NM, Perspective
from simulator.optics.lens.psf_list import listed_files
from simulator.optics.lens.relative_illumination import check_veiling_glare
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.pupil.pupil import Aperture, Pupil
from simulator.optics.pupil.vignetting import Vignetting
from simulator.units import FNumber, Metres, Micrometres, Millimetres, TStop

CIRCLES_PER_DIAGONAL = 1500.0  # Lyon, "Depth of Field Outside the Box" (2006); 0.029 mm on 36 mm x 24 mm


@dataclass(frozen=True)
class ThinLens(Perspective):
    """Thin lens focused by moving the sensor.

    focal_length_mm: f [mm], > 0.
    f_number: N = f / pupil diameter, >= 0.5 (a lens in air cannot be faster).
    focus_distance_m: lens to the plane in focus, along the axis [m], > f; inf is allowed.
    transmittance: tau, share of light the glass lets through, 0 < tau <= 1.
    t_stop: T = N / sqrt(tau) as marked on cine lenses, T >= N; replaces the transmittance.
    irradiance: which of the two formulas above.
    cos4: whether irradiance falls with the fourth power of the cosine of the field angle.
    aperture: blades of the diaphragm; left out: round.
    circle_of_confusion_um: largest blur circle that counts as sharp in depth of field [um]; left out: diagonal / 1500.
    vignetting: stops that clip off-axis cones of light; left out: none.
    distortion: geometric distortion and lateral colour; left out: none.
    falloff: measured fall-off over the field; left out: none.
    veiling_glare: share of the light that is scattered evenly over the sensor, 0 <= share < 1 (ISO 9358).
    diffraction: whether the aperture spreads light, by wave optics.
    aberrations: wavefront error; implies diffraction.
    psf: file of point spread functions (.npz, .npy, .txt, .csv) instead of both; a text is kept as a path.
    nd_filter: grey filter before the lens, in addition to transmittance or T-stop; left out: none.
    model: name for the file's metadata.
    """

    forms_image = True
    has_plane_of_focus = True
    can_have_aberrations = True
    focal_length_mm: Millimetres
    f_number: FNumber
    focus_distance_m: Metres = math.inf
    transmittance: float = 1.0
    irradiance: Literal["thin_lens", "aplanatic"] = "thin_lens"
    cos4: bool = True
    model: str = "thin lens"
    t_stop: TStop | None = None
    aperture: Aperture | None = None
    circle_of_confusion_um: Micrometres | None = None
    vignetting: Vignetting | None = None
    distortion: Distortion | None = None
    veiling_glare: float = 0.0
    diffraction: bool = False
    aberrations: Aberrations | None = None
    psf: Path | None = None
    nd_filter: NeutralDensity | None = None
    falloff: Falloff | None = None

    def __post_init__(self) -> None:
        if isinstance(self.psf, str):  # a text is no file by whose change plans are told apart
            object.__setattr__(self, "psf", Path(self.psf))
        good = 0 < self.focal_length_mm < math.inf
        require(good, "lens.focal_length", f"{self.focal_length_mm} mm", "give a length above 0 mm, such as 50 mm")
        require(
            0.5 <= self.f_number < math.inf,
            "lens.f_number",
            f"f/{self.f_number:g}",
            "no lens in air is faster than f/0.5; give f/0.5 or more",
        )
        require(0 < self.transmittance <= 1, "lens.transmittance", self.transmittance, "give a share above 0 and up to 1")
        if not self.focus_distance_m * 1e3 > self.focal_length_mm:
            raise PhotositeError(
                "nothing nearer than the focal length "
                f"({self.focal_length_mm:g} mm) can be brought into focus; give more than {self.focal_length_mm / 1e3:g} m",
                key="lens.focus_distance",
                value=f"{self.focus_distance_m:g} m",
            )
        circle_um = self.circle_of_confusion_um
        good = circle_um is None or 0 < circle_um < math.inf
        require(good, "lens.circle_of_confusion", f"{circle_um} um", "give a diameter above 0, such as 29 um")
        check_veiling_glare(self.veiling_glare, "lens.veiling_glare")
        self._check_t_stop()
        self._check_psf()
        _ = self.pupil  # raises for stops that do not fit

    def companion_files(self) -> dict[str, tuple[Path, ...]]:
        """Return the files that a list of PSF files names, see `content_keys.companion_files`."""
        return {} if self.psf is None else {"psf": listed_files(self.psf)}

    def _check_psf(self) -> None:
        rule = "a PSF holds the diffraction and the aberrations of its lens; leave lens.{} out"
        require(self.psf is None or self.aberrations is None, "lens.psf", self.psf, rule.format("aberrations"))
        require(self.psf is None or not self.diffraction, "lens.psf", self.psf, rule.format("diffraction"))

    def _check_t_stop(self) -> None:
        if self.t_stop is None:
            return
        stated = f"T/{self.t_stop:g}"
        require(self.transmittance == 1.0, "lens.t_stop", stated, "states the transmittance; leave lens.transmittance out")
        limit = f"glass passes no more than all of the light of f/{self.f_number:g}; give {self.f_number:g} or more"
        require(self.f_number <= self.t_stop < math.inf, "lens.t_stop", stated, limit)

    @property
    def image_distance_mm(self) -> float:
        """Lens to sensor: z_i = 1 / (1/f - 1/z_o) [mm]."""
        return 1.0 / (1.0 / self.focal_length_mm - 1e-3 / self.focus_distance_m)

    @property
    def magnification(self) -> float:
        """|m| = z_i / z_o at the plane in focus."""
        return self.image_distance_mm / (self.focus_distance_m * 1e3)

    @property
    def pupil_diameter_mm(self) -> float:
        """A = f / N [mm], of the circle with the area of the pupil."""
        return self.focal_length_mm / self.f_number

    @property
    def pupil(self) -> Pupil:
        """Shape of the pupil, by field."""
        return self._pupil

    @cached_property
    def _pupil(self) -> Pupil:
        opening = Pupil() if self.aperture is None else self.aperture.pupil()
        if self.vignetting is None:
            return opening
        distances_mm = self.image_distance_mm, self.focus_distance_m * 1e3
        return replace(opening, stops=self.vignetting.pupil_stops(opening, 0.5 * self.pupil_diameter_mm, *distances_mm))

    @property
    def working_f_number(self) -> float:
        """N_w = z_i / A = N (1 + |m|): what the sensor sees, for light and for diffraction (pupil magnification 1)."""
        return self.f_number * (1.0 + self.magnification)

    @property
    def diffraction_f_number(self) -> float:
        """N_w, which sets the size of the Airy disk."""
        return self.working_f_number

    @property
    def has_diffraction(self) -> bool:
        """Whether the aperture spreads light, by wave optics; a stated wavefront error implies it."""
        return self.diffraction or self.aberrations is not None

    @property
    def effective_transmittance(self) -> float:
        """Transmittance tau of the glass: as stated, or (N / T)^2 of a stated T-stop."""
        return self.transmittance if self.t_stop is None else (self.f_number / self.t_stop) ** 2

    @property
    def t_number(self) -> float:
        """T = N / sqrt(tau): f-number of the lossless lens that gives as much light."""
        return self.f_number / math.sqrt(self.effective_transmittance)

    def irradiance_per_radiance_sr(self) -> float:
        """E / L on the axis [sr], behind the filter."""
        return (
            math.pi
            * self.effective_transmittance
            * filter_transmittance(self.nd_filter)
            / (4.0 * self.working_f_number**2 + (1.0 if self.irradiance == "thin_lens" else 0.0))
        )

    def circle_um(self, diagonal_mm: float) -> float:
        """Largest blur circle that counts as sharp on a sensor of this diagonal [um]."""
        stated = self.circle_of_confusion_um
        return 1e3 * diagonal_mm / CIRCLES_PER_DIAGONAL if stated is None else stated

    def hyperfocal_m(self, circle_um: float) -> float:
        """Focus distance from which on everything up to infinity is sharp: H = f^2 / (N C) + f [m].

        The exact solution of C = A z_i / z_focus for z_focus, with z_i of that focus; f^2 / (N C) is an approximation.
        """
        return 1e-3 * (self.focal_length_mm**2 / (self.f_number * circle_um * 1e-3) + self.focal_length_mm)

    def depth_of_field_m(self, circle_um: float) -> tuple[float, float]:
        """Nearest and farthest distance whose blur circle is no wider than the circle of confusion [m].

        The blur is linear in 1/z, so both limits are: 1/z = 1/z_focus +- C / (A z_i). At and beyond the hyperfocal distance
        the far limit is infinity.
        """
        reach = circle_um / (self.pupil_diameter_mm * self.image_distance_mm)  # 1e-3 mm / mm^2 = 1/m
        focus = 1.0 / self.focus_distance_m
        # Rounding may leave a difference at the hyperfocal distance itself, where there is none.
        is_endless = self.focus_distance_m >= self.hyperfocal_m(circle_um) or focus <= reach
        return 1.0 / (focus + reach), math.inf if is_endless else 1.0 / (focus - reach)

    def smaller_aperture(self, blur_ratio: float) -> tuple[str, str, str]:
        """Key, value and replacement of the f-number that make blur `blur_ratio` times smaller."""
        return "lens.f_number", f"f/{self.f_number:g}", f"f/{self.f_number * blur_ratio:.3g} or more, focus nearer to it"

    def airy_diameter_um(self, wavelength_nm: float = GREEN_NM) -> float:
        """Diameter of the first dark ring of a point in focus [um]: 2.44 lambda N_w (Airy 1835), of a round pupil."""
        return 2e-3 * AIRY_ZERO * wavelength_nm * self.working_f_number

    def blur_radius_um(self, depth_m: float | np.ndarray) -> np.float64 | np.ndarray:
        """Signed radius of the blur circle on the sensor [um]; positive behind the plane in focus.

        C/2 = (A/2) z_i (1/z_focus - 1/z): linear in the inverse of the distance (similar triangles).
        depth_m: float or array, > 0; inf is allowed.
        """
        diopters = 1.0 / self.focus_distance_m - 1.0 / np.asarray(depth_m, dtype=np.float64)
        return 0.5 * self.pupil_diameter_mm * self.image_distance_mm * diopters
