"""The report of a study as one self-contained HTML page: no script, no font and no picture from elsewhere."""

import math
import re
from collections.abc import Mapping, Sequence
from html import escape

import numpy as np

from simulator.measurement.report.figures import plot_svg
from simulator.measurement.report.html import page, scrolled
from simulator.measurement.report.plot import Plot, axis_label
from simulator.studies.report.pictures import preview_data
from simulator.studies.report.study_data import Row, StudyFolder, describe_axes, format_value, is_number
from simulator.studies.report.study_plots import study_plots
from simulator.studies.report.worst_points import WorstPoint, worst_points

MOST_PICTURES = 60  # of the contact sheet
MOST_ROWS = 2000  # of the table of all points

_STYLE = """
nav a { margin-right: 1em; white-space: nowrap; } a { color: #1d4f91; }
pre { background: #f5f5f5; padding: 0.8em; overflow-x: auto; font-size: 0.85em; }
#points td:first-child { white-space: nowrap; } div.at { min-width: 10em; }
td pre { white-space: pre-wrap; overflow-wrap: anywhere; min-width: 14em; margin: 0.3em 0; font-weight: normal; color: #222; }
div.sheet { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(150px, 45%), 1fr)); gap: 0.8em; }
div.sheet figure { border: 1px solid #ddd; padding: 4px; } div.sheet img { width: 100%; height: auto; display: block; }
div.sheet figcaption { font-size: 0.78em; line-height: 1.3; padding-top: 3px; }
div.sheet .none { background: #eee; padding: 2em 0.3em; }
:target { outline: 3px solid #c4500a; outline-offset: 2px; } p.note, figcaption.note { color: #555; font-size: 0.9em; }
details { margin: 0.3em 0 0.8em; } summary { cursor: pointer; }
@media print { @page { size: A4; margin: 14mm; } body { max-width: none; margin: 0; font-size: 10pt; }
  figure, tr { break-inside: avoid; } h2, h3 { break-after: avoid; } nav, figure details { display: none; }
  div.figures { grid-template-columns: 1fr 1fr; gap: 1em; } div.sheet { grid-template-columns: repeat(5, 1fr); }
  div.scroll { overflow: visible; } table { font-size: 8pt; }
  td, th { padding: 0.1em 0.35em; } pre { white-space: pre-wrap; } }
"""


def report_page(study: StudyFolder, is_for_print: bool = False) -> str:
    """Return the page. is_for_print: with the table of all points unfolded.

    Raises PhotositeError when matplotlib is missing or a file of the study is damaged.
    """
    plots, worst = study_plots(study), worst_points(study)
    shown = shown_rows(study, worst)
    parts = {
        "summary": ("Summary", _summary(study)),
        "plots": ("Plots", _plots(plots)),
        "worst": ("Worst points", _worst(study, worst, shown)),
        "pictures": ("Contact sheet", _sheet(study, shown)),
        "points": ("All points", _points(study, is_for_print)),
        "provenance": ("Provenance", _provenance(study)),
    }
    links = "".join(f"<a href='#{name}'>{title}</a>" for name, (title, body) in parts.items() if body)
    body = f"<nav>{links}</nav>\n" + "".join(
        f"<section id='{name}'><h2>{title}</h2>\n{text}</section>\n" for name, (title, text) in parts.items() if text
    )
    return page(f"Study {study.name}", body, _STYLE)


def anchor(name: object) -> str:
    """Return the name of a point's place in the page; letters that may not stand in one are replaced."""
    return "point-" + re.sub(r"[^A-Za-z0-9_.=+-]", lambda found: f"_{ord(found[0]):x}", str(name))


def number(value: object) -> str:
    """Return a value as HTML: a number with five digits to read, and all of them for programs."""
    if not is_number(value):
        return escape(format_value(value))
    return f"<data value='{value!r}'>{format_value(value)}</data>"


class Html(str):
    """Text that is HTML already; other text is escaped."""


def _table(head: Sequence[str], rows: Sequence[tuple[str, Sequence[object]]]) -> str:
    """Return a table. rows: attributes of each row, as HTML, and its values."""

    def cell(value: object) -> str:
        if isinstance(value, str):
            return f"<td>{value if isinstance(value, Html) else escape(value)}</td>"
        return f"<td class='number'>{number(value)}</td>"

    lines = ["<tr>" + "".join(f"<th>{escape(name)}</th>" for name in head) + "</tr>"]
    lines += [f"<tr{about}>" + "".join(map(cell, values)) + "</tr>" for about, values in rows]
    return scrolled("<table>\n" + "\n".join(lines) + "\n</table>")


def _summary(study: StudyFolder) -> str:
    rows = study.table.rows
    states = {state: sum(row["state"] == state for row in rows) for state in dict.fromkeys(str(row["state"]) for row in rows)}
    told = ", ".join(f"{count} {state}" for state, count in states.items())
    text = f"<p>{escape(study.description)}</p>\n" if study.description else ""
    text += f"<p>{len(rows)} points: {escape(told)}.</p>\n"
    axes = []
    for key in study.columns_of("axis"):
        values = list(dict.fromkeys(format_value(row[key]) for row in rows))
        listed = ", ".join(values) if len(values) <= 12 else f"{', '.join(values[:5])}, … , {', '.join(values[-2:])}"
        axes.append(("", (key, study.unit(key), len(values), listed)))
    if axes:
        text += f"<h3>What varies</h3>\n{_table(('axis', 'unit', 'values', ''), axes)}\n"
    measured = []
    for column in study.columns_of("measured"):
        found = [float(row[column]) for row in study.done() if is_number(row.get(column)) and math.isfinite(row[column])]
        if found:
            measured.append(
                ("", (study.title(column), study.unit(column), min(found), float(np.median(found)), max(found), len(found)))
            )
    if measured:
        head = ("figure", "unit", "least", "median", "greatest", "points")
        text += f"<h3>What was measured</h3>\n{_table(head, measured)}\n"
    return text


def _plots(plots: Sequence[Plot]) -> str:
    drawn = []
    for plot in plots:
        head, rows = _plot_rows(plot)
        note = f" <span class='note'>{escape(plot.note)}</span>" if plot.note else ""
        numbers = ""
        if len(rows) <= MOST_ROWS and not plot.name.startswith("curve_"):
            numbers = f"<details><summary>{len(rows)} points</summary>{_table(head, rows)}</details>"
        svg = plot_svg(plot).replace("<svg ", f"<svg role='img' aria-label='{escape(plot.title, quote=True)}' ", 1)
        title = plot.title[:1].upper() + plot.title[1:]
        caption = f"<figcaption><b>{escape(title)}.</b>{note}</figcaption>"
        drawn.append(f"<figure id='plot-{escape(plot.name)}'>{caption}{svg}{numbers}</figure>\n")
    return f"<div class='figures'>\n{''.join(drawn)}</div>\n" if drawn else ""


def _plot_rows(plot: Plot) -> tuple[tuple[str, ...], list[tuple[str, Sequence[object]]]]:
    first = plot.lines[0].curve
    head = ("line", axis_label(first.x_name, first.x_unit), axis_label(first.y_name, first.y_unit))
    rows: list[tuple[str, Sequence[object]]] = []
    for line in plot.lines:
        rows += [("", (line.label, x, y)) for x, y in zip(line.curve.x.tolist(), line.curve.y.tolist(), strict=True)]
    return head, rows


def shown_rows(study: StudyFolder, worst: Sequence[WorstPoint], most: int = MOST_PICTURES) -> list[Row]:
    """Return the points of the contact sheet: all that are done; of more than `most` that many in even steps, and the worst."""
    rows = study.done()
    if len(rows) <= most:
        return rows
    named = {str(one.row["name"]) for one in worst}
    even = {str(rows[place]["name"]) for place in np.linspace(0, len(rows) - 1, most).round().astype(int)}
    return [row for row in rows if str(row["name"]) in named | even]


def _sheet(study: StudyFolder, shown: Sequence[Row]) -> str:
    keys, tiles, has_picture = study.varied(), [], False
    for row in shown:
        found = preview_data(study.folder, str(row["name"]))
        if found is None:
            picture = "<div class='none'>no preview</div>"
        else:
            address, width, height = found
            told = escape(f"preview of {row['name']}", quote=True)
            picture = f"<img src='{address}' width='{width}' height='{height}' alt='{told}'>"
            has_picture = True
        caption = escape(describe_axes(study, row, keys) or str(row["name"]))
        tiles.append(f"<figure id='picture-{anchor(row['name'])}'>{picture}<figcaption>{caption}</figcaption></figure>\n")
    if not has_picture:
        return ""
    left = len(study.done()) - len(shown)
    note = f"<p class='note'>{left} more points are left out, evenly.</p>" if left else ""
    return f"{note}<div class='sheet'>\n{''.join(tiles)}</div>\n"


def _worst(study: StudyFolder, worst: Sequence[WorstPoint], shown: Sequence[Row]) -> str:
    if not worst:
        return ""
    keys, places = study.varied(), {str(row["name"]) for row in shown}
    listed = {str(row["name"]) for row in study.table.rows[:MOST_ROWS]}
    rows = []
    for one in worst:
        name = str(one.row["name"])
        link = f"<a href='#{anchor(name)}'>{escape(name)}</a>" if name in listed else escape(name)
        if name in places and preview_data(study.folder, name) is not None:
            link += f" <a href='#picture-{anchor(name)}'>picture</a>"
        value: object = "" if one.column is None else one.row[one.column]
        unit = "" if one.column is None else study.unit(one.column)
        command = one.row.get("command") if one.column is None else None
        told = Html(escape(one.reason) + (f"<pre>{escape(str(command))}</pre>" if command else ""))
        about = " class='failed'" if one.column is None else ""
        place = Html(f"<div class='at'>{escape(describe_axes(study, one.row, keys))}</div>")
        rows.append((about, (told, value, unit, Html(link), place)))
    return _table(("why", "value", "unit", "point", "at"), rows)


def _points(study: StudyFolder, is_open: bool) -> str:
    kinds = ("axis", "measured", "run")
    columns = ["name", "state", *(name for kind in kinds for name in study.columns_of(kind) if name not in ("name", "state"))]
    extra = [name for name in ("seconds", "predicted_error_sigma", "predicted_seconds") if name in study.table.columns]
    columns += [name for name in extra if name not in columns]
    rows: list[tuple[str, Sequence[object]]] = []
    for row in study.table.rows[:MOST_ROWS]:
        about = f" id='{anchor(row['name'])}'" + ("" if row["state"] == "done" else " class='failed'")
        rows.append((about, ["" if row.get(name) is None else row[name] for name in columns]))
    left = len(study.table.rows) - len(rows)
    note = f"<p class='note'>The first {len(rows)} points; points.csv has {left} more.</p>" if left else ""
    fold = " open" if is_open or len(rows) <= 40 else ""
    head = [column if column in ("name", "state") else study.head(column) for column in columns]
    return f"{note}<details{fold}><summary>{len(rows)} points</summary>{_table(head, rows)}</details>"


def _provenance(study: StudyFolder) -> str:
    rows: list[tuple[str, Sequence[object]]] = [("", (key, value)) for key, value in _flat(study.provenance)]
    table = f"{_table(('what', 'value'), rows)}\n" if rows else ""
    written, mark, resolved = study.text.partition("\nresolved:\n")
    text = f"<h3>Study file</h3>\n<pre>{escape(written)}</pre>" if written else ""
    if mark:
        text += f"<details><summary>The shot in full, as it was resolved</summary><pre>{escape(resolved)}</pre></details>"
    return table + text


def _flat(data: Mapping[str, object], before: str = "") -> list[tuple[str, object]]:
    """Return nested plain data as dotted keys and values; lists as text."""
    found: list[tuple[str, object]] = []
    for key, value in data.items():
        if isinstance(value, Mapping):
            found += _flat(value, f"{before}{key}.")
        elif isinstance(value, list) and any(isinstance(one, Mapping) for one in value):
            found += _flat({str(place): one for place, one in enumerate(value)}, f"{before}{key}.")
        elif is_number(value):
            found.append((f"{before}{key}", value))
        else:
            listed = ", ".join(map(str, value)) if isinstance(value, list | tuple) else "" if value is None else str(value)
            found.append((f"{before}{key}", listed))
    return found
