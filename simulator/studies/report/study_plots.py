"""The plots that the axes of a study suggest, made of the numbers in its table."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby
from typing import TypeVar

import numpy as np

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.measurement.quantities import Curve
from simulator.measurement.report.plot import Line, Plot, Scale, overlay
from simulator.optics.lens.thin_lens import ThinLens
from simulator.studies.report.study_data import Row, StudyFolder, describe_axes, is_number

MOST_LINES = 8  # of a plot
ISO, APERTURE, TIME, FOCUS = "exposure.iso", "lens.f_number", "exposure.time", "lens.focus_distance"
# Axes over which a quantity is drawn where they vary; a quantity without a line here, or whose axes stay, is drawn over all.
SUGGESTED = {
    "patch": (ISO, TIME, "scene.luminance"),
    "dynamic_range": (ISO,),
    "photons_to_photos": (ISO,),
    "mtf": (APERTURE, FOCUS, "lens.focal_length"),
    "blur_length": (APERTURE, FOCUS, TIME, "lens.focal_length"),
    "clipped_share": (TIME, ISO, "scene.luminance"),
}
RANGES, RANGE = ("dynamic_range", "photons_to_photos"), "range_ev"  # quantities that share a plot, and their figure in it
Item = TypeVar("Item")
WIDE = 12.0  # ratio of the ends of an axis from which on it is logarithmic


def study_plots(study: StudyFolder) -> list[Plot]:
    """Return the plots of a study: measured figures over axes, photon transfer, curves, depth of field, time over error."""
    plots = [*_figure_plots(study), *_transfer_plots(study), *_curve_plots(study), *_depth_plots(study), *_time_plots(study)]
    return [plot for plot in plots if plot.lines]


def _figure_plots(study: StudyFolder) -> list[Plot]:
    """Measured figures over the axes that suit them."""
    axes = [key for key in study.varied() if study.is_number_column(key)]
    plots = []
    for column in study.columns_of("measured"):
        quantity = str(study.table.columns[column].get("quantity") or "")
        if not study.is_number_column(column) or _is_constant(study, column):
            continue
        if quantity in RANGES and not column.endswith(f".{RANGE}"):  # what the range is made of
            continue
        wanted = [axis for axis in axes if axis in SUGGESTED.get(quantity, axes)]
        shared = quantity in RANGES
        for axis in wanted or axes:
            names = (column.partition(".")[0], "dynamic range") if shared else ("", study.title(column))
            lines = _lines(study, axis, column, *names)
            title = f"{'Dynamic range' if shared else study.full_title(column)} against {study.title(axis)}"
            values = np.concatenate([line.curve.y for line in lines]) if lines else np.empty(0)
            name = f"{'range' if shared else column}_{axis}"
            scales = _scale_of(study, axis), _log_if_wide(values)
            plots.append(Plot(name, title, tuple(lines), "", *scales, is_ordered=not shared and len(lines) > 1))
    return overlay(plots)


def _is_constant(study: StudyFolder, column: str) -> bool:
    """Whether a column has one value at all points that have one."""
    values = [float(row[column]) for row in study.done() if is_number(row.get(column))]
    return len({value for value in values if math.isfinite(value)}) < 2 and len(values) > 1


def _lines(study: StudyFolder, axis: str, column: str, label: str, y_name: str) -> list[Line]:
    """Lines of a column over an axis, one for each combination of the other axes; points alone are not joined."""
    rows = study.done()
    others = [key for key in study.varied() if key != axis and not _follows(rows, axis, key)]
    groups: dict[str, list[Row]] = {}
    for row in rows:
        if is_number(row.get(axis)) and is_number(row.get(column)) and math.isfinite(row[column]):
            groups.setdefault(describe_axes(study, row, others), []).append(row)
    if groups and max(map(len, groups.values())) == 1:
        groups = {"": [row for group in groups.values() for row in group]}
        is_joined = False
    else:
        is_joined = all(_is_ordered(rows, axis, key) for key in study.varied() if key != axis and key not in others)
    lines: list[Line] = []
    for name, group in _drawn(list(groups.items())):
        ordered = sorted(group, key=lambda row: row[axis])
        x, y = (np.array([float(row[key]) for row in ordered]) for key in (axis, column))
        curve = Curve(x, y, study.title(axis), study.unit(axis), y_name, study.unit(column))
        lines.append(Line(curve, ", ".join(filter(None, (label, name))), has_points=True, has_line=is_joined))
    if len(lines) > 1 and all(_is_part(line, lines[0]) for line in lines):  # the other axes do not matter
        return [replace(max(lines, key=lambda line: len(line.curve.x)), label=label)]
    return lines


def _is_ordered(rows: Sequence[Row], axis: str, key: str) -> bool:
    """Whether a key that goes with an axis rises or falls along it, unlike one drawn at random; texts count as ordered."""
    values = [row[key] for row in sorted(rows, key=lambda row: row[axis])]
    if not all(map(is_number, values)):
        return True
    steps = np.diff(np.array(values, np.float64))
    return bool((steps >= 0).all() or (steps <= 0).all())


def _is_part(one: Line, other: Line) -> bool:
    """Whether two lines have the same ordinates wherever both have a point, and one of them such a place at least."""
    mine, its = (dict(zip(line.curve.x.tolist(), line.curve.y.tolist(), strict=True)) for line in (one, other))
    shared = mine.keys() & its.keys()
    return bool(shared) and all(mine[x] == its[x] for x in shared)


def _follows(rows: Sequence[Row], axis: str, key: str) -> bool:
    """Whether each value of an axis goes with one value of another key, as in a zip."""
    pairs = {(row[axis], str(row[key])) for row in rows}
    return len(pairs) == len({value for value, _ in pairs})


def _transfer_plots(study: StudyFolder) -> list[Plot]:
    """Noise over signal of each patch, a line for each of up to MOST_LINES ISOs; None of a patch whose signal stays."""
    plots = []
    for column in study.columns_of("measured"):
        label, _, figure = column.rpartition(".")
        noise = f"{label}.noise_dn"
        if figure != "mean_dn" or noise not in study.table.columns or not study.is_number_column(noise):
            continue
        rows = [row for row in study.done() if all(is_number(row[key]) and row[key] > 0 for key in (column, noise))]
        by_iso = [ISO] if ISO in study.varied() else []
        rows.sort(key=lambda row: (*(row[key] for key in by_iso), row[column]))
        lines, isos = (
            [],
            [(name, list(group)) for name, group in groupby(rows, key=lambda row: describe_axes(study, row, by_iso))],
        )
        for name, points in _drawn(isos):
            x, y = (np.array([float(row[key]) for row in points]) for key in (column, noise))
            curve = Curve(x, y, study.title(column), study.unit(column), study.title(noise), study.unit(noise))
            lines.append(Line(curve, name, has_points=True))
        if lines and max(len(line.curve.x) for line in lines) > 2:
            title = f"Photon transfer of {label}"
            some = f" {len(lines)} of {len(isos)} ISOs." if len(lines) < len(isos) else ""
            note = f"Noise over signal of each point; slope 1/2 where photons are counted.{some}"
            plots.append(Plot(f"transfer_{label}", title, tuple(lines), note, "log", "log", is_ordered=len(lines) > 1))
    return plots


def _curve_plots(study: StudyFolder) -> list[Plot]:
    """Measured curves, such as modulation transfer, of up to MOST_LINES points."""
    plots, keys, done = [], study.varied(), study.done()
    for label in study.curves:
        rows = _chosen_rows(study, label.partition(".")[0])
        lines = []
        for row in rows:
            try:
                curve = study.table.curve(str(row["name"]), label)
            except PhotositeError:  # a point that has no such curve
                continue
            lines.append(Line(curve, describe_axes(study, row, keys)))
        note = f"{len(rows)} of {len(done)} points." if len(rows) < len(done) else ""
        if lines:
            first = lines[0].curve
            title = f"{first.y_name} over {first.x_name}, {label.partition('.')[0]}"
            plots.append(Plot(f"curve_{label}", title, tuple(lines), note, is_ordered=len(lines) > 1))
    return plots


def _chosen_rows(study: StudyFolder, label: str) -> list[Row]:
    """Points whose curves are drawn, at most MOST_LINES: along the axes that suit the quantity, others as at the first."""
    done = study.done()
    quantities = {str(about.get("quantity")) for name, about in study.table.columns.items() if name.startswith(f"{label}.")}
    suited = {axis for quantity in quantities for axis in SUGGESTED.get(quantity, ())}
    others = [key for key in study.varied() if key not in suited]
    alike = [row for row in done if all(row[key] == done[0][key] for key in others)]
    rows = alike if suited and len(alike) > 1 else done
    return _drawn(rows)


def _drawn(items: list[Item]) -> list[Item]:
    """Return those of some lines that are drawn: all, or MOST_LINES in even steps."""
    if len(items) <= MOST_LINES:
        return items
    return [items[place] for place in np.linspace(0, len(items) - 1, MOST_LINES).round().astype(int)]


def _depth_plots(study: StudyFolder) -> list[Plot]:
    """Depth of field and the blur circle of a far point over the aperture, by the lens of each shot."""
    if APERTURE not in study.varied() or not study.is_number_column(APERTURE):
        return []
    keys = [key for key in study.varied() if key.startswith(("lens", "camera"))]
    others = [key for key in keys if key != APERTURE]
    groups: dict[str, dict[float, tuple[float, float, float]]] = {}
    for row in study.done():
        found = groups.setdefault(describe_axes(study, row, others), {})
        path = study.folder / "points" / f"{row['name']}.yaml"
        if row[APERTURE] in found or not path.is_file():
            continue
        shot = load_shot(path)
        if isinstance(shot.lens, ThinLens):
            limits = shot.lens.depth_of_field_m(shot.lens.circle_um(math.hypot(*shot.camera.sensor_mm)))
            found[row[APERTURE]] = (*limits, 2.0 * abs(float(shot.lens.blur_radius_um(math.inf))))
    depth, blur = [], []
    for name, found in groups.items():
        numbers = np.array(sorted(found))
        if not len(numbers):
            continue
        for side, what in enumerate(("nearest sharp", "farthest sharp")):
            limit = np.array([found[one][side] for one in numbers])
            shown = np.isfinite(limit)
            curve = Curve(numbers[shown], limit[shown], study.title(APERTURE), "", "distance", "m")
            depth.append(Line(curve, ", ".join(filter(None, (what, name))), has_points=True))
        circle = np.array([found[one][2] for one in numbers])
        blur.append(Line(Curve(numbers, circle, study.title(APERTURE), "", "blur circle", "um"), name, has_points=True))
    note = "By the lens of each shot, with its circle of confusion; a limit of infinity is left out."
    far = "Diameter on the sensor of a point at infinity, by the lens of each shot."
    return [
        Plot("depth_of_field", "Depth of field against aperture", tuple(depth[: 2 * MOST_LINES]), note, "dial", "log"),
        Plot("far_blur", "Blur of a far point against aperture", tuple(blur[:MOST_LINES]), far, "dial", "log"),
    ]


def _time_plots(study: StudyFolder) -> list[Plot]:
    """Run time over the predicted error, where both differ between points."""
    rows = [row for row in study.done() if all(is_number(row.get(key)) for key in ("seconds", "predicted_error_sigma"))]
    x, y = (np.array([float(row[key]) for row in rows]) for key in ("predicted_error_sigma", "seconds"))
    if len(set(x.tolist())) < 2:
        return []
    curve = Curve(x, y, "predicted error", "sigma", "run time", "s")
    line = Line(curve, "", has_points=True, has_line=False)
    note = "Error of the light that the plan of each point predicts, in standard deviations of its noise."
    return [Plot("time_error", "Run time against error", (line,), note, _log_if_wide(x), _log_if_wide(y))]


def _scale_of(study: StudyFolder, axis: str) -> Scale:
    """Scale of an axis: that of a dial where it has one, logarithmic where it is wide."""
    if axis == ISO:
        return "iso"
    if axis == APERTURE:
        return "dial"
    return _log_if_wide(np.array([float(row[axis]) for row in study.done() if is_number(row[axis])]))


def _log_if_wide(values: np.ndarray) -> Scale:
    shown = values[np.isfinite(values)]
    is_wide = shown.size > 0 and shown.min() > 0 and shown.max() >= WIDE * shown.min()
    return "log" if is_wide else "linear"
