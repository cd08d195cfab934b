"""Timing side by side: contestants take turns, so that a load on the machine meets all of them."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from measuring.record import OURS

TURN_S = 0.15  # fast contestants repeat within a turn until it has lasted this long
LONG_S = 6.0  # processor time of a first run from which on a contestant runs no more often than it must


@dataclass(frozen=True)
class Contestant:
    """One way to make a frame.

    run: makes the frame, and returns when it is made.
    codes: the frame that `run` made last, (height, width), to check that it did the work.
    builds: whether the first run builds kernels, which no time may count.
    """

    name: str
    run: Callable[[], object]
    codes: Callable[[], np.ndarray]
    builds: bool = False


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

    def summary(self) -> dict[str, float]:
        """Best and median wall time, median processor time [s], and how many runs there were."""
        return {
            "best_s": min(self.wall_s),
            "median_s": statistics.median(self.wall_s),
            "cpu_s": statistics.median(self.cpu_s),
            "runs": len(self.wall_s),
        }


def contest(
    contestants: list[Contestant],
    rounds: int,
    progress: Callable[[], None] = lambda: None,
    turn_s: float = TURN_S,
    long_s: float = np.inf,
) -> dict[str, Timing]:
    """Timings by name. A first run of each, not counted, builds kernels and warms caches.

    progress: called behind each turn. turn_s: least length of a turn. long_s: a peer whose first run takes more processor time
    takes no turns, and its first run is counted; one that builds kernels in it takes turns until a run is as long.
    """
    timings = {contestant.name: Timing(contestant.name) for contestant in contestants}
    turns_of = {contestant.name: rounds for contestant in contestants}
    for contestant in contestants:
        first = Timing(contestant.name)
        first.take(contestant.run)
        if first.cpu_s[0] > long_s and not contestant.builds:
            turns_of[contestant.name], timings[contestant.name] = 0, first
    for turn in range(rounds):
        for contestant in contestants:
            timing, spent = timings[contestant.name], 0.0
            while turn < turns_of[contestant.name] and spent < turn_s:
                spent += timing.take(contestant.run)
                if timing.cpu_s[-1] > long_s:
                    turns_of[contestant.name] = 0
            progress()
    return timings


def turns(
    runs: dict[str, Callable[[], object]],
    rounds: int,
    progress: Callable[[], None] = lambda: None,
    turn_s: float = 1e-9,
    long_s: float = np.inf,
) -> dict[str, dict[str, float]]:
    """`Timing.summary` of each, by name; unless told otherwise one run in a turn, after a run that is not counted."""
    contestants = [Contestant(name, run, lambda: np.empty(0), name.startswith(OURS)) for name, run in runs.items()]
    return {name: timing.summary() for name, timing in contest(contestants, rounds, progress, turn_s, long_s).items()}
