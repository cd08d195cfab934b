"""Files that a scene is read from, by their keys in the shot file."""

from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_type_hints

from simulator.config.sections import key_of


def input_files(value: object) -> list[Path]:
    """Return the paths in a frozen dataclass, at any depth: the files a scene is read from."""
    return [path for _, path in named_files(value, ())]


def named_files(value: object, keys: tuple[str, ...]) -> list[tuple[tuple[str, ...], Path]]:
    """Return the paths in a frozen dataclass, each with its keys in the shot file."""
    if isinstance(value, Path):
        return [(keys, value)]
    if not is_dataclass(value):
        return []
    hints = get_type_hints(type(value), include_extras=True)
    named = [(keys + (key_of(field.name, hints[field.name]),), getattr(value, field.name)) for field in fields(value)]
    return [found for inner_keys, inner in named for found in named_files(inner, inner_keys)]
