"""Figure of a noise report: measured points against ISO over the camera file's curve."""

from typing import TYPE_CHECKING, Any

from simulator.measurement.noise_check.report import NoiseReport
from simulator.measurement.report.figures import ALLOWED, FAILED, MEASURED, TRUTH, decade_axis, iso_axis, new_figure
from simulator.measurement.report.tolerance_check import ToleranceCheck

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def noise_figure(report: NoiseReport) -> "Figure":
    """Draw read noise and dynamic range against ISO, and the deviations of K and read noise from the camera file.

    Raises PhotositeError when matplotlib is missing.
    """
    figure, (read, stops, k_error, read_error) = new_figure(2, 2, 11.0, 7.0)
    figure.suptitle(f"{report.camera}: noise measured from {report.frames} raw files, over the camera file's numbers")
    gains = {check.where: check.expected for check in report.of("K")}
    noise_e = [check.expected / gains[check.where] for check in report.of("read noise")]
    _draw_over_iso(read, report, "read noise", gains)
    read.set_ylabel("read noise [e-]")
    if min(noise_e) > 0:
        decade_axis(read, min(noise_e), max(noise_e))
    _draw_over_iso(stops, report, "dynamic range", {})
    stops.set_ylabel("dynamic range [stops]")
    stops.legend(frameon=False)
    _draw_deviations(k_error, report, "K")
    _draw_deviations(read_error, report, "read noise")
    return figure


def _draw_over_iso(axes: "Axes", report: NoiseReport, quantity: str, per: dict[str, float]) -> None:
    """Draw the expected line and the measured points, divided by `per` of the same ISO; unchecked points are hollow."""
    isos, checks = [point.iso for point in report.points], report.of(quantity)
    expected = [check.expected / per.get(check.where, 1.0) for check in checks]
    axes.plot(isos, expected, color=TRUTH, linewidth=1, label="camera file")
    for iso, check in zip(isos, checks, strict=True):
        label, measured = "measured from the files" if iso == isos[0] else None, check.measured / per.get(check.where, 1.0)
        axes.plot(iso, measured, "o", label=label, color=_color(check), fillstyle=_fill(check), markersize=5)
    iso_axis(axes, isos)


def _draw_deviations(axes: "Axes", report: NoiseReport, quantity: str) -> None:
    """Draw relative deviations with their 95 % intervals over the band of the tolerance."""
    isos, checks = [point.iso for point in report.points], report.of(quantity)
    tolerance = 100.0 * checks[0].tolerance
    axes.axhspan(-tolerance, tolerance, color=ALLOWED, zorder=0)
    axes.axhline(0.0, color=TRUTH, linewidth=1)
    for iso, check in zip(isos, checks, strict=True):
        if check.expected > 0:
            deviation, reach = 100.0 * check.deviation, 196.0 * check.error
            style: dict[str, Any] = {"color": _color(check), "fillstyle": _fill(check), "markersize": 4, "elinewidth": 1}
            axes.errorbar(iso, deviation, reach, fmt="o", **style)
    axes.set_ylabel(f"{quantity}: measured / file - 1 [%]")
    axes.set_title(f"shaded: allowed, +- {tolerance:g} %; bars: 95 % intervals", fontsize="medium")
    iso_axis(axes, isos)


def _color(check: ToleranceCheck) -> str:
    return MEASURED if check.passed else FAILED


def _fill(check: ToleranceCheck) -> str:
    return "none" if check.reason_unchecked else "full"
