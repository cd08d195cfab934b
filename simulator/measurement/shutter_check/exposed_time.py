"""Steady light: how long lines are open in effect, from the electrons of three exposure times.

Two long exposures in the same light tell the rate; what a short one collects over that rate is its effective time. So no
shutter is needed that is known to be exact.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from simulator.exposure.shutter import AnyShutter, FirstCurtainShutter, GlobalShutter, LeafShutter
from simulator.measurement.shutter_check.case import Curve, Findings, check_number, mean_of
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame
from simulator.measurement.shutter_check.lines import line_reader
from simulator.measurement.shutter_check.scan import crossing_share

SHARE = 0.6  # of saturation, in the longest
END = 1.0 / 16.0  # of the frame, over which lines at its ends are averaged


def effective_share(short: np.ndarray, middle: np.ndarray, long: np.ndarray, times_s: tuple[float, ...]) -> np.ndarray:
    """Return the effective over the nominal time of each line, (lines,).

    short, middle, long: light of each line at times_s, the last two longer than any opening and closing.
    """
    rate = (long - middle) / (times_s[2] - times_s[1])
    return short / rate / times_s[0]


def slowest_s(shutter: AnyShutter) -> float:
    """Return the time by which the exposure of a line may differ from the nominal one [s]; 0 for an exact shutter."""
    if isinstance(shutter, LeafShutter):
        return shutter.opening_s + shutter.closing_s
    if isinstance(shutter, FirstCurtainShutter):
        return max(shutter.reset_time_s, shutter.travel_time_s)
    return 0.0


@dataclass(frozen=True)
class ExposedTimeCase:
    """Steady light at three exposure times. time_s: the shortest, which is measured."""

    time_s: float

    def times_s(self, bench: ShutterBench) -> tuple[float, float, float]:
        """Return the three exposure times."""
        middle_s = 2.0 * self.time_s + 2.0 * slowest_s(bench.shutter)
        return self.time_s, middle_s, 2.0 * middle_s

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return a frame for each."""
        times_s = self.times_s(bench)
        return [Frame(f"light_{index}", bench.exposure(time_s), SHARE, times_s[2]) for index, time_s in enumerate(times_s)]

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure the efficiency; of an electronic first curtain that of the first and of the last lines."""
        reader, times_s = line_reader(bench), self.times_s(bench)
        short, middle, long = (reader.means(files[f"light_{index}"]) for index in range(3))
        share, where = effective_share(short, middle, long, times_s), f"{1e3 * self.time_s:.4g} ms"
        stated = stated_share(bench, self.time_s, share.size)
        name = "efficiency" if isinstance(bench.shutter, LeafShutter) else "effective / nominal"
        checks = []
        for part, lines in line_parts(bench.shutter, share.size).items():
            mean, error = mean_of(share[lines])
            checks.append(check_number(name, where + part, mean, float(stated[lines].mean()), error))
        title = f"steady light, {where}"
        labels = "line", "effective over nominal time"
        curve = Curve(title, *labels, np.arange(share.size), share, stated, model_label="stated")
        return Findings(tuple(checks), (curve,))


def line_parts(shutter: AnyShutter, count: int) -> dict[str, slice]:
    """Return the lines to average, by what to call them; first and last lines where exposures differ."""
    if not isinstance(shutter, FirstCurtainShutter):
        return {"": slice(0, count)}
    end = max(round(END * count), 2)
    return {", first lines": slice(0, end), ", last lines": slice(count - end, count)}


def stated_share(bench: ShutterBench, time_s: float, count: int) -> np.ndarray:
    """Return the effective over the nominal time of each line, by the numbers of the shutter, (lines,)."""
    shutter = bench.shutter
    if isinstance(shutter, LeafShutter):
        return np.full(count, leaf_efficiency(shutter, time_s, bench.f_number))
    if isinstance(shutter, GlobalShutter) and shutter.parasitic_light > 0 and shutter.scan_order != "none":
        wait_s = bench.readout_s * (bench.line_places(count) - 0.5 / bench.lines)
        return 1.0 + shutter.parasitic_light * wait_s / time_s
    if not isinstance(shutter, FirstCurtainShutter):
        return np.ones(count)
    place = bench.line_places(count)
    closing, reset = (
        way_s * (crossing_share(place, bend) - crossing_share(np.array(0.5), bend))
        for way_s, bend in (
            (shutter.travel_time_s, bench.bend_of(shutter.acceleration_m_per_s2, shutter.travel_time_s)),
            (shutter.reset_time_s, bench.bend_of(shutter.reset_acceleration_m_per_s2, shutter.reset_time_s)),
        )
    )
    return 1.0 + (closing - reset) / time_s


def leaf_efficiency(shutter: LeafShutter, time_s: float, f_number: float) -> float:
    """Return 1 - (opening + closing) / (2 T) where the blades open fully; T / 2 of the way where they turn back.

    A smaller aperture, (widest / N)^2 of the area, is uncovered in that share of the times.
    """
    pupil = 1.0 if shutter.widest_f_number is None else min(1.0, (shutter.widest_f_number / f_number) ** 2)
    both_s = shutter.opening_s + shutter.closing_s
    if pupil * both_s <= time_s:
        return 1.0 - 0.5 * pupil * both_s / time_s
    return 0.5 * time_s / (pupil * both_s)
