"""Noise against ISO as a picture: measured points over the camera file's curve."""

from typing import TYPE_CHECKING, Any

from simulator.measurement.noise_check.report import NoiseReport
from simulator.measurement.noise_check.tolerance_check import Gate
from simulator.measurement.report.figures import ALLOWED, FAILED, MEASURED, TRUTH, decade_axis, iso_axis, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def noise_figure(report: NoiseReport) -> "Figure":
    """Read noise and dynamic range against ISO, and how far K and read noise lie from the camera file.

    Raises PhotositeError when matplotlib is missing.
    """
    figure, (read, stops, k_error, read_error) = new_figure(2, 2, 11.0, 7.0)
    figure.suptitle(f"{report.camera}: noise measured from {report.frames} raw files, over the camera file's numbers")
    gains = {gate.where: gate.expected for gate in report.of("K")}
    noise_e = [gate.expected / gains[gate.where] for gate in report.of("read noise")]
    _over_iso(read, report, "read noise", gains)
    read.set_ylabel("read noise [e-]")
    if min(noise_e) > 0:
        decade_axis(read, min(noise_e), max(noise_e))
    _over_iso(stops, report, "dynamic range", {})
    stops.set_ylabel("dynamic range [stops]")
    stops.legend(frameon=False)
    _deviations(k_error, report, "K")
    _deviations(read_error, report, "read noise")
    return figure


def _over_iso(axes: "Axes", report: NoiseReport, quantity: str, per: dict[str, float]) -> None:
    """Expected line and measured points, divided by `per` of the same ISO; hollow where nothing is asked of them."""
    isos, gates = [point.iso for point in report.points], report.of(quantity)
    expected = [gate.expected / per.get(gate.where, 1.0) for gate in gates]
    axes.plot(isos, expected, color=TRUTH, linewidth=1, label="camera file")
    for iso, gate in zip(isos, gates, strict=True):
        label, measured = "measured from the files" if iso == isos[0] else None, gate.measured / per.get(gate.where, 1.0)
        axes.plot(iso, measured, "o", label=label, color=_color(gate), fillstyle=_fill(gate), markersize=5)
    iso_axis(axes, isos)


def _deviations(axes: "Axes", report: NoiseReport, quantity: str) -> None:
    """Relative deviations with 95 % intervals, over the band that is allowed."""
    isos, gates = [point.iso for point in report.points], report.of(quantity)
    tolerance = 100.0 * gates[0].tolerance
    axes.axhspan(-tolerance, tolerance, color=ALLOWED, zorder=0)
    axes.axhline(0.0, color=TRUTH, linewidth=1)
    for iso, gate in zip(isos, gates, strict=True):
        if gate.expected > 0:
            deviation, reach = 100.0 * gate.deviation, 196.0 * gate.error
            style: dict[str, Any] = {"color": _color(gate), "fillstyle": _fill(gate), "markersize": 4, "elinewidth": 1}
            axes.errorbar(iso, deviation, reach, fmt="o", **style)
    axes.set_ylabel(f"{quantity}: measured / file - 1 [%]")
    axes.set_title(f"shaded: allowed, +- {tolerance:g} %; bars: 95 % intervals", fontsize="medium")
    iso_axis(axes, isos)


def _color(gate: Gate) -> str:
    return MEASURED if gate.passed else FAILED


def _fill(gate: Gate) -> str:
    return "none" if gate.ungated else "full"
