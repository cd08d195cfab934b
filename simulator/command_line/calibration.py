"""`photosite calibrate`."""

import math
from collections.abc import Iterator
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from simulator.atomic_files import atomic_write
from simulator.command_line.output_file import check_output
from simulator.command_line.screen import console, show_progress, tell
from simulator.config import dump_yaml, response_name
from simulator.config.source_files import camera_files
from simulator.errors import PhotositeError
from simulator.measurement.calibration.assumed_numbers import assumed_numbers
from simulator.measurement.calibration.camera_measurement import Calibration, measure_camera, range_stops
from simulator.measurement.calibration.camera_yaml import camera_document
from simulator.measurement.calibration.frame_checks import problems
from simulator.measurement.calibration.frame_sorting import by_iso, raw_files, read_frames
from simulator.measurement.calibration.iso_measurement import IsoMeasurement
from simulator.measurement.statistics.interval import Interval


def calibrate_files(
    files: list[Path], out: Path, name: str, base: str | None, pixel_pitch: str | None, response: str | None, plots: bool
) -> Path:
    """Measure a camera and write its file and plots; tables go to stdout, notes to stderr. Returns the camera file's path.

    Raises PhotositeError.
    """
    paths = raw_files(files)
    check_output(out, "--out", (".yaml", ".yml"), lambda: [*paths, *_named_files(base, response)])
    with show_progress("reading") as progress:
        frames = read_frames(paths, progress)
        groups, notes = problems(by_iso(frames))
        assumed = assumed_numbers(name, frames[0], base, pixel_pitch, response)  # before the work, not after it
        found = measure_camera(groups, progress)
    with atomic_write(out) as path:
        path.write_text(dump_yaml(camera_document(found, assumed)), encoding="utf-8")
    _show(found)
    for note in notes + found.notes:
        tell(f"note: {note}")
    if plots:
        _draw(found, name, out.with_suffix(".png"))
    return out


def _named_files(base: str | None, response: str | None) -> Iterator[Path]:
    """Yield the files of the base camera, and that of the response."""
    if base is not None:
        yield from camera_files(base)
    if response is not None:
        yield Path(response_name(response, "--response"))


def _draw(found: Calibration, name: str, path: Path) -> None:
    from simulator.measurement.calibration.plots import calibration_figure
    from simulator.measurement.report.figures import write_figure

    try:
        figure = calibration_figure(found, f"{name}: photosite calibrate")
    except PhotositeError as error:  # the numbers are written; a missing library must not take them back
        return tell(f"note: {error}; --no-plots leaves them out")
    write_figure(figure, path)
    print(path)


def _show(found: Calibration) -> None:
    out = console()
    table = Table(title="Measured, with 95 % intervals")
    heads = (
        "ISO",
        "K [DN/e-]",
        "read noise [DN]",
        "read noise [e-]",
        "lambda",
        "row noise [DN]",
        "black [DN]",
        "range [stops]",
    )
    for head in heads:
        table.add_column(escape(head), justify="right")
    for one in found.isos:
        table.add_row(*_format_row(one, found.white_levels_dn[one.iso]))
    out.print(table)
    out.print(_make_plane_table(found))
    for line in _describe_body(found):
        out.print(line)


def _format_row(one: IsoMeasurement, white_dn: float) -> list[str]:
    stops = range_stops(one, white_dn)
    shape = _format_interval(one.dark.shape.shape, 3) if one.dark.shape else "not measured"
    numbers = [
        _format_interval(one.gain_dn_per_e),
        _format_interval(one.dark.read_noise_dn),
        _format_interval(one.read_noise_e),
        shape,
        _format_interval(one.dark.row_noise_dn),
    ]
    return [f"{one.iso}", *numbers, f"{one.dark.black_level_dn:.2f}", f"{stops:.2f}" if math.isfinite(stops) else "-"]


def _make_plane_table(found: Calibration) -> Table:
    """Gain and colour bias (black level above the mean of all planes) by plane."""
    table = Table(title=escape("By colour plane: K [DN/e-] and colour bias [DN]"))
    table.add_column("ISO", justify="right")
    for name in found.isos[0].gain_by_plane:
        table.add_column(f"K {name}", justify="right")
        table.add_column(f"bias {name}", justify="right")
    table.add_column("same K, p", justify="right")
    for one in found.isos:
        pairs = [(one.gain_by_plane[name], one.dark.color_bias_dn[name]) for name in one.gain_by_plane]
        cells = [text for gain, bias in pairs for text in (f"{gain.value:.5g}", _format_interval(bias, 3))]
        table.add_row(f"{one.iso}", *cells, f"{one.gain_p:.2g}")
    return table


def _describe_body(found: Calibration) -> list[str]:
    whites = ", ".join(str(level) for level in sorted(set(found.white_levels_dn.values())))
    lines = [f"white level: {whites} DN, {'where flats clip' if found.white_is_measured else 'as the files say'}"]
    for part in found.sources:
        isos = f"ISO {part.isos[0]} to {part.isos[-1]}"
        formula = f"sigma_pre = {_format_interval(part.before_e)} e-, sigma_post = {_format_interval(part.after_dn)} DN"
        lines.append(f"two sources, {isos}: {formula}; met within {100 * part.worst:.1f} %")
    if found.switch_iso is not None:
        lines.append(f"conversion gain: switches at ISO {found.switch_iso}")
    if all(one.frames.is_clipped_at_zero for one in found.isos):
        lines.append("DSNU, columns, hot photosites: not measured, since the dark frames end at code 0")
    else:
        lines.append(f"DSNU: {_format_interval(found.dsnu_e)} e-; columns: {_format_interval(found.column_dn)} DN")
        hot = f"hot photosites: {1e6 * found.hot_share:.3g} per million"
        excess = f", on average {found.hot_excess_e:.3g} e- above the others in {found.dark_time_s:g} s"
        lines.append(hot + excess * (found.hot_share > 0))
    lines.append(f"PRNU: {_format_interval(found.prnu.scaled(100.0))} %" if found.prnu else "PRNU: no flat below clipping")
    if found.dark_current_e_per_s is not None:
        lines.append(f"dark current: {_format_interval(found.dark_current_e_per_s)} e-/s")
    return lines


def _format_interval(interval: Interval, decimals: int | None = None) -> str:
    style = ".4g" if decimals is None else f".{decimals}f"
    return f"{interval.value:{style}} ({interval.low:{style}} to {interval.high:{style}})"
