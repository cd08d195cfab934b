"""A plan explained: its tables, totals and notes, and their HTML, for the page of `explain` and for notebooks."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape

from simulator.measurement.report.html import bullet_list, table
from simulator.measurement.report.plot import axis_label
from simulator.pipeline.explain.plan_tables import (
    ExplainedTable,
    Value,
    error_table,
    pass_table,
    plan_totals,
    step_table,
)
from simulator.pipeline.light_reuse import describe_reuse
from simulator.pipeline.planner import Plan


@dataclass(frozen=True)
class Explanation:
    """name: of the shot. tables: its sections in order. totals: numbers of the whole plan, by name with unit."""

    name: str
    tables: tuple[ExplainedTable, ...]
    totals: dict[str, Value]
    reuse: str
    notes: tuple[str, ...]
    warnings: tuple[str, ...]


def explain_plan(
    planned: Plan,
    name: str = "",
    times_ms: dict[str, float] | None = None,
    more: Sequence[ExplainedTable] = (),
    warnings: Sequence[str] = (),
) -> Explanation:
    """Return what a plan does and skips, with predicted error and time.

    times_ms: measured time of each pass [ms]. more: tables behind those of the plan. warnings: about the shot.
    """
    times = times_ms or {}
    tables = (step_table(planned), pass_table(planned, times), error_table(planned), *more)
    notes = tuple(planned.notes)
    return Explanation(
        name, tables, plan_totals(planned, times), describe_reuse(planned), notes, (*warnings, *planned.warnings())
    )


def explanation_body(told: Explanation, heading: str = "h2", is_folded: bool = False) -> str:
    """Return HTML with a table for each section, and lists of totals, notes and warnings.

    heading: element of the titles. is_folded: what is skipped opens when it is clicked.
    """
    body = "".join(_folded(one, heading) if is_folded else section(one, heading) for one in told.tables)
    totals = [f"{name}: {read(value)}" for name, value in told.totals.items()]
    body += f"<{heading}>Together</{heading}>\n{bullet_list([*totals, f'reuse: {told.reuse}'])}\n"
    lines = [f"note: {note}" for note in told.notes] + [f"warning: {warning}" for warning in told.warnings]
    return body + (bullet_list(lines) if lines else "")


def section(one: ExplainedTable, heading: str = "h2") -> str:
    """Return the title of a table and the table itself, for people: without the columns that repeat a value in parts."""
    return f"<{heading}>{escape(one.title)}</{heading}>\n{_table(one)}\n"


def _folded(one: ExplainedTable, heading: str) -> str:
    """Return a section whose lines are kept or skipped as two tables without that column, the second folded."""
    names = [column.name for column in one.columns]
    if "kept" not in names:
        return section(one, heading)
    place = names.index("kept")

    def part(is_kept: bool) -> ExplainedTable:
        rows = tuple((*row[:place], *row[place + 1 :]) for row in one.rows if row[place] is is_kept)
        return replace(one, columns=(*one.columns[:place], *one.columns[place + 1 :]), rows=rows)

    skipped = part(False)
    if not skipped.rows:
        return section(part(True), heading)
    why = replace(skipped, columns=skipped.columns[:2], rows=tuple(row[:2] for row in skipped.rows))
    return (
        f"{section(part(True), heading)}<details><summary>{len(why.rows)} skipped, and why</summary>{_table(why)}</details>\n"
    )


def _table(one: ExplainedTable) -> str:
    columns, rows = _shown(one)
    return table(columns, [[read(value) for value in row] for row in rows], *_number_span(rows))


def heads(one: ExplainedTable) -> list[str]:
    """Return the heads of a table: name and unit."""
    return [axis_label(column.name, column.unit) for column in one.columns]


def read(value: Value) -> str:
    """Return a value for people: five digits."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.5g}" if isinstance(value, float) else "" if value is None else str(value)


def _shown(one: ExplainedTable) -> tuple[list[str], list[tuple[Value, ...]]]:
    """Return heads and rows without number and unit, which repeat the value."""
    kept = [place for place, column in enumerate(one.columns) if column.name not in ("number", "unit")]
    return [heads(one)[place] for place in kept], [tuple(row[place] for place in kept) for row in one.rows]


def _number_span(rows: Sequence[tuple[Value, ...]]) -> tuple[int, int]:
    """Return the first and last column of numbers; columns of text between them are none of these tables'."""
    places = [
        place
        for place in range(len(rows[0]) if rows else 0)
        if any(isinstance(row[place], int | float) and not isinstance(row[place], bool) for row in rows)
    ]
    return (places[0], places[-1]) if places else (1, 0)
