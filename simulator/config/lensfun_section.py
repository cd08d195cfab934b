"""`lens.lensfun: NAME`: distortion, lateral colour and fall-off of lensfun's database take its place as plain numbers."""

import math
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from simulator.config.dataclass_sections import CUSTOM_SECTIONS, make_custom_section, make_section, to_annotation, to_section
from simulator.config.document import Document
from simulator.config.section_types import Section
from simulator.errors import PhotositeError, require
from simulator.optics.lens.lensfun import KEY, lens_profile
from simulator.optics.lens.thin_lens import ThinLens

MOST_FIT_ERROR = 0.01  # of the half diagonal; six of the 5671 entries of the database of 2023 are above


@dataclass(frozen=True)
class LensfunChoice:
    """A lens of lensfun's database that is not where it is installed.

    lens: name in the database, such as Canon EF 50mm f/1.8 II.
    database: folder or file of the database; left out: the installed one.
    """

    lens: str
    database: Annotated[Path | None, "folder or .xml file of the database; left out: the installed one"] = None


@cache
def make_thin_lens_section() -> type[Section]:
    """Return the model of a thin lens, with the key `lensfun`."""
    text = "name of a lens in lensfun's database, for its distortion, lateral colour and fall-off; or {lens, database}"
    choice: Any = to_annotation(str | LensfunChoice)
    extra = {"lensfun": (choice | None, Field(default=None, description=text))}
    return make_custom_section(ThinLens, partial(_make_thin_lens), extra=extra)


CUSTOM_SECTIONS[ThinLens] = make_thin_lens_section


def _make_thin_lens(lensfun: object = None, **values: Any) -> ThinLens:
    return ThinLens(**values)


def resolve_lensfun(values: Any, document: Document) -> None:
    """Put the profile that `lens.lensfun` names in its place, in validated values of a shot.

    Raises PhotositeError with file and line as `lens_profile` does, and for a lens that states what the profile holds.
    """
    lens = values.lens
    if not isinstance(lens, make_section(ThinLens)) or lens.lensfun is None:  # type: ignore[attr-defined]
        return
    try:
        _resolve(lens, values.camera)
    except PhotositeError as error:
        raise document.locate_error(error, ("lens", "lensfun")) from None


def _resolve(lens: Any, camera: Any) -> None:
    for key in ("distortion", "falloff", "vignetting"):
        rule = f"tells distortion and fall-off of the lens; leave lens.{key} out"
        require(getattr(lens, key) is None, KEY, lens.lensfun, rule)
    choice = LensfunChoice(lens.lensfun) if isinstance(lens.lensfun, str) else lens.lensfun
    diagonal_mm = 1e-3 * camera.pixel_pitch_um * math.hypot(camera.width_px, camera.height_px)
    profile = lens_profile(
        choice.lens, lens.focal_length_mm, lens.f_number, lens.focus_distance_m, diagonal_mm, choice.database
    )
    rule = (
        "has a distortion that no polynomial of even powers follows to 1 % of the half diagonal; give lens.distortion instead"
    )
    require(profile.fit_error < MOST_FIT_ERROR, KEY, choice.lens, rule)
    if profile.falloff is not None:
        rule = "has cos^4 in its fall-off; leave lens.cos4 out"
        require("cos4" not in lens.model_fields_set or not lens.cos4, KEY, choice.lens, rule)
        lens.cos4 = False
    if "model" not in lens.model_fields_set:
        lens.model = profile.model
    lens.distortion, lens.falloff, lens.lensfun = to_section(profile.distortion), to_section(profile.falloff), None
