"""Shutter report as one self-contained HTML page."""

import os

from simulator.measurement.report.html import bullet_list, checks_table, figures_block, page, verdict, write_page
from simulator.measurement.shutter_check.figure import shutter_figures
from simulator.measurement.shutter_check.report import ShutterReport
from simulator.raw.software import software


def write_shutter_html(report: ShutterReport, path: str | os.PathLike) -> None:
    """Write the report. Raises PhotositeError when matplotlib is missing or the path cannot be written."""
    write_page(shutter_html(report), path)


def shutter_html(report: ShutterReport) -> str:
    """Return the page."""
    conditions = (
        f"Shutter: {report.shutter}.",
        "Daylight (D55), an f/4 lens of 50 mm without cos^4; a dark frame of each exposure time.",
        "A gate is four standard errors wide, as the scatter of the lines about the fit tells them.",
        f"Strip of {report.window[0]} x {report.window[1]} photosites with all lines of the sensor. {software()}.",
    )
    body = (
        f"{verdict(report.checks, report.frames)}\n<h2>Against what the shots state</h2>\n"
        f"{checks_table(report.checks, 'where')}\n<h2>Curves</h2>\n{figures_block(shutter_figures(report))}"
        f"<h2>Conditions</h2>\n{bullet_list(conditions)}"
    )
    return page(report.title, body)
