"""Timing side by side: contestants take turns, so that a load on the machine meets all of them."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

TURN_S = 0.25  # fast contestants repeat within a turn until it has lasted this long


@dataclass(frozen=True)
class Contestant:
    """One way to make a frame.

    run: makes the frame, and returns when it is made.
    codes: the frame that `run` made last, (height, width), to check that it did the work.
    """

    name: str
    run: Callable[[], object]
    codes: Callable[[], np.ndarray]


@dataclass
class Timing:
    """Run times of one contestant. cpu_s: over all threads of the process."""

    name: str
    wall_s: list[float] = field(default_factory=list)
    cpu_s: list[float] = field(default_factory=list)

    def take(self, run: Callable[[], object]) -> float:
        """Time one run; returns its wall time [s]."""
        cpu, wall = time.process_time(), time.perf_counter()
        run()
        self.wall_s.append(time.perf_counter() - wall)
        self.cpu_s.append(time.process_time() - cpu)
        return self.wall_s[-1]

    def summary(self, megapixels: float) -> dict[str, object]:
        """Figures for the table and the JSON."""
        best, median = min(self.wall_s), statistics.median(self.wall_s)
        return {
            "name": self.name,
            "best_s": best,
            "median_s": median,
            "cpu_s": statistics.median(self.cpu_s),
            "mpixel_per_s": megapixels / best,
            "median_mpixel_per_s": megapixels / median,
            "runs": len(self.wall_s),
        }


def contest(
    contestants: list[Contestant], rounds: int, progress: Callable[[], None] = lambda: None, turn_s: float = TURN_S
) -> dict[str, Timing]:
    """Timings by name. A first run of each, not counted, builds kernels and warms caches. turn_s: least length of a turn."""
    for contestant in contestants:
        contestant.run()
    timings = {contestant.name: Timing(contestant.name) for contestant in contestants}
    for _ in range(rounds):
        for contestant in contestants:
            spent = 0.0
            while spent < turn_s:
                spent += timings[contestant.name].take(contestant.run)
            progress()
    return timings


def turns(runs: dict[str, Callable[[], object]], rounds: int) -> dict[str, dict[str, float]]:
    """Best wall and median processor time [s] of each, one run in a turn, after a run that is not counted."""
    contestants = [Contestant(name, run, lambda: np.empty(0)) for name, run in runs.items()]
    timings = contest(contestants, rounds, turn_s=1e-9)
    return {name: {"best_s": min(timing.wall_s), "cpu_s": statistics.median(timing.cpu_s)} for name, timing in timings.items()}
