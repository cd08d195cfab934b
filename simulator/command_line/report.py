"""`photosite report`: the page of a study, and its PDF."""

from pathlib import Path

from simulator.command_line.output_file import check_output
from simulator.command_line.screen import show_files, show_waiting
from simulator.measurement.report.html import write_page
from simulator.studies.report.page import report_page
from simulator.studies.report.pdf import check_browser, print_pdf
from simulator.studies.report.study_input import open_study

PAGE = "report.html"  # in the folder of the study


def write_report(folder: Path, out: Path | None, pdf: Path | None) -> None:
    """Write the report of a study and print the names of its files.

    out: HTML page; None: report.html in the study's folder. pdf: None: no PDF. Raises PhotositeError.
    """
    page = folder / PAGE if out is None else out
    check_output(page, "--out", (".html", ".htm"))
    if pdf is not None:
        check_output(pdf, "--pdf", (".pdf",))
        check_browser(pdf)
    study = open_study(folder)
    with show_waiting("report"):
        write_page(report_page(study), page)
        if pdf is not None:
            print_pdf(report_page(study, is_for_print=True), pdf)
    show_files(page, pdf)
