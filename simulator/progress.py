"""Progress of long work: the signature of the callback, a counter of steps, and a ledger of where the time goes."""

import builtins
import functools
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from threading import get_ident
from typing import Literal, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

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


Work = Literal["import", "build", "device", "files", "host"]
KINDS: tuple[Work, ...] = ("import", "build", "device", "files", "host")


class TimeLedger:
    """Wall time of this thread by kind of work [s], from the start of the process on.

    Work inside other work counts as its own kind alone, so that all kinds add up to the age of the process. What was before the
    ledger is the interpreter's start and imports. On systems without /proc its processor time stands for it.
    seconds: time of each kind, up to the last change of the kind.
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(KINDS, 0.0)
        self._kind: Work = "host"
        self._thread, self._since = get_ident(), time.perf_counter()
        self.seconds["import"] = _process_age_s()

    def switch(self, kind: Work) -> Work:
        """Count the time up to here, and what follows as this kind; returns the kind that it was before."""
        if get_ident() != self._thread:  # the ledger's thread waits for the others, or works beside them
            return kind
        now, before = time.perf_counter(), self._kind
        self.seconds[before] += now - self._since
        self._since, self._kind = now, kind
        return before

    def text(self) -> str:
        """Return the times as a line."""
        self.switch(self._kind)
        parts = ", ".join(f"{kind} {seconds:.3f} s" for kind, seconds in self.seconds.items())
        return f"{parts}; {sum(self.seconds.values()):.3f} s since the process began"


_ledger: TimeLedger | None = None


def open_ledger() -> TimeLedger:
    """Return a ledger that counts the work of this thread from here on, imports included, for the rest of the process."""
    global _ledger
    _ledger = TimeLedger()
    builtins.__import__ = counted_as("import")(builtins.__import__)
    return _ledger


def counted_as(kind: Work) -> Callable[[Callable[Arguments, Result]], Callable[Arguments, Result]]:
    """Return a decorator that counts the time of a function as one kind of work, where there is a ledger."""

    def decorate(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
        @functools.wraps(function)
        def counted(*arguments: Arguments.args, **named: Arguments.kwargs) -> Result:
            if (ledger := _ledger) is None:
                return function(*arguments, **named)
            before = ledger.switch(kind)
            try:
                return function(*arguments, **named)
            finally:
                ledger.switch(before)

        return counted

    return decorate


def _process_age_s() -> float:
    """Return the time since this process began [s]."""
    try:
        started = Path("/proc/self/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[19]  # man 5 proc, field 22
        return time.clock_gettime(time.CLOCK_BOOTTIME) - int(started) / os.sysconf("SC_CLK_TCK")
    except (OSError, AttributeError, ValueError, IndexError):
        return time.process_time()
