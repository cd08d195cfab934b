"""Progress of long work: the signature of the callback, and a counter of steps."""

from collections.abc import Callable
from dataclasses import dataclass

# Called with the name of the current step and the share of the work that is done, 0 to 1. A lower share starts another task.
Progress = Callable[[str, float], None]


def silent(what: str, share: float) -> None:
    """Ignore the progress."""


@dataclass
class Steps:
    """Counter of steps. progress: is called after each. total: number of steps. done: steps that are done."""

    progress: Progress
    total: int
    done: int = 0

    def add(self, what: str, count: int = 1) -> None:
        """Count steps as done and report them: `what, 3 of 40` and 3 / 40."""
        self.done += count
        self.progress(f"{what}, {self.done} of {self.total}", self.done / self.total if self.total else 1.0)
