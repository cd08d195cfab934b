"""Turn validated sections into the simulator's frozen objects; every error names file and line."""

from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError

from simulator.config.document import Document, Keys, absolute_path, join_keys
from simulator.config.messages import convert_validation_error
from simulator.config.section_types import Section
from simulator.errors import PhotositeError

Model = TypeVar("Model", bound=Section)


def validate(model: type[Model], document: Document) -> Model:
    """Check a document against a model and make its paths absolute.

    Raises PhotositeError with file and line.
    """
    try:
        values = model.model_validate(document.data)
    except ValidationError as error:
        raise convert_validation_error(error, document, model) from None
    return make_paths_absolute(values, (), document)


def make_paths_absolute(value: Any, keys: Keys, document: Document) -> Any:
    """Return the same value with every relative path joined to the folder of the file that names it.

    Raises PhotositeError with file and line as `absolute_path` does.
    """
    if isinstance(value, Path):
        return absolute_path(value, document.place(keys), join_keys(keys))
    if isinstance(value, Section):
        for name, field in type(value).model_fields.items():
            inner = getattr(value, name)
            if isinstance(inner, (Path, Section, dict, list, tuple)):
                setattr(value, name, make_paths_absolute(inner, keys + (field.alias or name,), document))
    elif isinstance(value, dict):
        return {key: make_paths_absolute(inner, keys + (key,), document) for key, inner in value.items()}
    elif isinstance(value, (list, tuple)):
        return type(value)(make_paths_absolute(inner, keys + (index,), document) for index, inner in enumerate(value))
    return value


def build(value: Any, keys: Keys, document: Document) -> Any:
    """Return the simulator's object for a validated value.

    Raises PhotositeError with the line of the key whose value the object refuses, or of its section.
    """
    if isinstance(value, dict):
        return {key: build(inner, keys + (key,), document) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)(build(inner, keys + (index,), document) for index, inner in enumerate(value))
    if not isinstance(value, Section) or (assemble := type(value).assemble) is None:
        return value
    fields = type(value).model_fields
    arguments = {name: build(getattr(value, name), keys + (field.alias or name,), document) for name, field in fields.items()}
    try:
        return assemble(**arguments)
    except PhotositeError as error:
        named = _named_keys(error)
        if named is None:
            inside = tuple((error.key or "").split("."))  # where it is about a key that has no value, or none that counts
            raise document.locate_error(error, inside if inside[: len(keys)] == keys else keys) from None
        where = named if named[: len(keys)] == keys else (*keys, named[-1])
        raise document.locate_error(error.replace(key=join_keys(where)), where) from None


def locate_error(error: PhotositeError, document: Document) -> PhotositeError:
    """Return an error with the file and line of its key; unchanged if it is not about the value of a key of the document."""
    named = _named_keys(error)
    return error if named is None or named not in document.places else document.locate_error(error, named)


def _named_keys(error: PhotositeError) -> Keys | None:
    """Split the dotted key of an error about a value; None for an error about a file or the work, or whose key is prose."""
    if error.key is None or not error.names_a_value:
        return None
    return tuple(int(word) if word.isdigit() else word for word in error.key.split("."))
