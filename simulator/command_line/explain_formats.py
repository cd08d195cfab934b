"""What `photosite explain` tells, as JSON, CSV and HTML."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from simulator.command_line.shot_numbers import Fact
from simulator.measurement.report.html import bullet_list, page, table
from simulator.measurement.report.plot import axis_label
from simulator.pipeline.explain.plan_tables import Column, ExplainedTable, Value
from simulator.raw.canonical_json import json_text

FORMATS = ("table", "json", "csv", "html")
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?: ([^\s\d][^\s,]*(?: s)?))?")  # lx s is a unit, too


@dataclass(frozen=True)
class Explanation:
    """name: of the shot. tables: its sections in order. totals: numbers of the whole plan, by name with unit."""

    name: str
    tables: tuple[ExplainedTable, ...]
    totals: dict[str, Value]
    reuse: str
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def fact_table(name: str, title: str, facts: Sequence[Fact]) -> ExplainedTable:
    """Return quantities with their values as text and formulas, and the number and unit of a value that is one number."""
    columns = (Column("quantity"), Column("value"), Column("number"), Column("unit"), Column("formula"))
    rows = tuple((fact.quantity, fact.value, *split_value(fact.value), fact.formula) for fact in facts)
    return ExplainedTable(name, title, columns, rows)


def split_value(text: str) -> tuple[float | None, str | None]:
    """Return number and unit of a text such as `51.28 mm`; None, None of a text that is more, or no number."""
    found = NUMBER.fullmatch(text)
    return (None, None) if found is None else (float(found[1]), found[2] or "")


def explanation_json(told: Explanation) -> str:
    """Return one object: name, sections as lists of objects, totals, notes and warnings. Keys have units: `sigma [DN]`."""
    sections = {one.name: [dict(zip(_heads(one), row, strict=True)) for row in one.rows] for one in told.tables}
    rest = {"reuse": told.reuse, "notes": list(told.notes), "warnings": list(told.warnings)}
    return json_text(told.name, {"name": told.name, "totals": told.totals, **sections, **rest}, indent=1, ensure_ascii=False)


def explanation_csv(told: Explanation) -> str:
    """Return a line for each value: section, row from 0, column, unit, value; nothing for a value that is not there."""
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("section", "row", "column", "unit", "value"))
    for one in told.tables:
        for place, values in enumerate(one.rows):
            for column, value in zip(one.columns, values, strict=True):
                rows.writerow((one.name, place, column.name, column.unit, _cell(value)))
    rows.writerows(("totals", 0, name, "", _cell(value)) for name, value in told.totals.items())
    for name, lines in (("reuse", [told.reuse]), ("notes", told.notes), ("warnings", told.warnings)):
        rows.writerows((name, place, "text", "", line) for place, line in enumerate(lines))
    return text.getvalue()


def explanation_html(told: Explanation) -> str:
    """Return a self-contained page with a table for each section."""
    body = ""
    for one in told.tables:
        columns, rows = _shown(one)
        lines = [[_read(value) for value in row] for row in rows]
        body += f"<h2>{escape(one.title)}</h2>\n{table(columns, lines, *_number_span(rows))}\n"
    totals = [f"{name}: {_read(value)}" for name, value in told.totals.items()]
    body += f"<h2>Together</h2>\n{bullet_list([*totals, f'reuse: {told.reuse}'])}\n"
    lines_of = [f"note: {note}" for note in told.notes] + [f"warning: {warning}" for warning in told.warnings]
    return page(f"Shot {told.name}", body + (bullet_list(lines_of) if lines_of else ""))


def _shown(one: ExplainedTable) -> tuple[list[str], list[tuple[Value, ...]]]:
    """Return heads and rows for people: without the columns that repeat a value as number and unit."""
    kept = [place for place, column in enumerate(one.columns) if column.name not in ("number", "unit")]
    return [_heads(one)[place] for place in kept], [tuple(row[place] for place in kept) for row in one.rows]


def _number_span(rows: Sequence[tuple[Value, ...]]) -> tuple[int, int]:
    """Return the first and last column of numbers; columns of text between them are none of these tables'."""
    places = [
        place
        for place in range(len(rows[0]) if rows else 0)
        if any(isinstance(row[place], int | float) and not isinstance(row[place], bool) for row in rows)
    ]
    return (places[0], places[-1]) if places else (1, 0)


def _heads(one: ExplainedTable) -> list[str]:
    return [axis_label(column.name, column.unit) for column in one.columns]


def _read(value: Value) -> str:
    """A value for people: five digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else _cell(value)


def _cell(value: Value) -> str:
    """A value for programs: every digit."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(float(value)) if isinstance(value, float) else str(value)
