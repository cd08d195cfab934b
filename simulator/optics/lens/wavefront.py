"""Wavefront error of a lens: primary aberrations, Zernike terms and chromatic aberration."""

from dataclasses import dataclass, field

import numpy as np

from simulator.errors import require
from simulator.optics.lens.wavefront_table import WavefrontTable
from simulator.optics.lens.zernike import noll_orders, zernike
from simulator.units import FNumber, Micrometres, Nanometres


@dataclass(frozen=True)
class ChromaticShift:
    """Chromatic aberration at one wavelength.

    wavelength_nm: of the light [nm].
    focus_um: distance of its focus behind the sensor [um]: longitudinal chromatic aberration.
    lateral_um: outward displacement of its image at field 1 [um], proportional to the field: lateral chromatic aberration.
    """

    wavelength_nm: Nanometres
    focus_um: Micrometres = 0.0
    lateral_um: Micrometres = 0.0


@dataclass(frozen=True)
class Aberrations:
    """Wavefront error W of a lens [um of optical path], by primary aberrations and Zernike terms.

    W = spherical r^4 + coma h r^3 cos + astigmatism h^2 r^2 cos^2 + field_curvature h^2 r^2 + defocus r^2 (Hopkins; Welford
    1986, chapter 7), with r = 1 at the rim of the pupil, the angle from the direction of the field, h = 1 at field 1, the
    corner of the sensor. A ray of pupil point p lands at -2 N grad W(p) from the image point, so a simple convex lens
    has spherical > 0, and coma > 0 flares towards the centre of the picture.

    spherical_um, coma_um, astigmatism_um, field_curvature_um, defocus_um: coefficients [um].
    zernike_um: further terms by Noll's index, constant over the field [um rms], in the axes of the picture.
    chromatic: shifts by wavelength, ascending; interpolated linearly, constant beyond the outermost.
    at_f_number: f-number that the coefficients are stated for; stopping down keeps the inner part of this wavefront.
        Left out: they hold at any f-number.
    traced: wavefront over field and wavelength of a lens whose rays were traced, on top; left out: none.
    Raises PhotositeError for wavelengths that do not ascend, or an unknown Zernike index.
    """

    spherical_um: Micrometres = 0.0
    coma_um: Micrometres = 0.0
    astigmatism_um: Micrometres = 0.0
    field_curvature_um: Micrometres = 0.0
    defocus_um: Micrometres = 0.0
    zernike_um: dict[int, Micrometres] = field(default_factory=dict)
    chromatic: tuple[ChromaticShift, ...] = ()
    at_f_number: FNumber | None = None
    traced: WavefrontTable | None = None

    def __post_init__(self) -> None:
        wavelengths = [shift.wavelength_nm for shift in self.chromatic]
        ascending = all(low < high for low, high in zip(wavelengths[:-1], wavelengths[1:], strict=True))
        require(ascending, "lens.aberrations.chromatic", wavelengths, "give ascending wavelengths, each once")
        for index in self.zernike_um:
            noll_orders(index)

    def pupil_radius_ratio(self, f_number: float) -> float:
        """Pupil radius at an f-number over the pupil radius of the stated wavefront: at_f_number / f_number.

        Raises PhotositeError for a pupil larger than that of the stated wavefront.
        """
        if self.at_f_number is None:
            return 1.0
        rule = f"the wavefront is stated at f/{self.at_f_number:g} and unknown beyond; stop down or leave at_f_number out"
        require(f_number >= self.at_f_number, "lens.f_number", f"f/{f_number:g}", rule)
        return self.at_f_number / f_number

    def wavefront_error_um(
        self,
        x: np.ndarray,
        y: np.ndarray,
        f_number: float,
        wavelength_nm: float,
        field_xy: tuple[float, float] = (0.0, 0.0),
        blur_radius_um: float = 0.0,
    ) -> np.ndarray:
        """Wavefront error W at pupil points [um], same shape as x and y (unit disk, axes of the picture).

        field_xy: image point over the half diagonal of the sensor, x to the right and y down.
        blur_radius_um: signed radius of the blur circle, as ThinLens.blur_radius_um: defocus of W = radius r^2 / 4 N.
        """
        height = float(np.hypot(*field_xy))
        cosine, sine = (1.0, 0.0) if height == 0 else (field_xy[0] / height, field_xy[1] / height)
        ratio = self.pupil_radius_ratio(f_number)
        u, v = ratio * x, ratio * y
        along, r2 = u * cosine + v * sine, u**2 + v**2
        path = self.spherical_um * r2**2 + self.coma_um * height * r2 * along + self.astigmatism_um * (height * along) ** 2
        path = path + (self.field_curvature_um * height**2 + self.defocus_um) * r2
        for index, rms_um in self.zernike_um.items():
            path = path + rms_um * zernike(index, u, v)
        if self.traced is not None:
            path = path + self.traced.wavefront_error_um(along, r2, height, wavelength_nm)
        focus_um, lateral_um = self._chromatic_shift(wavelength_nm)
        path = path + (blur_radius_um / (4.0 * f_number) - focus_um / (8.0 * f_number**2)) * (x**2 + y**2)
        return path - lateral_um * height / (2.0 * f_number) * (x * cosine + y * sine)

    @property
    def varies_over_field(self) -> bool:
        """Whether the wavefront differs over the field."""
        lateral = (shift.lateral_um for shift in self.chromatic)
        by_field = self.coma_um, self.astigmatism_um, self.field_curvature_um, *lateral
        return any(by_field) or self.traced is not None

    @property
    def has_fixed_orientation(self) -> bool:
        """Whether a part of the wavefront keeps to the axes of the picture, instead of turning with the field."""
        return any(noll_orders(index)[1] for index in self.zernike_um)

    @property
    def extreme_fields(self) -> tuple[float, ...]:
        """Fields among which rays land farthest from the image point."""
        return (0.0, 1.0) if self.traced is None else tuple(sorted({0.0, 1.0, *self.traced.fields}))

    def _chromatic_shift(self, wavelength_nm: float) -> tuple[float, float]:
        """Focus and lateral shift at a wavelength [um]."""
        if not self.chromatic:
            return 0.0, 0.0
        table = np.array([(shift.wavelength_nm, shift.focus_um, shift.lateral_um) for shift in self.chromatic])
        focus_um, lateral_um = (float(np.interp(wavelength_nm, table[:, 0], table[:, column])) for column in (1, 2))
        return focus_um, lateral_um
