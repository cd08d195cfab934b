"""The configuration of a shot whose parts were replaced after it was loaded: what it says is what is taken, or nothing."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np

from simulator.config.messages import find_sections
from simulator.config.quantity import format_quantity
from simulator.config.response_curves import response_text
from simulator.config.section_types import Quantity, Section
from simulator.config.speed_text import format_speed
from simulator.exposure.object_motion import Speed
from simulator.sensor.camera.camera_sections import SpectralResponse

Known = dict[int, Any]  # id of an object -> the plain data that it was made from


def describe_changed(value: Any, made: Any, text: dict[str, Any], model: type[Section]) -> dict[str, Any]:
    """Return the plain data of a section that makes `value`.

    made: another object of the section, text: the plain data that it was made from. Parts of it that are parts of `value`, too,
    keep their text. model: of the section. The result may make another object where a part has no form in YAML: the caller
    makes it and compares. Raises TypeError for parts that have none at all.
    """
    known: Known = {}
    _remember(made, text, model, known)
    return _section_text(value, model, known)


def is_same(one: Any, other: Any) -> bool:
    """Whether two objects have equal contents: dataclasses and mappings part by part, arrays number by number."""
    if one is other:
        return True
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        return np.array_equal(one, other)
    if isinstance(one, Path) and isinstance(other, Path):
        return one.absolute() == other.absolute()
    if dataclasses.is_dataclass(one) and type(one) is type(other):
        names = [field.name for field in dataclasses.fields(one) if field.compare]
        return all(is_same(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, dict) and isinstance(other, dict):
        return one.keys() == other.keys() and all(is_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple) and isinstance(other, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    return bool(one == other)


def _remember(value: Any, text: Any, annotation: Any, known: Known) -> None:
    """Store for each part of an object the plain data that it was made from."""
    if isinstance(text, (dict, list)):
        known[id(value)] = text
    model = _find_model(value, annotation)
    if model is not None and isinstance(text, dict):
        for key, part, inner in _parts(value, model):
            if key in text:
                _remember(part, text[key], inner, known)
    elif isinstance(value, dict) and isinstance(text, dict):
        for key, part in value.items():
            _remember(part, text.get(key), annotation, known)
    elif isinstance(value, tuple) and isinstance(text, list) and len(value) == len(text):  # else the object completes its own
        for part, inner_text in zip(value, text, strict=True):
            _remember(part, inner_text, annotation, known)


def _text(value: Any, annotation: Any, known: Known) -> Any:
    """Return the plain data of a value."""
    if id(value) in known:
        return known[id(value)]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Path):
        return str(value.absolute())
    if value is None or isinstance(value, (bool, str)):
        return value
    if isinstance(value, (int, float)):
        quantity = _find_quantity(annotation)
        return value if quantity is None else format_quantity(value, quantity.unit)
    if isinstance(value, Speed):
        return format_speed(value)
    if isinstance(value, SpectralResponse):
        return response_text(value)
    if (model := _find_model(value, annotation)) is not None:
        return _section_text(value, model, known)
    if isinstance(value, dict):
        return {key: _text(part, annotation, known) for key, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [_text(part, annotation, known) for part in value]
    raise TypeError(f"{type(value).__name__} has no form in YAML")


def _section_text(value: Any, model: type[Section], known: Known) -> dict[str, Any]:
    texts = {key: _text(part, annotation, known) for key, part, annotation in _parts(value, model)}
    return {key: text for key, text in texts.items() if text is not None}


def _parts(value: Any, model: type[Section]) -> Iterator[tuple[str, Any, Any]]:
    """Yield key, value and annotation of each part of an object that a section states."""
    for name, field in model.model_fields.items():
        annotation = (field.annotation, *field.metadata)
        if isinstance(value, dict):
            if name in value:
                yield field.alias or name, value[name], annotation
        elif hasattr(value, name):
            yield field.alias or name, getattr(value, name), annotation
        elif _find_model(value, annotation) is not None:  # a section that only tells the kind, such as `pinhole:`
            yield field.alias or name, value, annotation


def _find_model(value: Any, annotation: Any) -> type[Section] | None:
    """Return the section in an annotation that describes an object; None without one."""
    models = _sections(annotation)
    if isinstance(value, dict):
        return next((model for model in models if value.keys() <= model.model_fields.keys()), None)
    if isinstance(value, type) or not dataclasses.is_dataclass(value):
        return None
    name = type(value).__name__
    for model in models:
        inner = [field.annotation for field in model.model_fields.values()]
        if model.__name__ == name or (len(inner) == 1 and any(one.__name__ == name for one in _sections(inner[0]))):
            return model
    return None


def _sections(annotation: Any) -> list[type[Section]]:
    if isinstance(annotation, tuple):
        return [model for part in annotation for model in _sections(part)]
    return find_sections(annotation)


def _find_quantity(annotation: Any) -> Quantity | None:
    """Return the quantity in an annotation; None for a bare number."""
    if isinstance(annotation, Quantity):
        return annotation
    inner = annotation if isinstance(annotation, tuple) else get_args(annotation) if annotation is not None else ()
    return next(filter(None, map(_find_quantity, inner)), None)
