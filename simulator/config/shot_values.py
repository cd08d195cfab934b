"""Every value of a shot by its key, with unit, and whether it holds because nothing else was said."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from simulator.config.build import validate
from simulator.config.document import Document, Place
from simulator.config.section_types import Section
from simulator.config.shot_file import dump_resolved, make_shot_section
from simulator.config.shot_text import describe_changed
from simulator.errors import PhotositeError
from simulator.pipeline.shot import Shot
from simulator.scene.charts import ChartScene

STAND_IN = ChartScene("flat_field", 1.0)  # of a scene that no file can hold


@dataclasses.dataclass(frozen=True)
class ShotValue:
    """One value of a shot.

    path: its dotted key, as `--set` takes it. value: plain data; a quantity is text with its unit.
    is_default: whether it is what the key has where it is left out.
    """

    path: str
    value: Any
    is_default: bool


def shot_values(shot: Shot) -> list[ShotValue]:
    """Return the values of a shot in the order of a shot file; sources of numbers are left out.

    A part that no file can hold, such as a scene of arrays, is one value: the name of its class.
    """
    text = shot.resolved or _described(shot)
    if not text:
        parts = [field.name for field in dataclasses.fields(shot) if field.compare]
        return [ShotValue(name, type(getattr(shot, name)).__name__, False) for name in parts]
    section: Any = validate(make_shot_section(), Document(text, {(): Place(shot.name, Path.cwd())}))
    found = _values(section, dump_resolved(section), "")
    if shot.resolved:
        return list(found)
    rest = [one for one in found if not one.path.startswith("scene.")]
    name = next(iter(one for one in rest if one.path == "name"))
    return [name, ShotValue("scene", type(shot.scene).__name__, False), *(one for one in rest if one is not name)]


def _described(shot: Shot) -> dict[str, Any]:
    """Return the configuration of a shot made of objects, with another scene; {} where a part has no form in a file."""
    try:
        other = dataclasses.replace(shot, scene=STAND_IN)
        text = describe_changed(other, other, {}, make_shot_section())
        validate(make_shot_section(), Document(text, {(): Place(shot.name, Path.cwd())}))
    except (TypeError, PhotositeError):
        return {}
    return text


def _values(section: Section, text: dict[str, Any], path: str, known: Section | None = None) -> Iterator[ShotValue]:
    """Yield the values of a section and those in it. known: the section that holds where this one is left out."""
    for name, field in type(section).model_fields.items():
        key, value = field.alias or name, getattr(section, name)
        if key not in text or key == "source":
            continue
        dotted = f"{path}{key}"
        default = getattr(known, name) if known is not None else field.get_default(call_default_factory=True)
        if isinstance(value, Section):
            inner = default if type(default) is type(value) else None
            yield from _values(value, text[key], f"{dotted}.", inner)
        else:
            yield ShotValue(dotted, text[key], _is_same(value, default))


def _is_same(value: Any, default: Any) -> bool:
    return type(value) is type(default) and bool(value == default)
