"""What `photosite explain` tells, as JSON, CSV and HTML."""

import csv
import io
import re
from collections.abc import Sequence

from simulator.command_line.shot_numbers import Fact
from simulator.displays.explanation import Explanation, explanation_body, heads
from simulator.measurement.report.html import page
from simulator.pipeline.explain.plan_tables import Column, ExplainedTable, Value
from simulator.raw.canonical_json import json_text

FORMATS = ("table", "json", "csv", "html")
NUMBER = re.compile(r"([-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?: ([^\s\d][^\s,]*(?: s)?))?")  # lx s is a unit, too


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
    sections = {one.name: [dict(zip(heads(one), row, strict=True)) for row in one.rows] for one in told.tables}
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
    return page(f"Shot {told.name}", explanation_body(told))


def _cell(value: Value) -> str:
    """A value for programs: every digit."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(float(value)) if isinstance(value, float) else str(value)
