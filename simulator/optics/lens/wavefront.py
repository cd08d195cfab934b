"""The wavefront of a lens: primary aberrations, Zernike terms and colour errors."""

from dataclasses import dataclass, field

import numpy as np

from simulator.errors import require
from simulator.optics.lens.zernike import noll_orders, zernike
from simulator.units import FNumber, Micrometres, Nanometres


@dataclass(frozen=True)
class ChromaticShift:
    """How the image of one wavelength differs.

    wavelength_nm: of the light [nm].
    focus_um: how far behind the sensor it comes to focus [um]: longitudinal chromatic aberration.
    lateral_um: how far outwards it lands at field 1 [um], in proportion to the field: lateral chromatic aberration.
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
    zernike_um: more terms by Noll's index, the same all over the field [um rms]; fixed to the picture's axes.
    chromatic: shifts by wavelength, ascending; straight between them, constant beyond.
    at_f_number: f-number the coefficients hold at; stopped down, only the inner part of this wavefront is left.
        Left out: they hold at whatever f-number the lens is set to.
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

    def __post_init__(self):
        wavelengths = [shift.wavelength_nm for shift in self.chromatic]
        ascending = all(low < high for low, high in zip(wavelengths[:-1], wavelengths[1:], strict=True))
        require(ascending, "lens.aberrations.chromatic", wavelengths, "give ascending wavelengths, each once")
        for index in self.zernike_um:
            noll_orders(index)

    def pupil_share(self, f_number: float) -> float:
        """Radius of the pupil in use over that of the stated wavefront: at_f_number / f_number.

        Raises PhotositeError when the lens is open wider than the wavefront is known.
        """
        if self.at_f_number is None:
            return 1.0
        rule = f"the wavefront is stated at f/{self.at_f_number:g} and unknown beyond; stop down or leave at_f_number out"
        require(f_number >= self.at_f_number, "lens.f_number", f"f/{f_number:g}", rule)
        return self.at_f_number / f_number

    def path_um(self, x, y, f_number: float, wavelength_nm: float, field_xy=(0.0, 0.0), blur_radius_um: float = 0.0):
        """Wavefront error W at pupil points [um], same shape as x and y (unit disk, axes of the picture).

        field_xy: image point over the half diagonal of the sensor, x to the right and y down.
        blur_radius_um: signed radius of the blur circle, as ThinLens.blur_radius_um: defocus of W = radius r^2 / 4 N.
        """
        height = float(np.hypot(*field_xy))
        cosine, sine = (1.0, 0.0) if height == 0 else (field_xy[0] / height, field_xy[1] / height)
        share = self.pupil_share(f_number)
        u, v = share * x, share * y
        along, r2 = u * cosine + v * sine, u**2 + v**2
        path = self.spherical_um * r2**2 + self.coma_um * height * r2 * along + self.astigmatism_um * (height * along) ** 2
        path = path + (self.field_curvature_um * height**2 + self.defocus_um) * r2
        for index, rms_um in self.zernike_um.items():
            path = path + rms_um * zernike(index, u, v)
        focus_um, lateral_um = self._chromatic_shift(wavelength_nm)
        path = path + (blur_radius_um / (4.0 * f_number) - focus_um / (8.0 * f_number**2)) * (x**2 + y**2)
        return path - lateral_um * height / (2.0 * f_number) * (x * cosine + y * sine)

    def _chromatic_shift(self, wavelength_nm: float) -> tuple[float, float]:
        if not self.chromatic:
            return 0.0, 0.0
        table = np.array([(shift.wavelength_nm, shift.focus_um, shift.lateral_um) for shift in self.chromatic])
        return tuple(float(np.interp(wavelength_nm, table[:, 0], table[:, column])) for column in (1, 2))
