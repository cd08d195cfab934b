"""What a report reads of a study: the table of its points, and what is said of each column."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TypeGuard

from simulator.measurement.quantities import Curve
from simulator.measurement.report.plot import axis_label

DONE = "done"
# Words that end the name of a figure and say its unit, which titles have apart.
UNIT_WORDS = {"DN": "dn", "e-": "e", "EV": "ev", "px": "px", "deg": "deg", "cycles/mm": "cy mm", "lw/ph": "lw ph"}
CAPITALS = {"iso": "ISO", "snr": "SNR", "mtf": "MTF", "mtf50": "MTF50", "pdr": "PDR", "ev": "EV"}
Row = Mapping[str, Any]


class StudyTable(Protocol):
    """A study as `simulator.studies.load` returns it."""

    @property
    def columns(self) -> Mapping[str, Mapping[str, Any]]:
        """Of each column its kind (point, axis, resolved, measured, run), unit, title and quantity."""
        ...

    @property
    def rows(self) -> Sequence[Row]:
        """A mapping of column to value for each point."""
        ...

    def curve(self, name: str, label: str) -> Curve:
        """Return a curve of a point. label: LABEL.CURVE."""
        ...


@dataclass(frozen=True, eq=False)
class StudyFolder:
    """A study and its folder.

    name, description: of the study. curves: names of its curves, LABEL.CURVE. text: the study file. provenance: versions,
    device and times, plain data.
    """

    table: StudyTable
    folder: Path
    name: str
    description: str
    curves: Sequence[str]
    text: str
    provenance: Mapping[str, Any]

    def columns_of(self, kind: str) -> list[str]:
        """Return the columns of a kind, in the order of the table."""
        return [name for name, about in self.table.columns.items() if about.get("kind") == kind]

    def done(self) -> list[Row]:
        """Return the points that are done."""
        return self._done

    @cached_property
    def _done(self) -> list[Row]:
        return [row for row in self.table.rows if row["state"] == DONE]

    def title(self, column: str) -> str:
        """Return what a column is, in words, without its unit."""
        title, suffix = str(self.table.columns[column].get("title") or column), UNIT_WORDS.get(self.unit(column), "")
        words = title.removesuffix(f" {suffix}").split(" ")
        return " ".join(CAPITALS.get(word, word) for word in words)

    def full_title(self, column: str) -> str:
        """Return the title, with the unit where another measured figure has the same title in another unit."""
        title = self.title(column)
        others = [name for name in self.columns_of("measured") if name != column and self.title(name) == title]
        return axis_label(title, self.unit(column)) if others else title

    def unit(self, column: str) -> str:
        """Return the unit of a column, "" of a ratio."""
        return str(self.table.columns[column].get("unit") or "")

    def head(self, column: str) -> str:
        """Return title and unit of a column."""
        return axis_label(self.title(column), self.unit(column))

    def varied(self) -> list[str]:
        """Return the axes that have two values or more."""
        return self._varied

    @cached_property
    def _varied(self) -> list[str]:
        return [key for key in self.columns_of("axis") if len({_plain(row[key]) for row in self.table.rows}) > 1]

    def is_number_column(self, column: str) -> bool:
        """Whether all values of the done points in a column are numbers, and one at least is finite."""
        values = [row[column] for row in self.done() if row.get(column) not in (None, "")]
        return bool(values) and all(is_number(value) for value in values) and any(math.isfinite(value) for value in values)


def is_number(value: object) -> TypeGuard[float]:
    """Whether a value of the table is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _plain(value: object) -> object:
    return value if isinstance(value, int | float | str | bool | None) else str(value)


def format_value(value: object) -> str:
    """Return a value of the table as text: five digits of a number, a whole number as it is, nothing for None."""
    if value is None:
        return ""
    if not is_number(value):
        return str(value)
    if isinstance(value, int):
        return str(value)
    return f"{value:.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.5g}"


def describe_axes(study: StudyFolder, row: Row, keys: Sequence[str]) -> str:
    """Return the values of these axes at a point, such as `exposure.iso 400, lens.f_number 2.8`."""
    units = {key: study.unit(key) for key in keys}
    return ", ".join(f"{study.title(key)} {format_value(row[key])} {units[key]}".rstrip() for key in keys)
