"""A lamp of known frequency: the time of the scan from the period of its bands, and the depth of its flicker.

Bands of h lines under a lamp of the period T_lamp mean a scan of H lines in T = (H / h) T_lamp (the method of
horshack-dpreview/RollingShutter). A line that is open for T_e sees the modulation m |sinc(f T_e)|.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.exposure.flicker import MainsFlicker
from simulator.measurement.report.tolerance_check import ToleranceCheck
from simulator.measurement.shutter_check.case import Curve, Findings, check_number
from simulator.measurement.shutter_check.fits import Fit, fit_curve, fit_linear
from simulator.measurement.shutter_check.flash_band import FlashBand, flash_light, measure_band
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lines import line_reader
from simulator.measurement.shutter_check.scan import Scan, crossing_share, crossing_speed

MODULATION = 0.5
BANDS = 8.4  # in the frame
TURNS = (0.3, 0.7, 1.0, 1.4)  # exposure times over the period of the lamp; none of the modulation is left at 1
SHARE = 0.4  # of saturation
FLAT = "flat"


@dataclass(frozen=True)
class MeasuredScan:
    """A scan as the bands of a lamp show it, with standard errors; cone: width of the cone of light, of another measurement."""

    time_s: float
    time_error_s: float
    bend: float
    bend_error: float
    cone: float
    fit: Fit


def flat_frame(bench: ShutterBench) -> Frame:
    """Return a frame of steady light, by which others are divided."""
    scan = bench.scan
    return Frame(FLAT, bench.exposure(0.1 if scan is None else 0.5 * scan.time_s), SHARE)


def measure_scan(place: np.ndarray, light: np.ndarray, frequency_hz: float, has_bend: bool, cone: float = 0.0) -> MeasuredScan:
    """Measure the time of a scan from the light of each line, over steady light, under a lamp of one frequency.

    place: share of the way of the scan at which each line lies, (lines,), ascending. light: (lines,).
    has_bend: whether the scan may be accelerated. cone: width of the cone of light at the curtains, as share of their way.
    """
    count = light.size
    padded = 8 * count
    power = np.abs(np.fft.rfft((light - light.mean()) * np.hanning(count), padded))
    bands = float(np.argmax(power)) / padded / float(np.median(np.diff(place)))

    def waves(turns: float, bend: float) -> np.ndarray:
        phase, left = 2.0 * np.pi * turns * crossing_share(place, bend), softened(place, turns, bend, cone)
        return np.stack([np.ones(count), left * np.cos(phase), left * np.sin(phase)], axis=1)

    start = fit_linear(waves(bands, 0.0), light).values
    first = np.append(start, [bands, 0.0] if has_bend else [bands])

    def model(values: np.ndarray) -> np.ndarray:
        return waves(values[3], values[4] if has_bend else 0.0) @ values[:3]

    scale = np.append(np.full(3, 0.01 * float(light.mean())), [0.01, 0.01] if has_bend else [0.01])
    fit = fit_curve(model, light, first, scale)
    errors = fit.errors()
    bend, bend_error = (float(fit.values[4]), float(errors[4])) if has_bend else (0.0, 0.0)
    return MeasuredScan(float(fit.values[3]) / frequency_hz, float(errors[3]) / frequency_hz, bend, bend_error, cone, fit)


def softened(place: np.ndarray, turns: float, bend: float, cone: float) -> np.ndarray:
    """Return what is left of a flicker at lines where a curtain's edge takes a while through the cone of light, (lines,).

    turns: periods of the lamp in the time of the scan.
    """
    return np.sinc(turns * cone / crossing_speed(place, bend))


def measure_depth(
    place: np.ndarray, light: np.ndarray, scan: MeasuredScan, frequency_hz: float, later_s: float
) -> tuple[float, float]:
    """Return the modulation of the light, mean of all lines, and its standard error.

    Below 0 where its phase is opposite to that of the frame in which the scan was measured, as where sinc(f T_e) is below 0.
    later_s: middle of the exposure of the first line after that of the scan's frame.
    """
    left = softened(place, scan.time_s * frequency_hz, scan.bend, scan.cone)
    turns = scan.time_s * frequency_hz * crossing_share(place, scan.bend)
    own = math.atan2(-scan.fit.values[2], scan.fit.values[1]) / (2.0 * math.pi)  # cos(2 pi (turns + own))
    phase = 2.0 * np.pi * (turns + own + frequency_hz * later_s)
    fit = fit_linear(np.stack([np.ones(light.size), left * np.cos(phase), left * np.sin(phase)], axis=1), light)
    mean, along, _ = fit.values
    derivative = float(left.mean()) * np.array([-along / mean**2, 1.0 / mean, 0.0])
    return float(left.mean() * along / mean), fit.error_of(derivative)


def measure_slit(bench: ShutterBench, files: Mapping[str, TakenFrame], scan: MeasuredScan) -> FlashBand:
    """Measure slit and penumbra of curtains in the frames of a flash of a moment, with the travel as it was measured."""
    light = flash_light(bench, files)
    place = bench.line_places(light.size)
    return measure_band(crossing_share(place, scan.bend), light, crossing_speed(place, scan.bend))


@dataclass(frozen=True)
class LampCase:
    """Frames of a lamp at several exposure times."""

    scan: Scan

    @property
    def frequency_hz(self) -> float:
        """Of the lamp, so that there are about BANDS bands; three digits."""
        return float(f"{BANDS / self.scan.time_s:.3g}")

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return a frame for each exposure time, and one of steady light."""
        lamp = MainsFlicker(self.frequency_hz, MODULATION, 50.0)
        times = [turns / self.frequency_hz for turns in TURNS]
        exposures = [bench.exposure(time_s, flicker=lamp) for time_s in times]
        return [flat_frame(bench), *(Frame(f"lamp_{index}", one, SHARE) for index, one in enumerate(exposures))]

    def light(self, bench: ShutterBench, files: Mapping[str, TakenFrame], index: int) -> np.ndarray:
        """Return the light of each line under the lamp over that under steady light, up to a factor."""
        reader = line_reader(bench)
        return reader.means(files[f"lamp_{index}"]) / reader.means(files[FLAT])

    def find_scan(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> MeasuredScan:
        """Measure the scan in the first frame; where a flash shows a penumbra, with its width."""
        light = self.light(bench, files, 0)
        place = bench.line_places(light.size)
        found = measure_scan(place, light, self.frequency_hz, bench.has_curtains)
        if not (bench.has_curtains and "flash" in files):
            return found
        cone = measure_slit(bench, files, found).ramp
        return measure_scan(place, light, self.frequency_hz, True, cone)

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure time of the scan, acceleration, and depth of the flicker."""
        found, stated, lamp = self.find_scan(bench, files), self.scan, f"lamp of {self.frequency_hz:g} Hz"
        name = "travel time" if bench.has_curtains else "read-out time"
        checks = [check_number(name, lamp, 1e3 * found.time_s, 1e3 * stated.time_s, 1e3 * found.time_error_s, "ms")]
        if bench.has_curtains:
            scale = 2e-3 * bench.way_mm / stated.time_s**2  # of the acceleration [m/s^2]
            checks.append(
                check_number("acceleration", lamp, scale * found.bend, scale * stated.bend, scale * found.bend_error, "m/s^2")
            )
        light = self.light(bench, files, 0)
        place = bench.line_places(light.size)
        checks += [self._check_depth(bench, files, index, found, place) for index in range(len(TURNS))]
        mean = found.fit.values[0]
        title = f"lamp of {self.frequency_hz:g} Hz, {1e3 * TURNS[0] / self.frequency_hz:.3g} ms"
        labels = "line, as opened", "light over its mean"
        return Findings(tuple(checks), (Curve(title, *labels, np.arange(light.size), light / mean, found.fit.fitted / mean),))

    def _check_depth(
        self, bench: ShutterBench, files: Mapping[str, TakenFrame], index: int, found: MeasuredScan, place: np.ndarray
    ) -> ToleranceCheck:
        """Check the depth of the flicker at one exposure time."""
        later_s = 0.5 * (TURNS[index] - TURNS[0]) / self.frequency_hz
        depth, error = measure_depth(place, self.light(bench, files, index), found, self.frequency_hz, later_s)
        left = softened(place, self.frequency_hz * self.scan.time_s, self.scan.bend, bench.cone)
        stated = float(MODULATION * np.sinc(TURNS[index]) * left.mean())
        sign = -1.0 if stated < 0 else 1.0
        stated = 0.0 if abs(stated) < 1e-12 else sign * stated
        return check_number("flicker depth", f"f T = {TURNS[index]:g}", sign * depth, stated, error)
