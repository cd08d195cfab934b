"""`photosite sheet`: the EMVA 1288 data sheet that a camera file states, as a table and as XML."""

from pathlib import Path

from rich.markup import escape
from rich.table import Table

from simulator.command_line.output_file import check_output
from simulator.command_line.screen import console, show_files
from simulator.config import length_um, load_camera
from simulator.config.source_files import camera_files
from simulator.measurement.curves.stated_sheet import stated_sheet
from simulator.measurement.emva1288.xml_sheet import STANDARD, sheet_rows, write_xml_sheet


def show_sheet(camera: str, settings: list[str], iso: int | None, wavelength: str | None, out: Path | None) -> None:
    """Print the data sheet of a camera; with `out`, write it. iso: the lowest when None. Raises PhotositeError."""
    from rich.box import SIMPLE_HEAD

    if out is not None:
        check_output(out, "--out", (".xml",), lambda: camera_files(camera, settings))
    nm = None if wavelength is None else 1e3 * length_um(wavelength, "--wavelength")
    body = load_camera(camera, settings)
    sheet = stated_sheet(body, body.isos[0] if iso is None else iso, nm)
    title = f"{STANDARD}: what the camera file of {body.make} {body.model} states at ISO {sheet.texts['iso']}"
    table = Table(title=escape(title), box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for column in ("section", "name", "quantity", "value", "unit"):
        table.add_column(column, justify="right" if column == "value" else "left")
    before = ""
    for section, name, words, unit, value in sheet_rows(sheet):
        table.add_row("" if section == before else section, name, words, f"{value:.6g}", unit)
        before = section
    console().print(table)
    if out is not None:
        write_xml_sheet(sheet, out)
        show_files(out)
