"""What a section is given: how large its work is to be, a folder, and timing with a progress bar."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

from rich.progress import Progress

from measuring.contest import LONG_S, TURN_S, Contestant, Timing, contest, turns
from simulator.device import Device, open_device

Size = Literal["quick", "standard", "full"]
T = TypeVar("T")


@dataclass(frozen=True)
class Run:
    """One run of the benchmark.

    size: quick is to try the scripts, standard is `make bench`, full is `make bench-full`.
    folder: for scenes and files, removed in the end. progress: gets a bar for each contest.
    """

    size: Size
    folder: Path
    progress: Progress

    def pick(self, quick: T, standard: T, full: T) -> T:
        """Return what belongs to the size of this run."""
        return {"quick": quick, "standard": standard, "full": full}[self.size]

    @property
    def rounds(self) -> int:
        """Turns of each contestant."""
        return self.pick(1, 3, 5)

    def device(self) -> Device:
        """The device that a user gets."""
        return open_device()

    def contest(self, what: str, contestants: list[Contestant], turn_s: float = TURN_S) -> dict[str, Timing]:
        """`contest` with a bar."""
        task = self.progress.add_task(f"  {what}", total=self.rounds * len(contestants))
        found = contest(
            contestants, self.rounds, lambda: self.progress.advance(task), self.pick(0.02, turn_s, turn_s), long_s=LONG_S
        )
        self.progress.remove_task(task)
        return found

    def turns(self, what: str, runs: dict[str, Callable[[], object]]) -> dict[str, dict[str, float]]:
        """`turns` with a bar."""
        task = self.progress.add_task(f"  {what}", total=self.rounds * len(runs))
        found = turns(runs, self.rounds, lambda: self.progress.advance(task), self.pick(0.02, 0.06, 0.1), long_s=LONG_S)
        self.progress.remove_task(task)
        return found
