"""Figures of an EMVA 1288 report; each shows all colour planes of the camera."""

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from simulator.measurement.emva1288.files_to_planes import EmvaCamera
from simulator.measurement.report.figures import new_figure, svg_of
from simulator.measurement.statistics.photon_transfer import LARGEST_SHARE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = {"R": "#c0392b", "Gr": "#1e8449", "Gb": "#58b368", "B": "#2060b0", "MONO": "#333333"}
TITLES = {
    "photon_transfer": "Photon transfer: temporal variance above dark; the lines are K, fitted up to 70 % of saturation",
    "responsivity": "Mean signal above dark",
    "linearity": "Deviation from the straight line between 5 % and 95 % of saturation",
    "snr": "SNR: measured, and the model without (line) and with DSNU and PRNU (dashed); grey: ideal sensor",
    "dsnu": "Dark signal of the photosites, mean of the stack; grey: a normal distribution as wide",
    "prnu": "Response of the photosites at half saturation, dark taken off; grey: a normal distribution as wide",
    "spectrogram": "Spectrum of the rows of the mean dark frame; flat: no periodic pattern",
}


def emva_figures(found: EmvaCamera) -> dict[str, str]:
    """Draw all figures as SVG elements, by the names of TITLES. Raises PhotositeError when matplotlib is missing."""
    drawn = {}
    for name, draw in _DRAWN.items():
        figure, (axes,) = new_figure(1, 1, 7.2, 4.2)
        draw(axes, found)
        axes.legend(frameon=False, fontsize="small")
        drawn[name] = svg_of(figure)
    return drawn


def emva_overview(found: EmvaCamera, title: str) -> "Figure":
    """Draw six of the curves into one figure. Raises PhotositeError when matplotlib is missing."""
    figure, several = new_figure(2, 3, 15.0, 8.0)
    figure.suptitle(title)
    for axes, (name, draw) in zip(several, list(_DRAWN.items())[:6], strict=True):
        draw(axes, found)
        axes.set_title(textwrap.fill(TITLES[name], 62), fontsize="small")
        axes.legend(frameon=False, fontsize="small")
    return figure


def _photon_transfer(axes: "Axes", found: EmvaCamera) -> None:
    for name, plane in found.planes.items():
        last = int(np.argmax(plane.variance_dn2))
        axes.plot(plane.signal_dn, plane.variance_dn2 - plane.dark.variance_dn2, ".", color=COLORS[name], label=name)
        end = LARGEST_SHARE * plane.signal_dn[last]
        axes.plot([0.0, end], [0.0, plane.gain.value * end], color=COLORS[name], linewidth=0.8)
    axes.set(xlabel="signal above dark [DN]", ylabel="variance above dark [DN²]")
    axes.locator_params(axis="x", nbins=6)


def _responsivity(axes: "Axes", found: EmvaCamera) -> None:
    for name, plane in found.planes.items():
        axes.plot(plane.photons, plane.signal_dn, ".", color=COLORS[name], label=_named(found, name))
        axes.axvline(plane.saturation_photons, color=COLORS[name], linewidth=0.6, linestyle=":")
    axes.set(xlabel=found.light, ylabel="signal above dark [DN]")


def _named(found: EmvaCamera, name: str) -> str:
    """Name of a plane, with the wavelength of its light where that is known."""
    wavelength_nm = found.wavelengths_nm.get(name)
    return name if wavelength_nm is None else f"{name}, {wavelength_nm:g} nm"


def _linearity(axes: "Axes", found: EmvaCamera) -> None:
    for name, plane in found.planes.items():
        share = plane.linearity.photons / plane.saturation_photons
        axes.plot(100.0 * share, 100.0 * plane.linearity.deviation, ".-", color=COLORS[name], linewidth=0.6, label=name)
    axes.axhline(0.0, color="#333333", linewidth=0.8)
    axes.set(xlabel="light [% of saturation]", ylabel="deviation [%]")


def _snr(axes: "Axes", found: EmvaCamera) -> None:
    for name, plane in found.planes.items():
        last = int(np.argmax(plane.variance_dn2))
        kept = slice(None, last + 1)
        measured = plane.signal_dn[kept] / np.sqrt(plane.variance_dn2[kept])
        photons = np.geomspace(plane.threshold_photons / 2.0, plane.saturation_photons, 100)
        axes.plot(plane.photons[kept], measured, ".", color=COLORS[name], label=name)
        axes.plot(photons, plane.snr(photons), color=COLORS[name], linewidth=0.8)
        axes.plot(photons, plane.snr(photons, fixed_pattern=True), "--", color=COLORS[name], linewidth=0.8)
        if found.counts_photons:
            axes.plot(photons, np.sqrt(photons), color="#aaaaaa", linewidth=0.8)
    axes.set(xscale="log", yscale="log", xlabel=found.light, ylabel="SNR")


def _dsnu(axes: "Axes", found: EmvaCamera) -> None:
    scales = {name: 1.0 / plane.gain.value for name, plane in found.planes.items()}
    _histograms(axes, found, {name: stack.mean_dn for name, stack in found.dark_stacks.items()}, scales)
    axes.set_xlabel("offset [e-]")


def _prnu(axes: "Axes", found: EmvaCamera) -> None:
    added = {name: stack.mean_dn - found.dark_stacks[name].mean_dn for name, stack in found.light_stacks.items()}
    _histograms(axes, found, added, {name: 100.0 / float(one.mean()) for name, one in added.items()})
    axes.set_xlabel("deviation [%]")


def _histograms(axes: "Axes", found: EmvaCamera, values_dn: dict[str, np.ndarray], scales: dict[str, float]) -> None:
    """Draw logarithmic histograms about the mean (EMVA 1288), each with the normal distribution of its variance.

    Means of L frames are multiples of 1/L DN, so the bin width is a whole number of these steps.
    """
    for name, one in values_dn.items():
        step, low = 1.0 / found.dark_stacks[name].frames, float(one.min())
        width = step * max(1, round(float(np.ptp(one)) / step / 100.0))
        edges = low - 0.5 * step + width * np.arange(int(np.ptp(one) / width) + 2)
        centres, sd = 0.5 * (edges[1:] + edges[:-1]) - float(one.mean()), max(float(one.std()), step)
        normal = one.size * width / (sd * np.sqrt(2.0 * np.pi)) * np.exp(-0.5 * (centres / sd) ** 2)
        axes.plot(scales[name] * centres, normal, color="#bbbbbb", linewidth=2.0, zorder=1)
        counts = np.histogram(one, edges)[0]
        axes.step(scales[name] * centres, counts, where="mid", color=COLORS[name], linewidth=0.8, label=name)
    axes.set(yscale="log", ylim=(0.5, None), ylabel="photosites")


def _spectrogram(axes: "Axes", found: EmvaCamera) -> None:
    """Draw the root of the mean power spectrum of the rows; white noise of standard deviation s is flat at s (EMVA 1288)."""
    for name, stack in found.dark_stacks.items():
        rows = stack.mean_dn - stack.mean_dn.mean()
        power = np.mean(np.abs(np.fft.rfft(rows, axis=1)) ** 2, axis=0) / rows.shape[1]
        frequency = np.fft.rfftfreq(rows.shape[1])
        gain = found.planes[name].gain.value
        axes.plot(frequency[1:], np.sqrt(power[1:]) / gain, color=COLORS[name], linewidth=0.7, label=name)
    axes.set(ylim=(0.0, None), xlabel="cycles per photosite of the plane", ylabel="standard deviation [e-]")


_DRAWN: dict[str, Callable[["Axes", EmvaCamera], None]] = {
    "photon_transfer": _photon_transfer,
    "responsivity": _responsivity,
    "linearity": _linearity,
    "snr": _snr,
    "dsnu": _dsnu,
    "prnu": _prnu,
    "spectrogram": _spectrogram,
}
