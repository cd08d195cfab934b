"""Texts of the kernels in kernels/*.cl, and what they declare.

`#include "x.h"` is expanded here, because PoCL refuses an -I path that contains a space.
Arguments and fields of structs are bound by name, so that a missing or misspelt one raises an error.
"""

import functools
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

_HERE = Path(__file__).resolve().parents[1]
KERNELS = next(folder for folder in (_HERE / "kernels", _HERE.parent / "kernels") if folder.is_dir())
_INCLUDE = re.compile(r'^#include "([^"]+)"$', re.MULTILINE)
SCALARS = {"float": np.float32, "uint": np.uint32, "int": np.int32, "ulong": np.uint64}
_FIELDS = ("float", "uint", "int")  # types of struct fields: all of 4 bytes, so that no compiler adds padding


def expanded(text: str, seen: set[str] | None = None) -> str:
    """Return OpenCL C text with each #include replaced by the header of kernels/, once each. seen: headers already included."""
    seen = set() if seen is None else seen

    def header(match: re.Match) -> str:
        if match[1] in seen:
            return ""
        seen.add(match[1])
        return expanded((KERNELS / match[1]).read_text(encoding="utf-8"), seen)

    return _INCLUDE.sub(header, text)


@functools.cache
def kernel_source(file: str) -> str:
    """Return the text of kernels/<file> with its headers included."""
    return expanded((KERNELS / file).read_text(encoding="utf-8"))


@functools.cache
def _words(file: str) -> frozenset[str]:
    """Return the words of kernels/<file> and its headers, comments left out."""
    return frozenset(re.findall(r"[A-Za-z_]\w*", re.sub(r"//.*", "", kernel_source(file))))


def read_macros(file: str, defines: Mapping[str, object]) -> dict[str, object]:
    """Return those of the macros that kernels/<file> reads: others need no build of their own."""
    words = _words(file)
    return {macro: value for macro, value in defines.items() if macro in words}


def declared_arguments(source: str, name: str) -> dict[str, str | np.dtype]:
    """Return the types of a kernel's arguments by name, read from its source: drivers lose them in cached builds."""
    found = re.search(rf"kernel void {name}\(([^)]*)\)", re.sub(r"//.*", "", source))
    if not found:
        raise ValueError(f"kernel {name} is not declared")
    parts = [re.findall(r"\w+|\*", argument) for argument in found[1].split(",")]
    return {
        part[-1]: "*" if "*" in part else declared_struct(source, part[-2]) if "struct" in part else part[-2] for part in parts
    }


def declared_struct(source: str, name: str) -> np.dtype:
    """Return the dtype of `struct name`, read from OpenCL C source; fields are float, uint and int, or arrays of them.

    Raises ValueError for other types, for which a compiler might add padding, and for an undeclared struct.
    """
    found = re.search(rf"\bstruct {name} \{{([^}}]*)\}};", re.sub(r"//.*", "", source))
    if not found:
        raise ValueError(f"struct {name} is not declared")
    fields: list[tuple] = []
    for line in filter(None, map(str.strip, found[1].split(";"))):
        kind, _, names = line.partition(" ")
        declared = [re.fullmatch(r"(\w+)(?:\[(\d+)\])?", name.strip()) for name in names.split(",")]
        if kind not in _FIELDS or not all(declared):
            raise ValueError(f"struct {name}: '{line}' is not a field of {', '.join(_FIELDS)}")
        fields += [(field[1], SCALARS[kind], int(field[2]) if field[2] else ()) for field in declared if field]
    return np.dtype(fields)


def packed_struct(dtype: np.dtype, value: Mapping[str, Any] | np.void, what: str) -> np.void:
    """Convert a mapping from field to value, or a structured scalar with the same fields, to a structured scalar of this dtype.

    what: description of the struct in the TypeError that is raised for a missing or superfluous field.
    """
    declared = dtype.names or ()
    names = value.keys() if isinstance(value, Mapping) else getattr(getattr(value, "dtype", None), "names", None)
    if names is None or set(names) != set(declared):
        raise TypeError(f"{what} has the fields {sorted(declared)}, not {sorted(names) if names else value!r}")
    return np.void(tuple(value[name] for name in declared), dtype)
