"""`photosite validate`: measure a simulated camera from its raw files; results as tables, figures and JSON."""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import typer
from rich.markup import escape
from rich.table import Table

from simulator.command_line.screen import console, show_files, show_progress, tell
from simulator.config import load_camera, shutter_option, time_s
from simulator.errors import require
from simulator.measurement.report.tolerance_check import ToleranceCheck

if TYPE_CHECKING:
    from simulator.measurement.emva1288.report import EmvaReport
    from simulator.measurement.noise_check.report import NoiseReport
    from simulator.measurement.shutter_check.report import ShutterReport


def run_noise_validation(camera: str, settings: list[str], isos: list[int], out: Path | None, device: str | None) -> None:
    """Print the table; with `out`, keep the frames there and write noise.json and noise.png.

    Raises PhotositeError; typer.Exit(1) when a gate failed.
    """
    from simulator.measurement.noise_check import report as noise_report
    from simulator.measurement.noise_check.figure import noise_figure
    from simulator.measurement.report.figures import write_figure

    body = load_camera(camera, settings)
    with _open_frame_folder(out) as folder, show_progress("frames") as progress:
        report = noise_report.validate_noise(
            body, isos or body.isos, folder, keep=out is not None, device=device, progress=progress
        )
    show_noise(report)
    if out is not None:
        noise_report.write_noise_json(report, out / "noise.json")
        write_figure(noise_figure(report), out / "noise.png")
        show_files(folder, out / "noise.json", out / "noise.png")
    _report_verdict(report.checks)


def run_emva_validation(camera: str, settings: list[str], iso: int | None, out: Path | None, device: str | None) -> None:
    """Print summary and gates; with `out`, keep the frames there and write emva.html, emva.json, emva.png and XML sheets.

    iso: the lowest that was measured when None. Raises PhotositeError; typer.Exit(1) when a gate failed.
    """
    from simulator.measurement.emva1288 import html
    from simulator.measurement.emva1288 import report as emva_report
    from simulator.measurement.emva1288.figures import emva_overview
    from simulator.measurement.emva1288.measured_sheet import write_measured_sheets
    from simulator.measurement.report.figures import write_figure

    body = load_camera(camera, settings)
    with _open_frame_folder(out) as folder, show_progress("frames") as progress:
        report = emva_report.validate_emva(body, iso or body.isos[0], folder, device=device, progress=progress)
    show_summary(report)
    show_gates("Against the camera file", report.checks)
    if out is not None:
        emva_report.write_emva_json(report, out / "emva.json")
        html.write_emva_html(report, out / "emva.html")
        write_figure(emva_overview(report.found, f"EMVA 1288 of {report.camera} at ISO {report.iso}"), out / "emva.png")
        texts = {"vendor": body.make, "model": body.model, "iso": str(report.iso)}
        sides = {"width": float(body.width_px), "height": float(body.height_px)}
        about = {**sides, "pixel_size": body.pixel_pitch_um, "bit_depth": float(body.bit_depth)}
        sheets = write_measured_sheets(report.found, out, texts, about)
        show_files(folder, out / "emva.html", out / "emva.json", out / "emva.png", *sheets)
    _report_verdict(report.checks)


def run_shutter_validation(
    camera: str,
    settings: list[str],
    readout_time: str | None,
    shutter: str | None,
    iso: int | None,
    out: Path | None,
    device: str | None,
) -> None:
    """Print the gates; with `out`, keep the frames there and write shutter.html, shutter.json and shutter.png.

    readout_time: of a rolling shutter; shutter: another one, see `shutter_option`. iso: the lowest that was measured when None.
    Raises PhotositeError; typer.Exit(1) when a gate failed.
    """
    from simulator.exposure.shutter import AnyShutter, RollingShutter
    from simulator.measurement.report.figures import write_figure
    from simulator.measurement.shutter_check import html
    from simulator.measurement.shutter_check import report as shutter_report
    from simulator.measurement.shutter_check.figure import shutter_overview

    body = load_camera(camera, settings)
    kind: AnyShutter | None = None if shutter is None else shutter_option(shutter, "--shutter")
    if readout_time is not None:
        rule = "goes with a rolling shutter alone; state it in --shutter, or leave --shutter out"
        require(kind is None, "--readout-time", readout_time, rule)
        kind = RollingShutter(time_s(readout_time, "--readout-time"))
    with _open_frame_folder(out) as folder, show_progress("frames") as progress:
        report = shutter_report.validate_shutter(body, folder, shutter=kind, iso=iso, device=device, progress=progress)
    console().print(
        escape(f"{report.shutter}; {report.frames} raw files of {report.window[0]} x {report.window[1]} photosites")
    )
    show_shutter(report)
    if out is not None:
        shutter_report.write_shutter_json(report, out / "shutter.json")
        html.write_shutter_html(report, out / "shutter.html")
        write_figure(shutter_overview(report), out / "shutter.png")
        show_files(folder, out / "shutter.html", out / "shutter.json", out / "shutter.png")
    _report_verdict(report.checks)


def show_shutter(report: "ShutterReport") -> None:
    """Print a line per gate: measured and expected, and the deviation beside what is allowed."""
    from rich.box import SIMPLE_HEAD

    title = f"{report.title}, against what the shots state"
    table = Table(title=escape(title), box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    for column in ("quantity", "where", "measured", "expected", "deviation", "allowed", ""):
        table.add_column(column, justify="left" if column in ("quantity", "where", "") else "right")
    for gate in report.checks:
        name = f"{gate.quantity} [{gate.unit}]" if gate.unit else gate.quantity
        allowed = "" if gate.reason_unchecked else _format_amount(gate, gate.tolerance)
        verdict = "not gated" if gate.reason_unchecked else "pass" if gate.passed else "FAIL"
        numbers = (f"{gate.measured:.5g}", f"{gate.expected:.5g}", _format_amount(gate, gate.deviation, "+"), allowed)
        style = "dim" if gate.reason_unchecked else None if gate.passed else "red"
        table.add_row(escape(name), escape(gate.where), *numbers, verdict, style=style)
    console().print(table)
    for line in _list_reasons(report.checks):
        console().print(escape(line))


def show_summary(report: "EmvaReport") -> None:
    """Print EMVA 1288's numbers by plane, and the speed of ISO 12232."""
    names = list(report.found.planes)
    table = Table(title=escape(f"EMVA 1288 of {report.camera} at ISO {report.iso}, from {report.frames} raw files"))
    for column in ("quantity", "unit", *names):
        table.add_column(column, justify="left" if column in ("quantity", "unit") else "right")
    for quantity, unit, values in report.summary():
        table.add_row(quantity, unit, *(f"{values[name]:.5g}" for name in names))
    console().print(table)
    speed, exposure = report.found.saturation_speed, report.found.saturation_exposure_lx_s
    console().print(f"ISO 12232: S_sat = 78 / H_sat = {speed:.4g} (H_sat = {exposure:.4g} lx s, D55); nominal ISO {report.iso}")


def show_noise(report: "NoiseReport") -> None:
    """Print a line per ISO, each number with its deviation from the camera file, and the checks of several ISOs together."""
    quantities = ("K", "read noise", "full scale", "dynamic range")
    table = Table(
        title=escape(f"{report.camera}: noise measured from {report.frames} raw files, and its deviation from the file")
    )
    heads = (
        "ISO",
        "K [DN/e-]",
        "",
        "read noise [DN]",
        "",
        "[e-]",
        "full scale [e-]",
        "",
        "dynamic range [stops]",
        "",
        "row noise [DN]",
    )
    for head in heads:
        table.add_column(escape(head), justify="right")
    for point in report.points:
        gates = {gate.quantity: gate for gate in report.checks if gate.where == f"ISO {point.iso}"}
        cells = [cell for name in quantities for cell in (f"{gates[name].measured:.5g}", _format_deviation(gates[name]))]
        table.add_row(str(point.iso), *cells[:4], f"{point.read_noise_e:.4g}", *cells[4:], f"{point.row_noise_dn:.3g}")
    console().print(table)
    for gate in report.checks:
        if not gate.where.startswith("ISO") or " to " in gate.where:
            console().print(
                escape(f"{gate.quantity}, {gate.where}: {gate.measured:.5g}, expected {gate.expected:.5g}"),
                _format_deviation(gate),
            )
    for line in _list_reasons(report.checks):
        console().print(escape(line))


def _list_reasons(gates: Sequence[ToleranceCheck]) -> list[str]:
    """Return why quantities were not checked: each reason once, with its quantities and ISOs."""
    lines = []
    for reason in dict.fromkeys(gate.reason_unchecked for gate in gates if gate.reason_unchecked):
        held = [gate for gate in gates if gate.reason_unchecked == reason]
        quantities, places = (
            ", ".join(dict.fromkeys(names)) for names in zip(*((g.quantity, g.where) for g in held), strict=True)
        )
        lines.append(f"not gated, {reason}: {quantities} at {places.replace(', ISO ', ', ')}")
    return lines


def show_gates(title: str, gates: Sequence[ToleranceCheck]) -> None:
    """Print a line per gate: what was measured, what it should be, and the verdict."""
    table = Table(title=escape(title))
    for column in ("quantity", "where", "measured", "expected", "unit", "deviation", "allowed", "standard error", "verdict"):
        table.add_column(column, justify="left" if column in ("quantity", "where", "unit", "verdict") else "right")
    for gate in gates:
        numbers = (f"{gate.measured:.5g}", f"{gate.expected:.5g}", gate.unit)
        allowed = "" if gate.reason_unchecked else _format_amount(gate, gate.tolerance)
        verdict = f"not gated: {gate.reason_unchecked}" if gate.reason_unchecked else "pass" if gate.passed else "FAIL"
        deviations = (_format_deviation(gate), allowed, _format_amount(gate, gate.error))
        style = "dim" if gate.reason_unchecked else None if gate.passed else "red"
        table.add_row(gate.quantity, gate.where, *numbers, *deviations, escape(verdict), style=style)
    console().print(table)


def _format_deviation(gate: ToleranceCheck) -> str:
    """Return a deviation with its verdict; empty where the expected value is 0 and the tolerance relative."""
    if not gate.expected and gate.relative:
        return ""
    text = _format_amount(gate, gate.deviation, "+")
    return f"[dim]({text})[/dim]" if gate.reason_unchecked else text if gate.passed else f"[red]{text} FAIL[/red]"


def _format_amount(gate: ToleranceCheck, value: float, sign: str = "") -> str:
    return f"{100.0 * value:{sign}.3f} %" if gate.relative else f"{value:{sign}.4f}"


def _report_verdict(gates: Sequence[ToleranceCheck]) -> None:
    asked, failed = [gate for gate in gates if not gate.reason_unchecked], [gate for gate in gates if not gate.passed]
    if failed:
        names = ", ".join(f"{gate.quantity} at {gate.where}" for gate in failed[:3])
        more = f" and {len(failed) - 3} more" if len(failed) > 3 else ""
        tell(f"error: {len(failed)} of {len(asked)} gates failed: {names}{more}")
        raise typer.Exit(1)
    tell(f"all {len(asked)} gates passed")


@contextmanager
def _open_frame_folder(out: Path | None) -> Iterator[Path]:
    """Yield the folder for the frames: `out`/frames, or a temporary one that is removed at the end."""
    if out is not None:
        yield out / "frames"
        return
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        yield Path(folder)
