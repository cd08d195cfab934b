"""Convert pydantic's errors into one PhotositeError: file, line, dotted key, value, and what to write instead."""

import difflib
import re
from typing import Any, get_args

from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from simulator.config.document import Document, Keys, join_keys
from simulator.config.section_types import Quantity, Section
from simulator.config.unit_words import write_example
from simulator.errors import PhotositeError

WANTED = {
    "int_type": "give a whole number without a unit",
    "int_from_float": "give a whole number without a unit",
    "int_parsing": "give a whole number",
    "float_type": "give a number without a unit",
    "finite_number": "give a finite number",
    "bool_type": "write true or false",
    "string_type": "give text",
    "path_type": "give the path of a file",
    "list_type": "give a list such as [1, 2]",
    "tuple_type": "give a list such as [1, 2]",
    "too_short": "give at least one value",
    "dict_type": "give a section of `key: value` lines",
    "model_type": "give a section of `key: value` lines",
    "none_required": "give a section of `key: value` lines, or leave it out",
    "model_attributes_type": "give a section of `key: value` lines",
}
SECTION_KINDS = ("dict_type", "model_type", "model_attributes_type")
FILE_NAME = re.compile(r"\w\.[A-Za-z]\w{1,4}$")  # ends with a name and a suffix, such as depth.exr
MOST_LISTED_KEYS = 12  # of a section, in a message that says what it holds


def convert_validation_error(error: ValidationError, document: Document, model: type[Section]) -> PhotositeError:
    """Return the first of pydantic's errors with what to write instead, and the number of the others."""
    findings = error.errors(include_url=False)
    # A misspelt key is both unknown and missing: the message names the unknown one, because it shows the spelling.
    finding = min(findings, key=lambda found: found["type"] != "extra_forbidden")
    keys = strip_branch_names(finding["loc"])
    problem = _describe_finding(finding, keys, model)
    others = _missing_beside(finding, findings)
    if others:
        verb = "is" if len(others) == 1 else "are"
        problem = problem.replace(rule=f"{problem.rule}; so {verb} {', '.join(others)}")
    left = len(findings) - 1 - len(others)
    more = f" ({left} more after this one)" if left else ""
    return document.locate_error(problem.replace(rule=problem.rule + more), keys)


def _missing_beside(finding: ErrorDetails, findings: list[ErrorDetails]) -> list[str]:
    """Return the other keys that are missing in the section in which the finding misses one."""
    if finding["type"] != "missing":
        return []
    section = finding["loc"][:-1]
    beside = [found for found in findings if found["type"] == "missing" and found["loc"][:-1] == section]
    return [str(found["loc"][-1]) for found in beside if found is not finding]


def strip_branch_names(location: Keys) -> Keys:
    """Return a pydantic location without the names of union branches."""
    return tuple(key for key in location if not (isinstance(key, str) and key[:1] in "<["))


def _describe_finding(finding: ErrorDetails, keys: Keys, model: type[Section]) -> PhotositeError:
    """Return `key = value: what to write` for one finding, without file and line."""
    key, kind, location = join_keys(keys), finding["type"], finding["loc"]
    if kind == "extra_forbidden":
        known = list_known_keys(model, location[:-1])
        rule = _describe_mixed_kinds(model, location) or f"unknown key; {suggest_nearest(str(keys[-1]), known)}"
        return PhotositeError(rule, key=key)
    if kind == "missing":
        return PhotositeError(f"is missing{_describe_field(find_field(model, location))}", key=key, joint=" ")
    if keys and finding["input"] is None:
        return PhotositeError(f"is empty: {WANTED.get(kind, 'give a value')}, or leave the key out", key=key, joint=" ")
    value = None if isinstance(finding["input"], (dict, list)) else f"{finding['input']}"
    if kind == "literal_error":
        choices = [
            str(choice) for choice in _list_literal_values(find_field(model, location) or find_field(model, location[:-1]))
        ]
        if isinstance(given := finding["input"], dict) and len(given) == 1 and (choice := str(next(iter(given)))) in choices:
            own = choice in list_known_keys(model, location[:-1])
            beside = f", and its settings in a section of that name beside it, `{choice}:`" if own else ""
            return PhotositeError(f"is a section: write `{keys[-1]}: {choice}`{beside}", key=key, joint=" ")
        return PhotositeError(suggest_nearest(str(finding["input"]), choices), key=key, value=value)
    if kind == "value_error" and "ctx" in finding:
        hint = _picture_hint(finding["input"], find_field(model, location))
        return PhotositeError(f"{finding['ctx']['error']}{hint}", key=key, value=value)
    known = list_known_keys(model, location) if kind in SECTION_KINDS else []
    listed = f"; its keys: {', '.join(known)}" if 0 < len(known) <= MOST_LISTED_KEYS else ""
    return PhotositeError(WANTED.get(kind, finding["msg"]) + listed, key=key, value=value)


def _picture_hint(value: object, field: FieldInfo | None) -> str:
    """Return how a picture is given where a file name stands for a section with the keys image and unit; "" elsewhere."""
    sections = [] if field is None else find_sections(field.annotation)
    takes_picture = any({"image", "unit"} <= set(list_known_keys(section, ())) for section in sections)
    is_file_name = isinstance(value, str) and FILE_NAME.search(value) is not None
    return f"; a file is given as {{image: {value}, unit: m}}" if takes_picture and is_file_name else ""


def _describe_mixed_kinds(model: type[Section], location: Keys) -> str | None:
    """Return what to write instead of keys of several kinds, where the keys of a section tell its kind; None elsewhere.

    location: of a key that the kind lacks which the other keys tell.
    """
    branch, key = location[-2:] if len(location) > 1 else ("", "")
    field = find_field(model, location[:-2])
    if field is None or not (isinstance(branch, str) and branch.startswith("<")):
        return None
    kinds = {inner: list_known_keys(inner, ()) for inner in find_sections(field.annotation)}
    chosen = next((inner for inner in kinds if f"<{inner.__name__}>" == branch), None)
    owners = [_name_kind(inner) for inner, keys in kinds.items() if key in keys]
    if chosen is None or not owners:
        return None
    listed = "; ".join(f"{_name_kind(inner)}: {', '.join(sorted(keys))}" for inner, keys in kinds.items())
    return f"is of another kind ({' or '.join(owners)}) than the keys beside it ({_name_kind(chosen)}); keep one kind: {listed}"


def _name_kind(section: type[Section]) -> str:
    """Return the name of a section in words: `rolling shutter` of RollingShutter."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", section.__name__).lower()


def suggest_nearest(word: str, choices: list[str]) -> str:
    """Return `did you mean ...?` with the most similar choice, or all choices when none is similar."""
    lowered = {choice.lower(): choice for choice in choices}
    close = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.5)
    listed = ", ".join(sorted(choices)) or "none"
    return f"did you mean `{lowered[close[0]]}`? (known: {listed})" if close else f"use one of: {listed}"


def list_known_keys(model: type[Section], location: Keys) -> list[str]:
    """Return the keys that the section at a pydantic location may have."""
    inner = find_model(model, location)
    return [field.alias or name for name, field in inner.model_fields.items()] if inner else []


def find_model(model: type[Section], location: Keys) -> type[Section] | None:
    """Return the section's model at a pydantic location."""
    candidates: list[type[Section]] = [model]
    for key in location:
        if isinstance(key, str) and key.startswith("<"):
            candidates = [inner for inner in candidates if f"<{inner.__name__}>" == key] or candidates
            continue
        fields = [field for inner in candidates if (field := find_field_by_key(inner, key))]
        if fields:  # otherwise the key indexes a dict or list, whose items have the candidates' models already
            candidates = [inner for field in fields for inner in find_sections(field.annotation)]
    return candidates[0] if candidates else None


def find_field(model: type[Section], location: Keys) -> FieldInfo | None:
    """Return the field at a pydantic location."""
    while location and isinstance(location[-1], str) and location[-1][:1] in "<[":
        location = location[:-1]
    inner = find_model(model, location[:-1]) if location else None
    return find_field_by_key(inner, location[-1]) if inner else None


def find_field_by_key(model: type[Section], key: object) -> FieldInfo | None:
    """Return the field of a model that a YAML key sets."""
    return next((field for name, field in model.model_fields.items() if (field.alias or name) == key), None)


def find_sections(annotation: Any) -> list[type[Section]]:
    """Return all section models in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return [annotation]
    return [inner for part in get_args(annotation) for inner in find_sections(part)]


def _list_literal_values(field: FieldInfo | None) -> list[str | int]:
    def values(annotation: Any) -> list[Any]:
        parts = get_args(annotation)
        return [value for part in parts for value in values(part)] if parts else [annotation]

    return [value for value in values(field.annotation) if isinstance(value, str | int)] if field else []


def _describe_field(field: FieldInfo | None) -> str:
    if field is None:
        return ""
    unit = next((part.unit for part in field.metadata if isinstance(part, Quantity)), None)
    text = f": {field.description.rstrip('.')}" if field.description else ""
    return text + (f"; write for example `{field.alias}: {write_example(unit)}`" if unit else "")
