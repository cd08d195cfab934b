"""EMVA 1288 report as one self-contained HTML page."""

import os

from simulator.measurement.emva1288.figures import TITLES, emva_figures
from simulator.measurement.emva1288.frames import EXPOSURE_TIME_S, SHARES, STACK
from simulator.measurement.emva1288.report import EmvaReport
from simulator.measurement.noise_check.flat_bench import NARROW_NM
from simulator.measurement.report.html import bullet_list, checks_table, figures_block, page, table, verdict, write_page
from simulator.raw.software import software


def write_emva_html(report: EmvaReport, path: str | os.PathLike) -> None:
    """Write the report. Raises PhotositeError when matplotlib is missing or the path cannot be written."""
    write_page(emva_html(report), path)


def emva_html(report: EmvaReport) -> str:
    """Return the page."""
    figures = [(svg, TITLES[name]) for name, svg in emva_figures(report.found).items()]
    body = (
        f"{verdict(report.checks, report.frames)}\n<h2>Summary</h2>\n{_summary(report)}\n{_speed(report)}"
        f"<h2>Curves</h2>\n{figures_block(figures)}"
        f"<h2>Against the camera file</h2>\n{checks_table(report.checks, 'plane')}\n<h2>Conditions</h2>\n{_conditions(report)}"
    )
    return page(f"EMVA 1288 of {report.camera} at ISO {report.iso}", body)


def _summary(report: EmvaReport) -> str:
    names = list(report.found.planes)
    rows = [[quantity, unit, *(f"{values[name]:.5g}" for name in names)] for quantity, unit, values in report.summary()]
    return table(["quantity", "unit", *names], rows, first_number=2)


def _speed(report: EmvaReport) -> str:
    found = report.found
    return (
        f"<p>ISO 12232 saturation-based speed S_sat = 78 / H_sat = {found.saturation_speed:.4g}, with "
        f"H_sat = {found.saturation_exposure_lx_s:.4g} lx s of daylight (D55); nominal ISO {report.iso}.</p>\n"
    )


def _conditions(report: EmvaReport) -> str:
    lines = [
        "EMVA 1288 Release 4.0 Linear, each colour plane in light of the wavelength at which it sees most, a band of "
        f"{NARROW_NM:g} nm at half its height, without a lens's fall-off; photons are counted on the whole area of a "
        "photosite.",
        f"{len(SHARES)} steps of light in pairs, exposure time {EXPOSURE_TIME_S:g} s throughout; "
        f"{STACK} frames in the dark and {STACK} at half saturation for DSNU and PRNU, no high-pass filter.",
        "K is fitted up to 70 % of saturation with points weighted by the inverse variance of their variance. "
        "Saturation is the step of the largest variance.",
        f"Window of {report.window[0]} x {report.window[1]} photosites. {software()}.",
    ]
    return bullet_list(lines)
