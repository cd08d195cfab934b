"""Keys by which equal settings are recognised, so that what was computed from them can be used again."""

import hashlib
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path

import numpy as np

LARGEST_COMPARED = 2**20  # bytes of an array up to which its content is compared; larger ones are equal only to themselves


@dataclass(frozen=True, eq=False)
class Itself:
    """An object as a part of a key, equal to nothing else. While a key holds it, no other object gets its place in memory."""

    value: object

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Itself) and self.value is other.value

    def __hash__(self) -> int:
        return id(self.value)


def freeze(value: object, leave_out: frozenset[str] = frozenset()) -> Hashable:
    """Return a value as a part of a key: frozen dataclasses, mappings and sequences by their content, files by their version.

    A file's version is its path, size, time of change and number on its disk. A dataclass counts with its `companion_files`.
    Anything else is equal only to itself.
    leave_out: fields of the dataclass `value` that do not count. Raises OSError for a file that is not there.
    """
    if value is None or isinstance(value, str | bytes | int | float):
        return type(value), value
    if isinstance(value, Path):
        stat = value.stat()
        return value.absolute(), stat.st_size, stat.st_mtime_ns, stat.st_ino
    if isinstance(value, np.ndarray) and value.nbytes <= LARGEST_COMPARED:
        return value.shape, value.dtype.str, value.tobytes()
    if isinstance(value, tuple | list):
        return tuple(freeze(one) for one in value)
    if isinstance(value, Mapping):
        return tuple((name, freeze(value[name])) for name in sorted(value, key=str))
    if is_dataclass(value) and not isinstance(value, type):
        names = [one.name for one in fields(value) if one.name not in leave_out]
        beside = companion_files(value)
        files = tuple((name, freeze(beside[name])) for name in names if name in beside) if beside else ()
        return type(value), tuple((name, freeze(getattr(value, name))) for name in names), files
    return Itself(value)


def companion_files(value: object) -> Mapping[str, tuple[Path, ...]]:
    """Return the files that are read with those in the fields of a dataclass, by field; {} where it declares none.

    It declares them by a method of this name: the data of a header, the files that a list names. Of a file that is not there
    or cannot be read it returns none, and leaves the message to what reads it.
    """
    declared = getattr(value, "companion_files", None)
    return {} if declared is None else declared()


def is_ours(value: object) -> bool:
    """Whether an object is one of the simulator's, which give the same results while their fields and files are the same."""
    return type(value).__module__.startswith("simulator.")


def digest(values: np.ndarray) -> bytes:
    """Return a key of an array of any size by its content."""
    return hashlib.blake2b(np.ascontiguousarray(values).tobytes(), digest_size=16).digest()
