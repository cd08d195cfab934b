"""Figures of a shutter report: each measured curve over the fitted or stated one."""

from typing import TYPE_CHECKING

import numpy as np

from simulator.measurement.report.figures import MEASURED, TRUTH, new_figure, svg_of
from simulator.measurement.shutter_check.case import Curve
from simulator.measurement.shutter_check.report import ShutterReport

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_POINTS = 600  # of a measured curve that are drawn


def shutter_overview(report: ShutterReport) -> "Figure":
    """Draw all curves into one figure. Raises PhotositeError when matplotlib is missing."""
    columns = min(len(report.curves), 3)
    rows = -(-len(report.curves) // columns)
    figure, several = new_figure(rows, columns, 5.0 * columns, 3.6 * rows)
    figure.suptitle(f"{report.title}, measured from {report.frames} raw files\n{report.shutter}", fontsize="medium")
    for axes, curve in zip(several, report.curves, strict=False):
        _draw(axes, curve)
        axes.set_title(curve.title, fontsize="small")
    for axes in several[len(report.curves) :]:
        axes.set_visible(False)
    return figure


def shutter_figures(report: ShutterReport) -> list[tuple[str, str]]:
    """Draw each curve as an SVG element, with its title. Raises PhotositeError when matplotlib is missing."""
    drawn = []
    for curve in report.curves:
        figure, (axes,) = new_figure(1, 1, 7.2, 4.2)
        _draw(axes, curve)
        drawn.append((svg_of(figure), curve.title))
    return drawn


def _draw(axes: "Axes", curve: Curve) -> None:
    shown = np.unique(np.linspace(0, curve.x.size - 1, MOST_POINTS).astype(int))
    axes.plot(curve.x[shown], curve.measured[shown], ".", color=MEASURED, markersize=3, label="measured from the files")
    axes.plot(curve.x, curve.model, color=TRUTH, linewidth=1, label=curve.model_label)
    axes.set(xlabel=curve.x_label, ylabel=curve.y_label)
    axes.legend(fontsize="small", edgecolor="none", framealpha=0.9)
