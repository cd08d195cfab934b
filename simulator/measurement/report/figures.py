"""Helpers for the figures of reports. matplotlib is an optional dependency, imported when the first figure is made."""

import io
import math
import os
import re
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any

import numpy as np

from simulator.atomic_files import atomic_write
from simulator.errors import PhotositeError
from simulator.measurement.report.plot import Plot, Scale, axis_label

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MEASURED, TRUTH, ALLOWED, FAILED = "#0b5fa5", "#333333", "#dde7f0", "#c0392b"
# Of lines: each has a contrast of 3 to 1 with white or more (WCAG 2.2, 1.4.11); the first five can be told from each other in
# all kinds of colour vision, the rest by dashes and markers.
COLORS = ("#3d3d9e", "#c4500a", "#00795c", "#2a8fbd", "#222222", "#a3143c", "#8c6d00", "#b06fb5")
DASHES = ("-", (0, (5, 2)), (0, (1, 1.4)), (0, (6, 1.5, 1, 1.5)))
MARKERS = "os^Dvx"
MOST_VECTORS = 3000  # points of a line from which on an SVG holds it as pixels
FORMATS = (".svg", ".png", ".pdf")  # that a file name may end with
DIALS = {  # labels of an axis in steps of a dial: full stops
    "iso": [100.0 * 4.0**power for power in range(-2, 9)],
    "dial": [1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0, 32.0, 45.0, 64.0],
}


def new_figure(rows: int, columns: int, width_in: float, height_in: float) -> tuple["Figure", list["Axes"]]:
    """Return an empty figure and its axes, row by row. Raises PhotositeError when matplotlib is missing."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise PhotositeError("plots need matplotlib, which is not installed: pip install 'photosite[report]'") from error
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    axes = list(figure.subplots(rows, columns, squeeze=False).flat)
    for one in axes:
        one.spines[["top", "right"]].set_visible(False)
        one.grid(True, which="major", color="#e5e5e5", linewidth=0.7)
        one.set_axisbelow(True)
    return figure, axes


def iso_axis(axes: "Axes", isos: Sequence[int]) -> None:
    """Make the x axis a logarithmic ISO axis, labelled every two stops."""
    low, high = min(isos), max(isos)
    dial = [100.0 * 4.0**power for power in range(-2, 9) if 0.9 * low <= 100 * 4**power <= 1.1 * high]
    axes.set(xscale="log", xlabel="ISO", xlim=(low / 1.25, high * 1.25))
    axes.set_xticks(dial, [f"{iso:g}" for iso in dial], minor=False)
    axes.set_xticks([], minor=True)


def decade_axis(axes: "Axes", low: float, high: float) -> None:
    """Make the y axis logarithmic, for one or two decades, labelled with plain numbers at 1, 2 and 5."""
    ticks = [step * 10.0**power for power in range(-6, 8) for step in (1, 2, 5)]
    kept = [tick for tick in ticks if low / 1.3 <= tick <= high * 1.3]
    axes.set(yscale="log", ylim=(low / 1.3, high * 1.3))
    axes.set_yticks(kept, [f"{tick:g}" for tick in kept], minor=False)
    axes.set_yticks([], minor=True)


def svg_of(figure: "Figure") -> str:
    """Return a figure as an SVG element to stand in an HTML page, with the same bytes each time."""
    with _svg_style():
        buffer = io.StringIO()
        figure.savefig(buffer, format="svg", dpi=150, metadata={"Date": None})
    text = re.sub(r"<metadata>.*?</metadata>", "", buffer.getvalue(), flags=re.DOTALL)
    # Groups are named alike in all figures, and no name is used: a page may hold several figures.
    return re.sub(r'<g id="[^"]*">', "<g>", text[text.index("<svg") :])


def _svg_style() -> AbstractContextManager[None]:
    """Style of SVG files: names that are the same each time, and text as text."""
    import matplotlib

    return matplotlib.rc_context({"svg.hashsalt": "photosite", "svg.fonttype": "none"})


def write_figure(figure: "Figure", path: str | os.PathLike[str]) -> None:
    """Write a figure in the format of the suffix, with the same bytes each time. Raises PhotositeError."""
    undated = {".png": "Software", ".pdf": "CreationDate"}.get(os.path.splitext(os.fspath(path))[1].lower(), "Date")
    with atomic_write(path) as temporary, _svg_style():
        figure.savefig(temporary, dpi=120, metadata={undated: None})


def plots_figure(plots: Sequence[Plot], title: str = "") -> "Figure":
    """Draw plots beside each other, one alone larger. Raises PhotositeError when matplotlib is missing."""
    columns = 1 if len(plots) == 1 else 2
    rows = -(-len(plots) // columns)
    figure, axes = new_figure(rows, columns, 7.2 * columns, 4.6 * rows)
    if title:
        figure.suptitle(title)
    for one, plot in zip(axes, plots, strict=False):
        draw_plot(one, plot)
    for one in axes[len(plots) :]:
        one.set_visible(False)
    return figure


def plot_svg(plot: Plot) -> str:
    """Return one plot, without its title, as an SVG element. Raises PhotositeError when matplotlib is missing."""
    figure, (axes,) = new_figure(1, 1, 5.6, 3.9)
    draw_plot(axes, plot, has_title=False)
    return svg_of(figure)


def draw_plot(axes: "Axes", plot: Plot, has_title: bool = True) -> None:
    """Draw a plot into axes: lines of one subject in one colour, its marks, labels with units and a legend."""
    if has_title:
        axes.set_title(plot.title)
    if not plot.lines:
        axes.text(0.5, 0.5, "nothing to draw", ha="center", va="center", transform=axes.transAxes)
        return
    are_several = len({line.subject for line in plot.lines}) > 1
    for line, style in zip(plot.lines, _styles(plot), strict=True):
        label = ", ".join(filter(None, (line.subject if are_several else "", line.label)))
        axes.plot(line.curve.x, line.curve.y, label=label, **style)
    first = plot.lines[0].curve
    axes.set(xlabel=axis_label(first.x_name, first.x_unit), ylabel=axis_label(first.y_name, first.y_unit))
    x = np.concatenate([line.curve.x for line in plot.lines])
    y = np.concatenate([line.curve.y for line in plot.lines])
    _scale(axes, "x", plot.x_scale, x)
    _scale(axes, "y", plot.y_scale, y if plot.y_from is None else np.maximum(y, plot.y_from))
    if plot.y_from is not None:
        axes.set_ylim(bottom=plot.y_from)
    _draw_marks(axes, plot)
    if any(line.label for line in plot.lines):
        is_large = sum(len(line.curve.x) for line in plot.lines) > MOST_VECTORS  # a search for the best place takes long
        axes.legend(frameon=False, fontsize="small", loc="upper left" if is_large else "best")


def _styles(plot: Plot) -> Iterator[dict[str, Any]]:
    """Colour, dashes and markers of each line: by subject and line, or in steps of one colour map where lines are ordered."""
    subjects = list(dict.fromkeys(line.subject for line in plot.lines))
    many = len(subjects) > 1
    labels = list(dict.fromkeys(line.label for line in plot.lines))
    for place, line in enumerate(plot.lines):
        own = labels.index(line.label)
        if many:
            color, dash = COLORS[subjects.index(line.subject) % len(COLORS)], DASHES[own % len(DASHES)]
        elif plot.is_ordered:
            color, dash = _step_color(place, len(plot.lines)), "-"
        else:
            color, dash = COLORS[own % len(COLORS)], DASHES[own // len(COLORS) % len(DASHES)]
        if line.is_reference and not many:
            dash = DASHES[1 + own % 3]
        marker = MARKERS[(subjects.index(line.subject) if many else own) % len(MARKERS)] if line.has_points else None
        yield {
            "color": color,
            "linestyle": dash if line.has_line else "none",
            "marker": marker,
            "markersize": 4.5,
            "linewidth": 1.1 if line.is_reference else 1.6,
            "rasterized": len(line.curve.x) > MOST_VECTORS,
        }


def _step_color(place: int, count: int) -> Any:
    """Return one of `count` steps of cividis, even in lightness for all kinds of colour vision, without its light end."""
    import matplotlib

    return matplotlib.colormaps["cividis"](0.78 * place / max(count - 1, 1))


def _scale(axes: "Axes", which: str, scale: Scale, values: np.ndarray) -> None:
    """Set the scale of the axis `which`, x or y, for these values; a logarithm is not taken where one is not above 0."""
    shown = values[np.isfinite(values)]
    if scale == "linear" or not shown.size or shown.min() <= 0:
        return
    low, high = float(shown.min()), float(shown.max())
    axis, set_limits = (axes.xaxis, axes.set_xlim) if which == "x" else (axes.yaxis, axes.set_ylim)
    (axes.set_xscale if which == "x" else axes.set_yscale)("log")
    if scale in DIALS:
        kept = [tick for tick in DIALS[scale] if 0.9 * low <= tick <= 1.1 * high]
        set_limits(low / 1.25, high * 1.25)
        if len(kept) < 2:
            kept = sorted({low, high})
        _set_ticks(axis, kept)
    elif high < 60.0 * low:
        steps = (1, 2, 5) if high > 3.0 * low else (1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9)
        ticks = [step * 10.0**power for power in range(-12, 13) for step in steps]
        kept = [tick for tick in ticks if low / 1.3 <= tick <= high * 1.3]
        set_limits(low / 1.3, high * 1.3)
        _set_ticks(axis, kept)


def _set_ticks(axis: Any, ticks: Sequence[float]) -> None:
    axis.set_ticks(ticks, [f"{tick:g}" for tick in ticks], minor=False)
    axis.set_ticks([], minor=True)


def _draw_marks(axes: "Axes", plot: Plot) -> None:
    """Draw the marks behind the lines, each with its label at the end of it; one outside the axes is left out."""
    style: dict[str, Any] = {"fontsize": "x-small", "color": "#555555", "textcoords": "offset points"}
    levels = sorted(mark.value for mark in plot.marks if mark.axis == "y")
    for mark in plot.marks:
        low, high = axes.get_xlim() if mark.axis == "x" else axes.get_ylim()
        if not (math.isfinite(mark.value) and low <= mark.value <= high):
            continue
        along = axes.axvline if mark.axis == "x" else axes.axhline
        along(mark.value, color="#777777", linewidth=0.9, zorder=1)
        if mark.axis == "x":
            axes.annotate(mark.label, (mark.value, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -9), **style)
        else:  # the uppermost stands above its line, the others below theirs
            place, side = ((-3, 3), "bottom") if mark.value == levels[-1] else ((-3, -3), "top")
            text: dict[str, Any] = {"ha": "right", "va": side, **style}
            axes.annotate(mark.label, (1.0, mark.value), xycoords=("axes fraction", "data"), xytext=place, **text)
