"""`lens: {prescription: FILE, ...}`: the rays of a lens design make the thin lens; plain numbers from then on."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from simulator.color.color_tables import CONFIGS
from simulator.config.dataclass_sections import make_section, to_section
from simulator.config.document import Document
from simulator.errors import PhotositeError, require
from simulator.optics.lens.nd_filter import NeutralDensity
from simulator.optics.lens.prescription import KEY, trace_prescription
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Aperture
from simulator.units import FNumber, Metres, Micrometres, TStop

ROUNDED = 0.99  # a design marked f/2 opens to f/2.014; its marked f-number is taken as its widest
SHARED = ("transmittance", "t_stop", "irradiance", "aperture", "circle_of_confusion_um", "veiling_glare", "nd_filter")


@dataclass(frozen=True)
class PrescribedLens:
    """A lens design, whose rays give focal length, distortion, fall-off, lateral colour and aberrations.

    prescription: file of Zemax (.zmx), CODE V (.seq) or Optiland (.json).
    f_number: not below that of the file, which is the default; within 1 % it is that of the file.
    focus_distance_m: lens to the plane in focus, along the axis [m]; inf is allowed.
    aberrations: whether its aberrations spread light; distortion and fall-off are kept without.
    """

    prescription: Annotated[Path, "lens design: Zemax .zmx, CODE V .seq or Optiland .json, or a name in configs/lenses"]
    f_number: FNumber | None = None
    focus_distance_m: Metres = math.inf
    aberrations: bool = True
    transmittance: float = 1.0
    t_stop: TStop | None = None
    irradiance: Literal["thin_lens", "aplanatic"] = "thin_lens"
    aperture: Aperture | None = None
    circle_of_confusion_um: Micrometres | None = None
    veiling_glare: float = 0.0
    nd_filter: NeutralDensity | None = None


def resolve_prescription(values: Any, document: Document) -> None:
    """Replace the prescription in validated values of a shot by the thin lens that its rays tell.

    Raises PhotositeError with file and line as `trace_prescription` does, and for an f-number below the design's.
    """
    given = values.lens
    if not isinstance(given, make_section(PrescribedLens)):
        return
    try:
        values.lens = _thin_lens(given, values.camera)
    except PhotositeError as error:
        raise document.locate_error(error, tuple((error.key or KEY).split("."))) from None


def find_prescription(path: Path) -> Path:
    """Return the file that a path means: itself, or, for a bare name that is no file, that of configs/lenses."""
    shipped = sorted((CONFIGS / "lenses").glob(f"{path.name}.*"))
    return shipped[0] if not path.suffix and not path.is_file() and shipped else path


def _thin_lens(given: Any, camera: Any) -> Any:
    """Return the section of the thin lens."""
    half_mm = 0.5e-3 * camera.pixel_pitch_um * math.hypot(camera.width_px, camera.height_px)
    path = find_prescription(given.prescription)
    traced = trace_prescription(path, given.focus_distance_m, half_mm, given.f_number)
    f_number = traced.f_number if given.f_number is None else given.f_number
    widest = f"the design opens to f/{traced.f_number:.4g}; give that or more"
    require(f_number >= ROUNDED * traced.f_number, "lens.f_number", f"f/{f_number:g}", widest)
    lens = ThinLens(
        traced.focal_length_mm,
        max(f_number, traced.f_number),
        given.focus_distance_m,
        cos4=False,
        model=traced.name,
        distortion=traced.distortion,
        falloff=traced.falloff,
        aberrations=traced.aberrations if given.aberrations else None,
    )
    section = to_section(lens)
    for name in SHARED:
        setattr(section, name, getattr(given, name))
    return section
