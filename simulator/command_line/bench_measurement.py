"""`photosite measure`: noise and EMVA 1288 of a camera from a bench's own raw files."""

import json
import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.table import Table

from simulator.atomic_files import atomic_write
from simulator.command_line.screen import console, show_files, show_progress, tell
from simulator.config import irradiance_w_m2, length_um
from simulator.errors import PhotositeError
from simulator.measurement.calibration.frame_checks import problems
from simulator.measurement.calibration.frame_sorting import IsoFrames, by_iso, raw_files, read_frames
from simulator.measurement.calibration.noise_table import NoiseOfIso, noise_table
from simulator.measurement.statistics.interval import Interval
from simulator.raw.software import software

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from simulator.measurement.emva1288.sorted_files import KnownLight

MOST_TICKS = 8  # ISOs that are all labelled


def measure_noise(files: list[Path], pixel_pitch: str | None, circle: str | None, out: Path | None, as_json: bool) -> None:
    """Print the noise of every ISO; with `out`, write noise.json and noise.png there. Raises PhotositeError."""
    from simulator.measurement.calibration.camera_measurement import measure_camera

    pitch_um = None if pixel_pitch is None else length_um(pixel_pitch, "--pixel-pitch")
    circle_um = None if circle is None else length_um(circle, "--circle-of-confusion")
    if circle_um is not None and pitch_um is None:
        rule = "goes with --pixel-pitch, without which it has no size in photosites; give both"
        raise PhotositeError(rule, key="--circle-of-confusion", value=circle)
    paths = raw_files(files)
    with show_progress("reading") as progress:
        groups, notes = problems(by_iso(read_frames(paths, progress)))
        found = measure_camera(groups, progress)
    rows = noise_table(found, pitch_um, circle_um)
    notes += found.notes
    content = {"software": software(), "files": len(paths), "isos": [_clean(asdict(row)) for row in rows], "notes": notes}
    print(json.dumps(content, indent=2)) if as_json else _show_noise(rows)
    for note in notes:
        tell(f"note: {note}")
    if out is not None:
        _write(out / "noise.json", content)
        from simulator.measurement.report.figures import write_figure

        write_figure(noise_over_iso(rows), out / "noise.png")
        show_files(out / "noise.json", out / "noise.png", is_data=as_json)


def measure_emva(
    files: list[Path],
    iso: int | None,
    irradiance: str | None,
    wavelength: str | None,
    pixel_pitch: str | None,
    out: Path | None,
    has_high_pass: bool = False,
) -> None:
    """Print EMVA 1288's summary of one ISO; with `out`, write emva.json, emva.png and an XML for each plane there.

    Raises PhotositeError.
    """
    from simulator.measurement.emva1288.figures import emva_overview
    from simulator.measurement.emva1288.measured_sheet import write_measured_sheets
    from simulator.measurement.emva1288.report import summary_of
    from simulator.measurement.emva1288.sorted_files import measure_emva_files
    from simulator.measurement.report.figures import write_figure

    light = _known_light(irradiance, wavelength, pixel_pitch)
    paths = raw_files(files)
    with show_progress("reading") as progress:
        group = _of_iso(by_iso(read_frames(paths, progress)), iso)
        found, notes = measure_emva_files(group, light, progress, has_high_pass)
    title = f"EMVA 1288 Release 4.0 Linear at ISO {group.iso}, from {len(paths)} raw files{', high pass' * has_high_pass}"
    table = Table(title=escape(title))
    names = list(found.planes)
    for column in ("quantity", "unit", *names):
        table.add_column(column, justify="left" if column in ("quantity", "unit") else "right")
    rows = summary_of(found)
    for quantity, unit, values in rows:
        table.add_row(quantity, unit, *(f"{values[name]:.5g}" for name in names))
    console().print(table)
    if light is None:
        told = "no quantum efficiency: it takes the light in photons; give --irradiance, --wavelength and --pixel-pitch"
        notes.append(f"{told}. Linearity is that over the exposure times of the files")
    for note in notes:
        tell(f"note: {note}")
    if out is not None:
        planes = {name: _clean({**asdict(one), "snr_max": one.snr_max}) for name, one in found.planes.items()}
        summary = [{"quantity": name, "unit": unit, "planes": _clean(values)} for name, unit, values in rows]
        lit = None if light is None else asdict(light)
        content = {"software": software(), "standard": "EMVA 1288 Release 4.0 Linear", "iso": group.iso, "light": lit}
        content["high_pass"] = has_high_pass
        _write(out / "emva.json", {**content, "light_in": found.light, "summary": summary, "planes": planes, "notes": notes})
        write_figure(emva_overview(found, title), out / "emva.png")
        texts = {"iso": str(group.iso), "light": found.light, "high_pass": "yes" if has_high_pass else "no"}
        about = {} if light is None else {"pixel_size": light.pitch_um}
        sheets = write_measured_sheets(found, out, texts, about)
        show_files(out / "emva.json", out / "emva.png", *sheets)


def _known_light(irradiance: str | None, wavelength: str | None, pixel_pitch: str | None) -> "KnownLight | None":
    """Return the light of the flats; None where nothing is said of it. Raises PhotositeError where a part is missing."""
    from simulator.measurement.emva1288.sorted_files import KnownLight

    given = {"--irradiance": irradiance, "--wavelength": wavelength, "--pixel-pitch": pixel_pitch}
    lacking = [name for name, value in given.items() if value is None]
    if irradiance is None and wavelength is None:
        return None
    if irradiance is None or wavelength is None or pixel_pitch is None:
        known = next(name for name, value in given.items() if value is not None)
        raise PhotositeError(
            f"photons take all three: give {' and '.join(lacking)}, too, or none of them", key=known, value=given[known]
        )
    nm = 1e3 * length_um(wavelength, "--wavelength")
    return KnownLight(irradiance_w_m2(irradiance, "--irradiance"), nm, length_um(pixel_pitch, "--pixel-pitch"))


def _of_iso(groups: list[IsoFrames], iso: int | None) -> IsoFrames:
    """Return the frames of an ISO; None: of the only one. Raises PhotositeError for another, and for several."""
    there = ", ".join(str(group.iso) for group in groups)
    found = [group for group in groups if iso in (None, group.iso)]
    if len(found) != 1:
        told = "the files are of several ISOs" if iso is None else "no file is of it"
        raise PhotositeError(f"{told}: {there}; give one by --iso", key="--iso", value=iso)
    return found[0]


def _show_noise(rows: list[NoiseOfIso]) -> None:
    from rich.box import SIMPLE_HEAD

    has_pdr = any(row.pdr_ev is not None for row in rows)
    table = Table(title="Noise, with 95 % intervals", box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    heads = [
        "ISO",
        "K [DN/e-]",
        "read noise [DN]",
        "read noise [e-]",
        "row noise [DN]",
        "PRNU [%]",
        "full scale [e-]",
        "range [EV]",
    ]
    for head in [*heads, *(["PDR [EV]"] if has_pdr else [])]:
        table.add_column(escape(head), justify="right")
    for row in rows:
        prnu = "-" if row.prnu is None else f"{100.0 * row.prnu.value:.3g}"
        cells = [f"{row.iso}", _interval(row.gain_dn_per_e), _interval(row.read_noise_dn), _interval(row.read_noise_e)]
        cells += [f"{row.row_noise_dn.value:.3g}", prnu, f"{row.full_scale_e:.0f}", _stops(row.range_ev)]
        table.add_row(*cells, *([_stops(row.pdr_ev)] if has_pdr else []))
    console().print(table)


def _interval(interval: Interval) -> str:
    return f"{interval.value:.4g} +- {0.5 * (interval.high - interval.low):.2g}"


def _stops(value: float | None) -> str:
    return "-" if value is None or math.isnan(value) else f"{value:.2f}"


def noise_over_iso(rows: list[NoiseOfIso]) -> "Figure":
    """Draw K, read noise and ranges against ISO. Raises PhotositeError when matplotlib is missing."""
    from simulator.measurement.report.figures import MEASURED, TRUTH, decade_axis, iso_axis, new_figure

    figure, (gain, noise, stops) = new_figure(1, 3, 12.0, 3.8)
    isos = [row.iso for row in rows]
    for axes, name, label in ((gain, "gain_dn_per_e", "K [DN/e-]"), (noise, "read_noise_e", "read noise [e-]")):
        parts: list[Interval] = [getattr(row, name) for row in rows]
        values = [part.value for part in parts]
        reach = [[part.value - part.low for part in parts], [part.high - part.value for part in parts]]
        axes.errorbar(isos, values, reach, fmt="o-", color=MEASURED, markersize=4, linewidth=1)
        axes.set_ylabel(f"{label}, bars: 95 %")
        if min(values) > 0:
            decade_axis(axes, min(values), max(values))
    stops.plot(isos, [row.range_ev for row in rows], "o-", color=MEASURED, markersize=4, linewidth=1, label="SNR 1")
    pdr = [row.pdr_ev for row in rows if row.pdr_ev is not None]
    if pdr:
        stops.plot(isos, pdr, "s-", color=TRUTH, markersize=4, linewidth=1, label="PDR")
    stops.set_ylabel("dynamic range [EV]")
    stops.legend(frameon=False)
    for axes in (gain, noise, stops):
        iso_axis(axes, isos)
        if len(isos) <= MOST_TICKS:
            axes.set_xticks(isos, [str(iso) for iso in isos])
    return figure


def _clean(value: Any) -> Any:
    """Return plain data for JSON: arrays as lists, None for nan."""
    if isinstance(value, dict):
        return {name: _clean(part) for name, part in value.items()}
    if hasattr(value, "tolist"):
        return _clean(value.tolist())
    if isinstance(value, list | tuple):
        return [_clean(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _write(path: Path, content: dict[str, Any]) -> None:
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
