"""Figure of a calibration: photon transfer, gain and read noise over ISO, distribution of the read noise, with their fits."""

from typing import TYPE_CHECKING

import numpy as np

from simulator.measurement.calibration.camera_measurement import Calibration
from simulator.measurement.calibration.iso_measurement import IsoMeasurement
from simulator.measurement.report.figures import decade_axis, iso_axis, new_figure
from simulator.measurement.statistics.interval import Interval
from simulator.measurement.statistics.read_noise import ROUNDING_VARIANCE_DN2
from simulator.measurement.statistics.tukey_lambda_fit import difference_shares

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLANE_COLORS = {"R": "#c0392b", "Gr": "#27ae60", "Gb": "#16a085", "B": "#2874a6", "MONO": "#444444"}
DARK, ORANGE, VIOLET = "#222222", "#d35400", "#8e44ad"
SHOWN_SHAPES = 3


def calibration_figure(found: Calibration, title: str) -> "Figure":
    """Draw a calibration. Raises PhotositeError without matplotlib."""
    figure, (transfer, gain, noise, shape) = new_figure(2, 2, 11.0, 8.0)
    figure.suptitle(title)
    _transfer(transfer, found)
    _gain(gain, found)
    _noise(noise, found)
    _shape(shape, found)
    return figure


def _transfer(axes: "Axes", found: Calibration) -> None:
    every = [point.signal_dn for one in found.isos for points in one.points.values() for point in points]
    line = np.geomspace(max(min(every) / 10.0, 0.1), max(every) * 1.2)
    for one in found.isos:
        for name, points in one.points.items():
            signal, variance = zip(*((point.signal_dn, point.variance_dn2) for point in points), strict=True)
            axes.loglog(signal, variance, ".", color=PLANE_COLORS[name], markersize=5)
        current_dn = float(np.mean(list(one.dark.levels_dn.values()))) - one.dark.black_level_dn
        dark_dn2 = one.dark.read_noise_dn.value**2 + ROUNDING_VARIANCE_DN2
        fitted = dark_dn2 + one.gain_dn_per_e.value * (line + current_dn)
        axes.loglog(line, fitted, color="#888888", linewidth=0.8)
        axes.annotate(f"ISO {one.iso}", (line[-1], fitted[-1]), fontsize=7, va="center", clip_on=False)
    for name in found.isos[0].points:
        axes.plot([], [], ".", color=PLANE_COLORS[name], label=name)
    axes.legend(fontsize=8)
    axes.set(title="Photon transfer", xlabel="signal above dark [DN]", ylabel="temporal variance [DN²]")


def _gain(axes: "Axes", found: Calibration) -> None:
    gains, rows = [one.gain_dn_per_e for one in found.isos], [one.dark.row_noise_dn for one in found.isos]
    _bars(axes, found, gains, "K [DN/e-]", DARK)
    _bars(axes, found, rows, "row noise [DN]", VIOLET)
    _axes(axes, found, gains + rows, "Gain and row noise")


def _noise(axes: "Axes", found: Calibration) -> None:
    in_dn, in_e = [one.dark.read_noise_dn for one in found.isos], [one.read_noise_e for one in found.isos]
    _bars(axes, found, in_dn, "read noise [DN]", DARK)
    _bars(axes, found, in_e, "read noise [e-]", ORANGE)
    for part in found.sources:
        gains = np.array([one.gain_dn_per_e.value for one in found.isos if one.iso in part.isos])
        fitted = np.array([part.sigma_dn(gain) for gain in gains])
        label = f"σ_pre {part.before_e.value:.3g} e-, σ_post {part.after_dn.value:.3g} DN"
        axes.plot(part.isos, fitted, color=DARK, linewidth=0.8)
        axes.plot(part.isos, fitted / gains, color=ORANGE, linewidth=0.8, label=label)
    _axes(axes, found, in_dn + in_e, "Read noise, and two sources fitted to it")


def _shape(axes: "Axes", found: Calibration) -> None:
    shaped = [one for one in found.isos if one.dark.shape is not None]
    picked = np.unique(np.linspace(0, len(shaped) - 1, SHOWN_SHAPES).round()).tolist() if shaped else []
    for index, place in enumerate(picked):
        _histogram(axes, shaped[int(place)], 100.0**-index, f"C{index}")
    axes.set(title="Differences of dark frames, and fitted Tukey-lambda noise", yscale="log")
    axes.set(xlabel="difference / its standard deviation", ylabel="density (curves moved apart)")
    if shaped:
        axes.legend(fontsize=8)
        axes.set_ylim(bottom=1e-6 * 100.0 ** (1 - len(picked)))


def _histogram(axes: "Axes", one: IsoMeasurement, factor: float, color: str) -> None:
    """Density of the differences as points and of the fit as a line, both in standard deviations of a difference."""
    if (fit := one.dark.shape) is None:
        return
    sigma_dn = fit.sigma_dn.value
    unit_dn = sigma_dn * np.sqrt(2.0)
    width_dn = max(1.0, round(unit_dn / 8.0))  # a whole number of codes, so that every bin holds equally many codes
    edges = np.arange(-(12.0 * unit_dn // width_dn) - 0.5, 12.0 * unit_dn // width_dn + 1.0) * width_dn
    counts, _ = np.histogram(one.dark.residuals_dn, edges)
    seen = counts > 0
    density = counts / (one.dark.residuals_dn.size * width_dn) * unit_dn * factor
    axes.plot((0.5 * (edges[1:] + edges[:-1]) / unit_dn)[seen], density[seen], ".", color=color, markersize=4)
    cell_dn = min(sigma_dn / 24.0, 0.125)
    half = int(12.0 * unit_dn / cell_dn)
    share = difference_shares(fit.shape.value, sigma_dn, cell_dn, half)
    x, fitted = np.arange(-half, half + 1) * cell_dn / unit_dn, np.maximum(share, 1e-14) / cell_dn * unit_dn * factor
    label = f"ISO {one.iso}: λ = {fit.shape.value:.3f}"
    axes.plot(x, fitted, color=color, linewidth=0.9, label=label)


def _bars(axes: "Axes", found: Calibration, parts: list[Interval], label: str, color: str) -> None:
    told = [(one.iso, part) for one, part in zip(found.isos, parts, strict=True) if part.value > 0]
    if told:
        isos = [iso for iso, _ in told]
        reach = [[part.value - part.low for _, part in told], [part.high - part.value for _, part in told]]
        axes.errorbar(isos, [part.value for _, part in told], reach, fmt=".", color=color, label=label, capsize=2)


def _axes(axes: "Axes", found: Calibration, parts: list[Interval], title: str) -> None:
    values = [part.value for part in parts if part.value > 0]
    iso_axis(axes, [one.iso for one in found.isos])
    axes.set(title=title)
    if values:
        decade_axis(axes, min(values), max(values))
        axes.legend(fontsize=8)
