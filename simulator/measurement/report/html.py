"""One self-contained HTML page: its frame, tables of numbers, and the table of tolerance checks."""

import math
import os
from collections.abc import Sequence
from html import escape

from simulator.atomic_files import atomic_write
from simulator.measurement.report.tolerance_check import ToleranceCheck

_STYLE = """
:root { color-scheme: light; }
body { font: 15px/1.45 system-ui, sans-serif; color: #222; background: #fff; max-width: 1100px; margin: 2em auto;
  padding: 0 1em; overflow-wrap: break-word; }
h1 { font-size: 1.5em; line-height: 1.2; } h2 { font-size: 1.15em; margin-top: 2em; }
h3 { font-size: 1em; margin: 1.5em 0 0.3em; }
table { border-collapse: collapse; margin: 0.5em 0; } td, th { padding: 0.15em 0.8em; border-bottom: 1px solid #ddd; }
th { text-align: left; font-weight: 600; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
th, td { vertical-align: top; } td.number { white-space: nowrap; }
tr.failed td { color: #b03020; font-weight: 600; } tr.ungated td { color: #6b6b6b; }
div.scroll { overflow-x: auto; max-width: 100%; }
div.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(480px, 100%), 1fr)); gap: 1.5em; }
@media (max-width: 600px) { body { margin-top: 1em; } td, th { padding: 0.15em 0.45em; } td:first-child { padding-left: 0; } }
figure { margin: 0; min-width: 0; } figure svg { width: 100%; height: auto; } figcaption { font-size: 0.9em; }
"""


def write_page(text: str, path: str | os.PathLike) -> None:
    """Write a page. Raises PhotositeError when the path cannot be written."""
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def page(title: str, body: str, style: str = "") -> str:
    """Return a page of this title and body. title: plain text. body: HTML. style: CSS beside that of all pages."""
    title = escape(title)
    view = "<meta name='viewport' content='width=device-width, initial-scale=1'>"
    head = f"<meta charset='utf-8'>{view}<title>{title}</title><style>{_STYLE}{style}</style>"
    return f"<!doctype html>\n<html lang='en'><head>{head}</head><body>\n<h1>{title}</h1>\n{body}\n</body></html>\n"


def figures_block(figures: Sequence[tuple[str, str]]) -> str:
    """Return figures beside each other. figures: SVG elements and their captions, plain text."""
    drawn = "".join(f"<figure>{svg}<figcaption>{escape(title)}</figcaption></figure>\n" for svg, title in figures)
    return f"<div class='figures'>\n{drawn}</div>\n"


def verdict(checks: Sequence[ToleranceCheck], frames: int) -> str:
    """Return a paragraph on how many checks passed. frames: number of raw files that were measured."""
    asked, failed = (
        [check for check in checks if not check.reason_unchecked],
        [check for check in checks if not check.passed],
    )
    text = f"All {len(asked)} gates passed." if not failed else f"{len(failed)} of {len(asked)} gates failed."
    return f"<p>Measured from {frames} raw files, from the codes alone. {text}</p>"


def checks_table(checks: Sequence[ToleranceCheck], where: str) -> str:
    """Return a table with a line for each check. where: head of the column that says where it was measured."""
    rows, styles = [], []
    for check in checks:
        plain = check.as_dict()
        scale, unit = (100.0, " %") if check.relative else (1.0, "")
        deviation = f"{scale * check.deviation:+.3g}{unit}" if math.isfinite(check.deviation) else ""
        allowed = "" if check.reason_unchecked else f"{scale * check.tolerance:.3g}{unit}"
        result = f"not gated: {check.reason_unchecked}" if check.reason_unchecked else str(plain["verdict"])
        numbers = [f"{check.measured:.5g}", f"{check.expected:.5g}", deviation, allowed, f"{scale * check.error:.2g}{unit}"]
        rows.append([check.quantity, check.where, check.unit, *numbers, result])
        styles.append("ungated" if check.reason_unchecked else "" if check.passed else "failed")
    head = ["quantity", where, "unit", "measured", "expected", "deviation", "allowed", "standard error", "verdict"]
    return table(head, rows, first_number=3, last_number=7, styles=styles)


def bullet_list(lines: Sequence[str]) -> str:
    """Return a list of lines, plain text."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    first_number: int,
    last_number: int | None = None,
    styles: Sequence[str] | None = None,
) -> str:
    """Return a table of plain texts; the columns from first_number to last_number (the last) are numbers.

    styles: of the rows: failed, ungated, or none.
    """
    last = len(head) if last_number is None else last_number + 1

    def cell(index: int, text: str) -> str:
        kind = " class='number'" if first_number <= index < last else ""
        return f"<td{kind}>{escape(text)}</td>"

    lines = ["<tr>" + "".join(f"<th>{escape(text)}</th>" for text in head) + "</tr>"]
    for row, style in zip(rows, styles or [""] * len(rows), strict=True):
        lines.append(f"<tr class='{style}'>" + "".join(cell(index, text) for index, text in enumerate(row)) + "</tr>")
    return scrolled("<table>\n" + "\n".join(lines) + "\n</table>")


def scrolled(table: str) -> str:
    """Return a table that scrolls by itself where the page is narrower."""
    return f"<div class='scroll' tabindex='0'>{table}</div>"
