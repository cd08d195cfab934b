"""Plots of a camera at one or several ISOs: SNR against exposure, photon transfer, noise and dynamic range against ISO."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from simulator.measurement.curves.code_response import code_moments, electrons_below_white, electrons_per_lx_s, sensor_alone
from simulator.measurement.quantities.dynamic_range import photographic_range, range_figures
from simulator.measurement.quantities.quantity import Curve
from simulator.measurement.report.plot import Line, Plot
from simulator.pipeline.explain.noise_budget import noise_budget
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import SensorPlan
from simulator.units import Seconds

POINTS = 121  # of a smooth curve
LEAST_ELECTRONS = 0.1  # at which curves over the signal begin [e-]
MOST_ISOS = 5  # of a plot over the signal


@dataclass(frozen=True, eq=False)
class CameraSetting:
    """A camera at an exposure time.

    time_s: exposure time, which dark current depends on [s]. isos: those of the curves over the signal, ascending.
    """

    camera: Camera
    time_s: Seconds
    isos: tuple[int, ...]

    @classmethod
    def of(cls, camera: Camera, time_s: Seconds, isos: Sequence[int] = ()) -> Self:
        """Return the setting at these ISOs; none: up to MOST_ISOS of the camera's, in even steps of their logarithms."""
        return cls(camera, time_s, tuple(sorted(set(isos))) or spread_isos(camera.isos, MOST_ISOS))

    def sensor(self, iso: int) -> SensorPlan:
        """Return the sensor at an ISO. Raises PhotositeError for one that the camera does not have."""
        return sensor_alone(self.camera, iso, self.time_s)


def spread_isos(isos: Sequence[int], most: int) -> tuple[int, ...]:
    """Return at most this many of some ISOs: the lowest, the highest and those nearest to even ratios between."""
    wanted = np.geomspace(isos[0], isos[-1], min(most, len(isos)))
    return tuple(sorted({min(isos, key=lambda iso: abs(np.log(iso / one))) for one in wanted}))


def snr_plot(setting: CameraSetting) -> Plot:
    """Return the signal-to-noise ratio over the luminous exposure at each ISO of the setting.

    SNR = (mean code - mean code in the dark) / sigma, sigma^2 the temporal variance (EMVA 1288 R4.0 Linear). The exposure is
    that of daylight (D55) on the first colour to saturate; photoelectrons, of a camera that does not respond to daylight.
    """
    lines = []
    for iso in setting.isos:
        sensor = setting.sensor(iso)
        electrons, per_lx_s = electrons_below_white(sensor, LEAST_ELECTRONS, POINTS), electrons_per_lx_s(sensor)
        signal = code_moments(sensor, electrons)
        snr = (signal.mean - sensor.moments(0.0).mean) / np.sqrt(signal.variance)
        if per_lx_s > 0:
            curve = Curve(electrons / per_lx_s, snr, "luminous exposure", "lx s", "SNR", "")
        else:
            curve = Curve(electrons, snr, "signal", "e-", "SNR", "")
        lines.append(Line(curve, f"ISO {iso}"))
    note = "Temporal noise of one photosite, up to the white level; daylight (D55) on the colour that saturates first."
    return _over_signal("snr", "Signal-to-noise ratio against exposure", lines, f"{note} {_timed(setting)}")


def photon_transfer_plot(setting: CameraSetting) -> Plot:
    """Return the temporal noise over the signal above dark at each ISO, both in codes (Janesick, Photon Transfer, 2007).

    sigma = K sqrt(n + ...) has slope 1/2 where photons are counted, and is level where the noise of the dark prevails.
    """
    lines = []
    for iso in setting.isos:
        sensor = setting.sensor(iso)
        signal = code_moments(sensor, electrons_below_white(sensor, LEAST_ELECTRONS, POINTS))
        above_dn = signal.mean - sensor.moments(0.0).mean
        shown = above_dn > 0  # not where a camera without pedestal clips noise at code 0
        curve = Curve(above_dn[shown], np.sqrt(signal.variance[shown]), "signal above dark", "DN", "temporal noise", "DN")
        lines.append(Line(curve, f"ISO {iso}"))
    note = f"Temporal noise of one photosite with rounding, up to the white level. {_timed(setting)}"
    return _over_signal("photon_transfer", "Photon transfer", lines, note)


def noise_plot(setting: CameraSetting) -> Plot:
    """Return the noise in the dark over all ISOs of the camera, referred to photoelectrons: sigma / K [e-]."""
    isos = setting.camera.isos
    found = [noise_budget(setting.sensor(iso), 0.0, iso, setting.time_s) for iso in isos]
    dark_e = np.array([one.dark_sigma_dn / one.gain_dn_per_e for one in found])
    line = Line(
        Curve(np.array(isos, np.float64), dark_e, "ISO", "", "noise in the dark", "e-"), "temporal noise", has_points=True
    )
    note = f"Temporal noise without light, rounding and row noise included, over K. {_timed(setting)}"
    return Plot("noise", "Noise against ISO", (line,), note, x_scale="iso", y_scale="log")


def dynamic_range_plot(setting: CameraSetting) -> Plot:
    """Return engineering and photographic dynamic range over all ISOs of the camera [EV] (`range_figures`)."""
    isos = setting.camera.isos
    sensors = [setting.sensor(iso) for iso in isos]
    ranges = {
        "engineering, from SNR 1": [range_figures(one, 1.0)["range_ev"].value for one in sensors],
        "photographic (PDR)": [photographic_range(one)["range_ev"].value for one in sensors],
    }
    lines = []
    for label, values in ranges.items():
        stops = np.array(values)
        shown = np.isfinite(stops)
        curve = Curve(np.array(isos, np.float64)[shown], stops[shown], "ISO", "", "dynamic range", "EV")
        lines.append(Line(curve, label, has_points=True))
    note = f"From white down to an SNR of 1, and to one of 20 in the circle of confusion (Photons to Photos). {_timed(setting)}"
    return Plot("dynamic_range", "Dynamic range against ISO", tuple(lines), note, x_scale="iso")


def _over_signal(name: str, title: str, lines: Sequence[Line], note: str) -> Plot:
    return Plot(name, title, tuple(lines), note, x_scale="log", y_scale="log", is_ordered=len(lines) > 1)


def _timed(setting: CameraSetting) -> str:
    return f"Exposure time {setting.time_s:g} s."
