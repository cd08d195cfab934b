"""From validated sections to the simulator's frozen objects, with file and line in every complaint."""

import re
from pathlib import Path

from pydantic import ValidationError

from simulator.config.document import Document
from simulator.config.problems import from_validation
from simulator.config.section_types import Section
from simulator.errors import PhotositeError


def validate(model: type[Section], document: Document) -> Section:
    """Check a document against a model and make its paths absolute.

    Raises PhotositeError with file and line.
    """
    try:
        values = model.model_validate(document.data)
    except ValidationError as error:
        raise from_validation(error, document, model) from None
    return locate(values, (), document)


def locate(value: object, keys: tuple, document: Document) -> object:
    """Return the same value with every relative path joined to the folder of the file that names it."""
    if isinstance(value, Path):
        return (document.place(keys).folder / value.expanduser()).absolute()
    if isinstance(value, Section):
        for name, field in type(value).model_fields.items():
            inner = getattr(value, name)
            if isinstance(inner, (Path, Section, dict)):
                setattr(value, name, locate(inner, keys + (field.alias or name,), document))
    elif isinstance(value, dict):
        return {key: locate(inner, keys + (key,), document) for key, inner in value.items()}
    return value


def build(value: object, keys: tuple, document: Document) -> object:
    """Return the simulator's object for a validated value.

    Raises PhotositeError with the line of the key that the object complains about, or of its section.
    """
    if isinstance(value, dict):
        return {key: build(inner, keys + (key,), document) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(build(inner, keys + (index,), document) for index, inner in enumerate(value))
    if not isinstance(value, Section) or type(value).assemble is None:
        return value
    fields = type(value).model_fields
    arguments = {name: build(getattr(value, name), keys + (field.alias or name,), document) for name, field in fields.items()}
    try:
        return type(value).assemble(**arguments)
    except PhotositeError as error:
        raise _located(str(error), keys, document) from None


def _located(message: str, keys: tuple, document: Document) -> PhotositeError:
    """Return the complaint of an object at `keys` with the line and the whole dotted path of the key it begins with."""
    named = re.match(r"[\w.]+(?= = )", message)
    if named is None:
        return document.problem(keys, message)
    words = tuple(int(word) if word.isdigit() else word for word in named[0].split("."))
    where = words if words[: len(keys)] == keys else (*keys, words[-1])
    return document.problem(where, ".".join(map(str, where)) + message[named.end() :])
