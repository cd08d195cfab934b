"""How long work tells what it is doing: one signature for all of it."""

from collections.abc import Callable
from dataclasses import dataclass

# Called with what is done now and the share of the work that is done, from 0 to 1. A share that falls begins another work.
Progress = Callable[[str, float], None]


def silent(what: str, share: float) -> None:
    """Tell nobody."""


@dataclass
class Steps:
    """Work of so many steps. progress: is told of each. total: steps in all. done: steps until now."""

    progress: Progress
    total: int
    done: int = 0

    def add(self, what: str, count: int = 1) -> None:
        """Tell that `count` steps more are done: `what, 3 of 40` and 3 / 40."""
        self.done += count
        self.progress(f"{what}, {self.done} of {self.total}", self.done / self.total if self.total else 1.0)
