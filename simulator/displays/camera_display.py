"""A camera: what it is, its noise at each ISO, and where its numbers come from."""

import base64
import math
from html import escape

from simulator.displays.explanation import section
from simulator.errors import PhotositeError
from simulator.measurement.curves.sensor_plots import CameraSetting, noise_plot
from simulator.measurement.curves.subject import ALONE_TIME_S
from simulator.measurement.report.figures import plot_svg
from simulator.measurement.report.html import table
from simulator.pipeline.explain.noise_budget import noise_budget
from simulator.pipeline.explain.plan_tables import Column, ExplainedTable, Value
from simulator.sensor.camera.camera import Camera


def camera_title(camera: Camera) -> str:
    """Return make and model."""
    return f"Camera {camera.make} {camera.model}"


def show_camera(camera: Camera) -> str:
    """Return tables of facts, noise by ISO and sources, and a plot of the noise where matplotlib is installed."""
    body = table(["camera", "value"], [[name, text] for name, text in _facts(camera)], first_number=2)
    body += section(iso_table(camera), "h4") + _plot(camera)
    if camera.sources:
        rows = [[keys or "all", text] for keys, text in camera.sources]
        told = "<summary>Sources of the file that it was read from</summary>"
        body += f"<details>{told}{table(['keys', 'source'], rows, first_number=2)}</details>"
    return body


def iso_table(camera: Camera) -> ExplainedTable:
    """Return gain, noise in the dark and range at each ISO of a camera, at an exposure of ALONE_TIME_S (EMVA 1288 R4.0)."""
    columns = (
        Column("ISO"),
        Column("K", "DN/e-"),
        Column("noise in the dark", "DN"),
        Column("noise in the dark", "e-"),
        Column("black", "DN"),
        Column("white", "DN"),
        Column("full scale", "e-"),
        Column("dynamic range", "stops"),
    )
    setting, rows = CameraSetting.of(camera, ALONE_TIME_S), []
    for iso in camera.isos:
        one = noise_budget(setting.sensor(iso), 0.0, iso, ALONE_TIME_S)
        levels, stops = camera.iso_setting(iso).levels_dn, one.dynamic_range_stops
        noise = one.dark_sigma_dn, one.dark_sigma_dn / one.gain_dn_per_e
        row: tuple[Value, ...] = (iso, one.gain_dn_per_e, *noise, *levels, round(one.full_scale_e))
        rows.append((*row, stops if math.isfinite(stops) else None))
    title = f"Noise and range by ISO, at {ALONE_TIME_S:g} s: temporal, with rounding"
    return ExplainedTable("isos", title, columns, tuple(rows))


def _facts(camera: Camera) -> list[tuple[str, str]]:
    """Return quantities and their values with units; those that a camera has not are left out."""
    (width_mm, height_mm), window = camera.sensor_mm, camera.window
    peaks = camera.response.quantum_efficiency.max(axis=0)
    letters = "" if camera.channels == 1 else camera.filter.letters
    found = [
        ("sensor", f"{camera.width_px} × {camera.height_px} photosites, {width_mm:.4g} mm × {height_mm:.4g} mm"),
        ("pixel pitch", f"{camera.pixel_pitch_um:g} µm"),
        ("filter", camera.cfa),
        ("codes", f"{camera.bit_depth} bit"),
        (
            "peak quantum efficiency",
            ", ".join(f"{name} {peak:.3g}".strip() for name, peak in zip(letters or [""], peaks, strict=True)),
        ),
        ("window", "" if window is None else f"{window.width} × {window.height} at ({window.x}, {window.y})"),
        ("read-out", "" if camera.readout_time_s is None else f"{1e3 * camera.readout_time_s:g} ms"),
        ("high conversion gain", "" if camera.conversion_gain is None else f"from ISO {camera.conversion_gain.iso}"),
        ("stages", ", ".join(sorted(camera.stages))),
    ]
    return [(name, text) for name, text in found if text]


def _plot(camera: Camera) -> str:
    """Return the noise over the ISO as a picture; "" where matplotlib is missing, or the camera has one ISO."""
    if len(camera.isos) < 2:
        return ""
    try:
        svg = plot_svg(noise_plot(CameraSetting.of(camera, ALONE_TIME_S)))
    except (PhotositeError, ImportError):
        return ""
    text = base64.b64encode(svg.encode("utf-8")).decode("ascii")
    told = escape(f"Noise in the dark against ISO of {camera.make} {camera.model}; the numbers stand in the table", quote=True)
    return f"<img src='data:image/svg+xml;base64,{text}' width='440' alt='{told}' style='background: #fff'>"
