"""Files that a shot is read from: their keys in the shot file, and their SHA-256."""

import hashlib
import os
from collections.abc import Hashable
from dataclasses import fields, is_dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import get_type_hints

from simulator.scene.content_keys import companion_files, freeze
from simulator.units import key_of


def named_files(value: object, keys: tuple[str, ...]) -> list[tuple[tuple[str, ...], Path]]:
    """Return the files that a frozen dataclass, such as a scene or a lens, is read from, each with its keys in the shot file.

    Files that a file leads to, such as the kernels of a list, follow it and have its keys.
    """
    if isinstance(value, Path):
        return [(keys, value)]
    if isinstance(value, tuple):
        return [found for index, inner in enumerate(value) for found in named_files(inner, keys + (str(index),))]
    if isinstance(value, dict):
        return [found for key, inner in value.items() for found in named_files(inner, keys + (str(key),))]
    if not is_dataclass(value):
        return []
    kind: type = type(value)
    beside, found = companion_files(value), []
    for name, key in _keys_of(kind).items():
        found += named_files(getattr(value, name), keys + (key,))
        found += [(keys + (key,), path) for path in beside.get(name, ())]
    return found


@cache
def _keys_of(kind: type) -> dict[str, str]:
    """Return the fields of a dataclass, each with its key in a shot file."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: key_of(field.name, hints[field.name]) for field in fields(kind)}


def fingerprints(scene: object, lens: object = None, motion: object = None) -> list[dict[str, str]]:
    """Key, path and SHA-256 of every file that scene, lens and motion are read from, plain data for files. Raises OSError.

    Of several entries of one key the first is the file that the shot names, and the others are those it leads to.
    """
    named = files_of_parts(scene, lens, motion)
    return [{"key": ".".join(keys), "path": str(path), "sha256": sha256_of(path)} for keys, path in named]


def files_of_parts(scene: object, lens: object, motion: object) -> list[tuple[tuple[str, ...], Path]]:
    """Return the files that scene, lens and motion of a shot are read from, each with its keys in the shot file."""
    return [*named_files(scene, ("scene",)), *named_files(lens, ("lens",)), *named_files(motion, ("motion",))]


def sha256_of(path: str | os.PathLike) -> str:
    """SHA-256 of a file's content, 64 hexadecimal digits (FIPS 180-4). Raises OSError."""
    path = Path(path).absolute()
    return _sha256(path, freeze(path))


@lru_cache(maxsize=4096)
def _sha256(path: Path, _version: Hashable) -> str:
    # The points of a sweep share their scene, so that each file is read once; a list of kernels may have hundreds.
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
