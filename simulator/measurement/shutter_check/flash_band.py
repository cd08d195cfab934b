"""A flash: the band that it leaves under a rolling shutter, and the slit and the penumbra of curtains.

The light of a pulse of T_f that meets the exposure T_e of a line is the overlap of two boxes, a trapezoid over the lines:
(T_e + T_f) / T_read of the frame high, with ramps as long as the shorter of the two.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from simulator.measurement.shutter_check.case import Curve, Findings, check_number
from simulator.measurement.shutter_check.fits import Fit, fit_curve, overlap
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lines import line_reader
from simulator.measurement.shutter_check.scan import Scan

SHARE = 0.5  # of saturation, where all of the flash is collected
EXPOSURE, PULSE = 0.2, 0.1  # of the read-out time
MIDDLE = 0.5  # of the time of the scan, at which the flash is fired


@dataclass(frozen=True)
class FlashBand:
    """Fit of a band: its middle, the longer and the shorter box, share of the flash, and light outside of the band."""

    fit: Fit

    @property
    def height(self) -> float:
        """Height of its base, in the unit of the lines' places."""
        return float(self.fit.values[1] + self.fit.values[2])

    @property
    def ramp(self) -> float:
        """Height of a ramp."""
        return float(self.fit.values[2])

    @property
    def height_error(self) -> float:
        """Standard error of the height."""
        return self.fit.error_of(np.array([0.0, 1.0, 1.0, 0.0, 0.0]))

    @property
    def ramp_error(self) -> float:
        """Standard error of the ramp."""
        return float(self.fit.errors()[2])


def measure_band(when: np.ndarray, light: np.ndarray, speed: np.ndarray | float = 1.0) -> FlashBand:
    """Measure the band in the light of each line over that of a flash that all lines see.

    when: share of the time of the scan at which each line is opened, (lines,). light: (lines,).
    speed: of a curtain at the lines over its mean: the shorter box is that of places, and takes a time of box / speed.
    """
    top = float(np.median(light[light > 0.5 * light.max()]))
    inside = np.flatnonzero(light > 0.5 * top)
    middle, width = 0.5 * (when[inside[0]] + when[inside[-1]]), float(when[inside[-1]] - when[inside[0]])
    step = float(np.median(np.diff(when)))
    ramp = max(float(np.sum((light > 0.1 * top) & (light < 0.9 * top))) / 1.6 * step, step)

    def model(values: np.ndarray) -> np.ndarray:
        centre, long, short, share, rest = values
        own = np.abs(short) / speed
        return rest + share * overlap(when - centre, np.abs(long), own) / own

    first = np.array([middle, max(width, 1.1 * ramp), ramp, top, 0.0])
    scale = np.array([step, step, step, 0.01 * top, 0.01 * top])
    fit = fit_curve(model, light, first, scale, _spread(light / top))
    return FlashBand(replace(fit, values=np.append(fit.values[0], np.append(np.abs(fit.values[1:3]), fit.values[3:]))))


def _spread(share: np.ndarray) -> np.ndarray:
    """Return the standard deviation of the share of a flash, (lines,), from how lines without and with all of it scatter.

    The variance of a quotient of two counts is share (1 + share) over the count, and that of the dark.
    """
    dark, full = share[share < 0.02], share[share > 0.98]
    of_dark, of_full = (float(np.var(part)) if part.size > 4 else 0.0 for part in (dark, full))
    level = np.clip(share, 0.0, 1.0)
    of_light = max(of_full - of_dark, 1e-3 * of_dark, 1e-12)
    return np.sqrt(max(of_dark, 1e-3 * of_light) + of_light * 0.5 * level * (1.0 + level))


def flash_frames(bench: ShutterBench, scan: Scan, time_s: float, pulse_s: float) -> list[Frame]:
    """Return a frame in which the flash meets a part of the lines, and one in which all lines see it."""
    wall, all_s = bench.flash_scene(), 1.5 * scan.time_s + 2.0 * pulse_s
    flash = bench.flash(SHARE, pulse_s, MIDDLE * scan.time_s, time_s)
    full = bench.flash(SHARE, pulse_s, 1.1 * scan.time_s, all_s)
    return [
        Frame("flash_all", bench.exposure(all_s, flash=full), scene=wall),
        Frame("flash", bench.exposure(time_s, flash=flash), scene=wall),
    ]


def flash_light(bench: ShutterBench, files: Mapping[str, TakenFrame]) -> np.ndarray:
    """Return the share of the flash that each line collects, (lines,)."""
    reader = line_reader(bench)
    return reader.means(files["flash"]) / reader.means(files["flash_all"])


@dataclass(frozen=True)
class FlashBandCase:
    """A flash of a stated length under a rolling shutter."""

    scan: Scan

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return the frames of the flash."""
        return flash_frames(bench, self.scan, EXPOSURE * self.scan.time_s, PULSE * self.scan.time_s)

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure height and ramps of the band."""
        light = flash_light(bench, files)
        band = measure_band(bench.line_places(light.size), light)
        open_ms, pulse_ms = (1e3 * share * self.scan.time_s for share in (EXPOSURE, PULSE))
        where = f"{open_ms:.4g} + {pulse_ms:.4g} ms"
        lines = bench.lines
        height, ramp = lines * (EXPOSURE + PULSE), lines * min(EXPOSURE, PULSE)
        reason = bench.reason_dark_is_clipped
        checks = (
            check_number("flash band", where, lines * band.height, height, lines * band.height_error, "lines", reason),
            check_number("flash ramp", where, lines * band.ramp, ramp, lines * band.ramp_error, "lines", reason),
        )
        title = f"open for {open_ms:.4g} ms, flash of {pulse_ms:.4g} ms"
        curve = Curve(title, "line, as opened", "share of the flash", np.arange(light.size), light, band.fit.fitted)
        return Findings(checks, (curve,))
