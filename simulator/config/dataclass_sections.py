"""Make the pydantic models of the configuration from the frozen dataclasses of the simulator.

A dataclass is a section of the YAML file, a field is a key. A field annotated with a Unit loses its unit suffix
(`focal_length_mm` becomes `focal_length`) and takes a quantity with a unit. Descriptions come from the
`name: text` lines of the dataclass's docstring, so they are written once.
"""

import dataclasses
import functools
import re
import types
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import Field, Strict, create_model

from simulator.config.section_types import Quantity, Section, make_union
from simulator.units import key_of, unit_of


def read_descriptions(cls: type) -> dict[str, str]:
    """Return the `name: text` lines of a docstring, with their indented continuation lines, by name."""
    result: dict[str, str] = {}
    current = None
    for line in (cls.__doc__ or "").splitlines():
        stripped = line.strip()
        if match := re.match(r"(\w+): (.+)", stripped):
            current = match[1]
            result[current] = match[2]
        elif current and stripped and len(line) - len(line.lstrip()) > 4:
            result[current] += " " + stripped
        else:
            current = None
    return result


CUSTOM_TEXTS: dict[type, Any] = {}  # classes that are one text in the configuration, with pydantic's annotation of it
CUSTOM_SECTIONS: dict[type, Callable[[], type[Section]]] = {}  # classes whose section differs from their fields
_made: dict[type, type[Section]] = {}  # by class, so that a class used in two places has one section


def make_section(cls: type[Any]) -> type[Section]:
    """Return the model of a frozen dataclass.

    Raises TypeError for a field whose type has no form in YAML, such as an array.
    """
    if cls not in _made:
        _made[cls] = CUSTOM_SECTIONS[cls]() if cls in CUSTOM_SECTIONS else make_custom_section(cls)
    return _made[cls]


def defer_fields(cls: type, *names: str) -> None:
    """Leave fields of a dataclass out of the configuration; a section then becomes a function that takes them as arguments."""
    CUSTOM_SECTIONS[cls] = functools.cache(
        lambda: make_custom_section(cls, functools.partial(functools.partial, cls), leave_out=frozenset(names))
    )


def hide_fields(cls: type, *names: str) -> None:
    """Leave fields of a dataclass out of the configuration, where they keep their defaults."""
    CUSTOM_SECTIONS[cls] = functools.cache(lambda: make_custom_section(cls, leave_out=frozenset(names)))


def make_custom_section(
    cls: type,
    assemble: Callable[..., object] | None = None,
    replace: dict[str, type[Section]] | None = None,
    extra: Mapping[str, Any] | None = None,
    leave_out: frozenset[str] = frozenset(),
) -> type[Section]:
    """Return the model of a frozen dataclass some of whose fields differ in the configuration.

    assemble: called instead of the class to make the object. replace: sections of fields, by field name.
    extra: keys that are no fields, each with (annotation, default or Field).
    leave_out: fields that the configuration does not set.
    """
    hints, texts = get_type_hints(cls, include_extras=True), read_descriptions(cls)
    members: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        if not field.init or field.name in leave_out:
            continue
        hint = hints[field.name]
        other = (replace or {}).get(field.name)
        text = next((part for part in getattr(hint, "__metadata__", ()) if isinstance(part, str)), texts.get(field.name))
        options: dict[str, Any] = _default(field)
        if other and options:
            options = {"default_factory": functools.partial(other.model_validate, {})}
        annotation = other or to_annotation(hint)
        options |= {"alias": key_of(field.name, hint), "description": text}
        members[field.name] = (annotation, Field(**options))
    members |= extra or {}
    model = create_model(cls.__name__, __base__=Section, __doc__=(cls.__doc__ or "").partition("\n")[0], **members)
    model.assemble = assemble or cls
    return model


def _default(field: dataclasses.Field[Any]) -> dict[str, Any]:
    if field.default is not dataclasses.MISSING:
        return {"default_factory": functools.partial(to_section, field.default)}
    if (make := field.default_factory) is not dataclasses.MISSING:
        return {"default_factory": lambda: to_section(make())}
    return {}


def to_section(value: Any) -> Any:
    """Convert a dataclass instance that serves as a default into its section; return other values unchanged."""
    if isinstance(value, type) or not dataclasses.is_dataclass(value):
        return value
    cls: type[Any] = type(value)
    given: dict[str, Any] = {field.name: to_section(getattr(value, field.name)) for field in dataclasses.fields(value)}
    return make_section(cls).model_construct(**given)


def to_annotation(hint: Any) -> Any:
    """Translate the annotation of a dataclass field into the one that pydantic checks."""
    if (unit := unit_of(hint)) and get_origin(hint) is Annotated:
        return Annotated[float, Quantity(unit)]
    origin, parts = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return to_annotation(parts[0])
    if isinstance(hint, type) and hint in CUSTOM_TEXTS:
        return CUSTOM_TEXTS[hint]
    if isinstance(hint, type) and dataclasses.is_dataclass(hint):
        cls: type[Any] = hint
        return make_section(cls)
    if hint is Path or hint in (str, int, float, bool, type(None), Any) or origin is Literal:
        return Annotated[Path, Field(strict=False)] if hint is Path else hint
    if origin in (Union, types.UnionType):
        return make_union([to_annotation(part) for part in parts], parts)
    if origin is dict:
        key: Any = Annotated[int, Strict(False)] if parts[0] is int else parts[0]
        return types.GenericAlias(dict, (key, to_annotation(parts[1])))
    if origin in (list, tuple):
        inner = tuple(part if part is Ellipsis else to_annotation(part) for part in parts)
        return Annotated[types.GenericAlias(origin, inner), Strict(False)]
    raise TypeError(f"{hint} has no form in YAML")
