"""What a checkout made, as plain data that can be compared, and the comparison.

Left out of the comparison, and nothing else:
- versions: workers give Photosite the version of VERSION before it is imported, so that every file holds the same one;
- the time that each point of a sweep took, in the column `seconds` of manifest.csv, and the times of progress bars;
- addresses in memory in messages, which become ADDRESS_MASK;
- the checkout's own path, which becomes CHECKOUT wherever text holds it;
- `plan` of a sidecar, which is text for people: what differs there is counted, and no difference.
"""

import csv
import hashlib
import io
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

VERSION = "0.0.0"
CHECKOUT = "<checkout>"
ADDRESS_MASK = "<address>"
SIDECAR_KEYS = {"shot", "plan", "versions"}  # a JSON file that has them all is a sidecar
ADDRESS = re.compile(r"\b0x[0-9a-f]{6,}\b")  # of an object in memory, in a driver's message
ELAPSED = re.compile(r"\b\d+:\d\d:\d\d\b")  # of a progress bar


def array_digest(array: np.ndarray) -> str:
    """SHA-256 of an array's type, shape and bits."""
    head = f"{array.dtype.str} {array.shape} ".encode()
    return hashlib.sha256(head + np.ascontiguousarray(array).tobytes()).hexdigest()


def plain(value: object) -> Any:
    """Return a value as JSON holds it: arrays by their digest, numbers by their exact value, dataclasses by their fields."""
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {list(value.shape)} {array_digest(value)}"
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, Enum):
        return plain(value.value)
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(inner) for inner in value]
    if isinstance(value, float):
        return value.hex()
    return value if value is None or isinstance(value, (bool, int, str)) else str(value)


def masked(value: Any, checkout: str) -> Any:
    """Return plain data with the checkout's path replaced in all texts."""
    if isinstance(value, str):
        return re.sub(re.escape(checkout) + r"(?![\w.-])", CHECKOUT, value)
    if isinstance(value, dict):
        return {key: masked(inner, checkout) for key, inner in value.items()}
    return [masked(inner, checkout) for inner in value] if isinstance(value, list) else value


def split_sidecar(document: Any) -> tuple[Any, Any]:
    """Return a JSON document without what is left out, and the plan for people, None where there is none."""
    if not (isinstance(document, dict) and document.keys() >= SIDECAR_KEYS):
        return document, None
    return {key: value for key, value in document.items() if key not in ("plan", "versions")}, document["plan"]


def without_seconds(text: str) -> list[list[str]]:
    """Return the rows of manifest.csv without the column `seconds`."""
    rows = list(csv.reader(io.StringIO(text)))
    left_out = {index for index, name in enumerate(rows[0] if rows else []) if name == "seconds"}
    return [[cell for index, cell in enumerate(row) if index not in left_out] for row in rows]


def printed(text: str, checkout: str) -> str:
    """Return a message or what a command printed, without elapsed times, addresses and the checkout's path."""
    return ADDRESS.sub(ADDRESS_MASK, ELAPSED.sub("<time>", masked(text, checkout)))


def file_record(path: Path, checkout: str) -> tuple[Any, Any]:
    """Return what a file holds, and its plan for people: JSON as data, manifest.csv as rows, others by SHA-256."""
    payload = path.read_bytes()
    if path.suffix == ".json":
        document, plan = split_sidecar(json.loads(payload))
        return masked(document, checkout), plan
    if path.name == "manifest.csv":
        return masked(without_seconds(payload.decode("utf-8")), checkout), None
    return hashlib.sha256(payload).hexdigest(), None


def folder_record(folder: Path, checkout: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the records of all files below a folder and the plans for people, both by relative path."""
    found, plans = {}, {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        name = path.relative_to(folder).as_posix()
        found[name], plan = file_record(path, checkout)
        if plan is not None:
            plans[name] = masked(plan, checkout)
    return found, plans


def differences(old: Any, new: Any, place: str = "") -> Iterator[str]:
    """Yield a line for each place at which two pieces of plain data differ; numbers of another type are another value."""
    if isinstance(old, dict) and isinstance(new, dict):
        for key in [*old, *(key for key in new if key not in old)]:
            inner = f"{place}.{key}" if place else str(key)
            if key not in new or key not in old:
                yield f"{inner}: only in {'OLD' if key in old else 'NEW'}"
            else:
                yield from differences(old[key], new[key], inner)
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        for index, (one, other) in enumerate(zip(old, new, strict=True)):
            yield from differences(one, other, f"{place}[{index}]")
    elif type(old) is not type(new) or old != new:
        yield f"{place}: {short(old)} | {short(new)}"


def short(value: Any) -> str:
    """Return a value as one line of 90 letters at most."""
    text = value if isinstance(value, str) else json.dumps(value, sort_keys=True)
    text = " ".join(text.split())
    return text if len(text) <= 90 else f"{text[:87]}..."


def has_failed(record: Mapping[str, Any]) -> bool:
    """Whether an item ended in an error, or any of its commands with a status other than 0."""
    told = [value for value in record["values"].values() if isinstance(value, dict)]
    return bool(record["error"]) or any(value.get("status", 0) != 0 for value in told)


def count_differences(old: Any, new: Any) -> int:
    """Return at how many places two pieces of plain data differ."""
    return sum(1 for _ in differences(old, new))
