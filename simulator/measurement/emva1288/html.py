"""EMVA 1288 report as one self-contained HTML page."""

import math
import os
from collections.abc import Sequence
from html import escape

from simulator.atomic_files import atomic_write
from simulator.measurement.emva1288.figures import TITLES, emva_figures
from simulator.measurement.emva1288.frames import EXPOSURE_TIME_S, SHARES, STACK
from simulator.measurement.emva1288.report import EmvaReport
from simulator.measurement.noise_check.tolerance_check import ToleranceCheck
from simulator.raw.software import software

_STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1100px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; margin: 0.5em 0; } td, th { padding: 0.15em 0.8em; border-bottom: 1px solid #ddd; }
th { text-align: left; font-weight: 600; } td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.failed td { color: #c0392b; font-weight: 600; } tr.ungated td { color: #888; }
div.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(480px, 1fr)); gap: 1.5em; }
figure { margin: 0; } figure svg { width: 100%; height: auto; } figcaption { font-size: 0.9em; }
"""


def write_emva_html(report: EmvaReport, path: str | os.PathLike) -> None:
    """Write the report. Raises PhotositeError when matplotlib is missing or the path cannot be written."""
    text = emva_html(report)
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def emva_html(report: EmvaReport) -> str:
    """Return the page."""
    title = escape(f"EMVA 1288 of {report.camera} at ISO {report.iso}")
    figures = "".join(
        f"<figure>{svg}<figcaption>{escape(TITLES[name])}</figcaption></figure>\n"
        for name, svg in emva_figures(report.found).items()
    )
    body = (
        f"<h1>{title}</h1>\n{_verdict(report)}\n<h2>Summary</h2>\n{_summary(report)}\n{_speed(report)}"
        f"<h2>Curves</h2>\n<div class='figures'>\n{figures}</div>\n"
        f"<h2>Against the camera file</h2>\n{_checks_table(report.checks)}\n<h2>Conditions</h2>\n{_conditions(report)}"
    )
    head = f"<meta charset='utf-8'><title>{title}</title><style>{_STYLE}</style>"
    return f"<!doctype html>\n<html lang='en'><head>{head}</head><body>\n{body}\n</body></html>\n"


def _verdict(report: EmvaReport) -> str:
    asked, failed = (
        [check for check in report.checks if not check.reason_unchecked],
        [check for check in report.checks if not check.passed],
    )
    text = f"All {len(asked)} gates passed." if not failed else f"{len(failed)} of {len(asked)} gates failed."
    return f"<p>Measured from {report.frames} raw files, from the codes alone. {text}</p>"


def _summary(report: EmvaReport) -> str:
    names = list(report.found.planes)
    rows = [[quantity, unit, *(f"{values[name]:.5g}" for name in names)] for quantity, unit, values in report.summary()]
    return _table(["quantity", "unit", *names], rows, first_number=2)


def _speed(report: EmvaReport) -> str:
    found = report.found
    return (
        f"<p>ISO 12232 saturation-based speed S_sat = 78 / H_sat = {found.saturation_speed:.4g}, with "
        f"H_sat = {found.saturation_exposure_lx_s:.4g} lx s of daylight (D55); nominal ISO {report.iso}.</p>\n"
    )


def _checks_table(checks: tuple[ToleranceCheck, ...]) -> str:
    rows, styles = [], []
    for check in checks:
        plain = check.as_dict()
        scale, unit = (100.0, " %") if check.relative else (1.0, "")
        deviation = f"{scale * check.deviation:+.3g}{unit}" if math.isfinite(check.deviation) else ""
        allowed = "" if check.reason_unchecked else f"{scale * check.tolerance:.3g}{unit}"
        verdict = f"not gated: {check.reason_unchecked}" if check.reason_unchecked else str(plain["verdict"])
        numbers = [f"{check.measured:.5g}", f"{check.expected:.5g}", deviation, allowed, f"{scale * check.error:.2g}{unit}"]
        rows.append([check.quantity, check.where, check.unit, *numbers, verdict])
        styles.append("ungated" if check.reason_unchecked else "" if check.passed else "failed")
    head = ["quantity", "plane", "unit", "measured", "expected", "deviation", "allowed", "standard error", "verdict"]
    return _table(head, rows, first_number=3, last_number=7, styles=styles)


def _conditions(report: EmvaReport) -> str:
    lines = [
        "EMVA 1288 Release 4.0 Linear, each colour plane in light of the wavelength at which it sees most, a band of 5 nm, "
        "without a lens's fall-off; photons are counted on the whole area of a photosite.",
        f"{len(SHARES)} steps of light in pairs, exposure time {EXPOSURE_TIME_S:g} s throughout; "
        f"{STACK} frames in the dark and {STACK} at half saturation for DSNU and PRNU, no high-pass filter.",
        "K is fitted up to 70 % of saturation with points weighted by the inverse variance of their variance. "
        "Saturation is the step of the largest variance.",
        f"Window of {report.window[0]} x {report.window[1]} photosites. {software()}.",
    ]
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def _table(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    first_number: int,
    last_number: int | None = None,
    styles: Sequence[str] | None = None,
) -> str:
    last = len(head) if last_number is None else last_number + 1

    def cell(index: int, text: str) -> str:
        kind = " class='number'" if first_number <= index < last else ""
        return f"<td{kind}>{escape(text)}</td>"

    lines = ["<tr>" + "".join(f"<th>{escape(text)}</th>" for text in head) + "</tr>"]
    for row, style in zip(rows, styles or [""] * len(rows), strict=True):
        lines.append(f"<tr class='{style}'>" + "".join(cell(index, text) for index, text in enumerate(row)) + "</tr>")
    return "<table>\n" + "\n".join(lines) + "\n</table>"
