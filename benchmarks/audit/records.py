"""The file of an audit: a line of JSON for each shot, of those that were taken and of those that failed."""

import json
from dataclasses import fields
from pathlib import Path

from audit.measured_shot import Record


def read_records(path: Path) -> tuple[list[Record], dict[int, str], dict[int, str]]:
    """Return the records of a file, and the messages of shots that failed, and of those without truth, by number.

    None of a file that is missing.
    """
    if not path.exists():
        return [], {}, {}
    names = {one.name for one in fields(Record)}
    found, failed, refused = [], {}, {}
    for line in path.read_text(encoding="utf-8").splitlines():
        data = json.loads(line)
        if "error" in data:
            failed[data["number"]] = data["error"]
            continue
        if "refused" in data:
            refused[data["number"]] = data["refused"]
            continue
        lists = {name: tuple(data[name]) for name in ("kinds", "warnings")}
        found.append(Record(**{name: value for name, value in data.items() if name in names} | lists))
    return found, failed, refused


def read_numbers(path: Path) -> set[int]:
    """Return the numbers of the shots that have a line in a file; none of a file that is missing."""
    lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return {json.loads(line)["number"] for line in lines}


def append(path: Path, data: dict) -> None:
    """Add a line."""
    with path.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(data) + "\n")
