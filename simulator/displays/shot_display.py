"""A shot: every key with its value and unit, and which of them hold because nothing else was said."""

import re
from collections.abc import Sequence
from html import escape
from typing import Any

from simulator.config.shot_values import ShotValue, shot_values
from simulator.exposure.stops import write_time
from simulator.measurement.report.html import table
from simulator.pipeline.shot import Shot

OPEN = ("", "scene", "lens", "exposure")  # sections that are shown; the others open when they are clicked
MOST_LETTERS = 90  # of a value
LONG_NUMBER = re.compile(r"(?<![\w.])\d+\.\d{6,}(?:e[-+]?\d+)?(?![\w.])")


def show_shot(shot: Shot) -> str:
    """Return a table for each section: key, value, and whether it is the default. A long value is cut."""
    sections: dict[str, list[ShotValue]] = {"": []}
    for one in shot_values(shot):
        name, dot, _ = one.path.partition(".")
        sections.setdefault(name if dot else "", []).append(one)
    return "\n".join(_section(shot, name, values) for name, values in sections.items())


def _section(shot: Shot, name: str, values: Sequence[ShotValue]) -> str:
    rows = [[one.path, _value(shot, one), "default" if one.is_default else ""] for one in values]
    body = table(["key", "value", ""], rows, first_number=3)
    if name in OPEN:
        return body
    told = f"{name}: {shot.camera.make} {shot.camera.model}" if name == "camera" else name
    return f"<details><summary>{escape(told)}, {len(rows)} values</summary>{body}</details>"


def _value(shot: Shot, one: ShotValue) -> str:
    """Return a value as text; an exposure time as dials show it."""
    return write_time(shot.exposure.time_s) if one.path == "exposure.time" else _text(one.value)


def _text(value: Any) -> str:
    """Return a value as text, a list or table that is long by its length."""
    if isinstance(value, dict):
        keys = [str(key) for key in value]
        return f"{len(keys)} lines, {keys[0]} to {keys[-1]}" if len(keys) > 1 else _text(next(iter(value.values()), ""))
    if isinstance(value, list):
        text = ", ".join(map(_text, value))
        return text if len(text) <= MOST_LETTERS else f"{len(value)} values, {_text(value[0])} to {_text(value[-1])}"
    if isinstance(value, bool):
        return "true" if value else "false"
    text = LONG_NUMBER.sub(lambda found: f"{float(found[0]):.6g}", str(value))
    return text if len(text) <= MOST_LETTERS else f"…{text[1 - MOST_LETTERS :]}"
