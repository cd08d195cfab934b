"""A flash so short that it shows the slit between curtains and its soft edges.

An edge crosses the cone of light that a photosite sees, d / N wide at the distance d of the curtains, while light rises
evenly. So the flash shows the overlap of the exposure and that time; a slit of width a has the efficiency a / (a + d / N)
(Ives, Airplane Photography).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.measurement.shutter_check.case import Curve, Findings, check_number
from simulator.measurement.shutter_check.flash_band import FlashBand, flash_frames, flash_light
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lamp import LampCase, MeasuredScan, measure_slit
from simulator.measurement.shutter_check.scan import crossing_speed

SLIT = 1.0 / 12.0  # of the frame, between curtains
SHORT = 1e-3  # pulse over the time in which a curtain's edge crosses the cone of light
LEAST_RAMP = 4.0  # lines, below which the fit of a penumbra has several solutions


@dataclass(frozen=True)
class CurtainSlitCase:
    """A flash so short that it shows the slit between curtains and its soft edges."""

    lamp: LampCase

    @property
    def time_s(self) -> float:
        """Exposure time."""
        return SLIT * self.lamp.scan.time_s

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return the frames of the flash."""
        scan = self.lamp.scan
        cone = bench.cone
        return flash_frames(bench, scan, self.time_s, SHORT * (cone or 1.0 / bench.lines) * scan.time_s)

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure efficiency and penumbra, with the travel as the lamp shows it."""
        light, found, stated = flash_light(bench, files), self.lamp.find_scan(bench, files), self.lamp.scan
        band = measure_slit(bench, files, found)
        cone, slit = bench.cone, SLIT * crossing_speed(np.array(0.5), stated.bend)
        efficiency, error = slit_efficiency(band, found)
        where = f"{1e3 * self.time_s:.4g} ms"
        ramp_mm = bench.way_mm * band.ramp, bench.way_mm * cone, bench.way_mm * band.ramp_error
        reason = bench.reason_dark_is_clipped
        if cone * bench.lines < LEAST_RAMP:
            reason = f"the penumbra is {cone * bench.lines:.2g} lines wide, too few to fit"
        checks = [
            check_number("slit efficiency", where, efficiency, float(slit / (slit + cone)), error, "", reason),
            check_number("penumbra", where, *ramp_mm, "mm", reason),
        ]
        title = f"slit of {bench.way_mm * float(slit):.3g} mm, by a flash of a moment"
        curve = Curve(title, "line, as opened", "share of the flash", np.arange(light.size), light, band.fit.fitted)
        return Findings(tuple(checks), (curve,))


def slit_efficiency(band: FlashBand, scan: MeasuredScan) -> tuple[float, float]:
    """Return a / (a + d / N) in the middle of the frame and its standard error, the travel as it was measured."""
    speed = float(crossing_speed(np.array(0.5), scan.bend))
    slit, cone = speed * float(band.fit.values[1]), float(band.fit.values[2])
    whole = slit + cone
    derivative = np.array([0.0, speed * cone / whole**2, -slit / whole**2, 0.0, 0.0])
    return slit / whole, band.fit.error_of(derivative)
