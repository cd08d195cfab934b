"""A global shutter's parasitic light: a strong flash after the exposure, over a weak one within it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.exposure.shutter import GlobalShutter
from simulator.measurement.shutter_check.case import Curve, Findings, check_number, mean_of
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lines import line_reader

SHARE = 0.5  # of saturation, within the exposure, and of what leaks in after it
AFTER, PULSE = 0.25, 0.01  # of the read-out time, from the end of the exposure to the flash and for which it lasts
FROM = 0.5  # place of the first line that is averaged: it is read long after the flash


@dataclass(frozen=True)
class ParasiticLightCase:
    """Flashes within and after the exposure. readout_s: in which all lines are read."""

    time_s: float
    readout_s: float

    def leak(self, bench: ShutterBench) -> float:
        """Share of the light that leaks in, by the shot."""
        return bench.shutter.parasitic_light if isinstance(bench.shutter, GlobalShutter) else 0.0

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return a frame with the flash within the exposure, and one with a flash that leaks in as much."""
        pulse_s = min(PULSE * self.readout_s, 0.1 * self.time_s)
        within = bench.flash(SHARE, pulse_s, 0.5 * self.time_s, self.time_s)
        after = bench.flash(SHARE / self.leak(bench), pulse_s, self.time_s + AFTER * self.readout_s, self.time_s)
        wall = bench.flash_scene()
        flashes = {"flash_within": within, "flash_after": after}
        return [Frame(name, bench.exposure(self.time_s, flash=flash), scene=wall) for name, flash in flashes.items()]

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure the share of the light that leaks in, in lines that wait for their read-out."""
        reader, leak = line_reader(bench), self.leak(bench)
        light = leak * reader.means(files["flash_after"]) / reader.means(files["flash_within"])
        place = bench.line_places(light.size)
        mean, error = mean_of(light[place > FROM])
        later_ms = 1e3 * AFTER * self.readout_s
        where, title = f"flash {later_ms:.3g} ms later", f"light of a flash {later_ms:.3g} ms after the exposure"
        stated = np.where(place > AFTER + PULSE, leak, 0.0)
        labels = "line, as read", "light over that within the exposure"
        curve = Curve(title, *labels, np.arange(light.size), light, stated, "stated")
        return Findings((check_number("parasitic light", where, mean, leak, error),), (curve,))
