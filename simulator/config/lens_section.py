"""The `lens:` section: a key names its kind, such as `pinhole:`; without such a key it is a thin lens."""

from functools import cache, reduce
from operator import or_
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, create_model

from simulator.config.dataclass_sections import make_section
from simulator.config.prescription_section import PrescribedLens
from simulator.config.section_types import Section
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens

# Kinds of lens that a key names; its value holds their numbers.
LENSES: dict[str, type] = {"pinhole": Pinhole, "bare_sensor": BareSensor}


@cache
def make_lens_field() -> tuple[Any, Any]:
    """Return the annotation and the Field of a shot's lens."""
    kinds: list[Any] = [Annotated[make_section(cls), Tag(f"<{cls.__name__}>")] for cls in (ThinLens, PrescribedLens)]
    for key in LENSES:
        model = _make_kind_section(key)
        kinds.append(Annotated[model, Tag(f"<{model.__name__}>")])
    text = "what forms the image: the numbers of a thin lens, or the prescription of one, or a pinhole, or bare_sensor"
    return Annotated[reduce(or_, kinds), Discriminator(_find_lens_branch)], Field(description=text)


@cache
def _make_kind_section(key: str) -> type[Section]:
    cls = LENSES[key]
    members: dict[str, Any] = {key: (make_section(cls), Field(description=(cls.__doc__ or "").partition("\n")[0]))}
    model = create_model(f"Lens{cls.__name__}", __base__=Section, __doc__="A lens of this kind.", **members)
    model.assemble = lambda **values: values[key]
    return model


def _find_lens_branch(value: object) -> str:
    if isinstance(value, Section):
        return f"<{type(value).__name__}>"
    if isinstance(value, dict) and "prescription" in value:
        return f"<{PrescribedLens.__name__}>"
    key = next((key for key in LENSES if isinstance(value, dict) and key in value), None)
    return f"<{ThinLens.__name__ if key is None else _make_kind_section(key).__name__}>"
