"""Consoles of the command line: results go to stdout, progress and notes to stderr."""

import functools
import logging
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from simulator.progress import Progress, silent

if TYPE_CHECKING:  # rich takes longer to import than a small frame to compute, and is needed on terminals alone
    from rich.console import Console
    from rich.progress import Progress as Bars


def tell(text: str) -> None:
    """Print a line on stderr, above the progress bars where there are any."""
    if is_terminal():
        _log().print(text, markup=False, emoji=False)
    else:
        print(text, file=sys.stderr)


def show_files(*files: Path | None, is_data: bool = False) -> None:
    """Print the path of each written file alone on its line, whole, so that a terminal can make it a link; None: no file.

    is_data: stdout holds JSON or CSV for programs, so the paths go to stderr.
    """
    for file in files:
        if file is not None:
            print(file, file=sys.stderr if is_data else sys.stdout)


def is_terminal() -> bool:
    """Whether stderr shows colours and progress; a terminal that cannot move its cursor does not."""
    can_move = os.environ.get("TERM", "").lower() not in ("dumb", "unknown")
    return (sys.stderr.isatty() and can_move) or bool(os.environ.get("FORCE_COLOR"))


@functools.cache
def _log() -> "Console":
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True)


class _LogHandler(logging.Handler):
    """Prints what the simulator logs, such as the device it chose."""

    def emit(self, record: logging.LogRecord) -> None:
        tell(record.getMessage())


def show_log() -> None:
    """Print on stderr what the simulator logs at level INFO and above."""
    logger = logging.getLogger("simulator")
    logger.setLevel(logging.INFO)
    if not any(isinstance(handler, _LogHandler) for handler in logger.handlers):
        logger.addHandler(_LogHandler())


def console() -> "Console":
    """Return a console for results: stdout, 200 columns wide where it is no terminal."""
    from rich.console import Console

    # Tables piped into a file keep their text instead of being cut to 80 columns.
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


@contextmanager
def show_progress(first: str, *, prefix: str = "", is_long: bool = True) -> Iterator[Progress]:
    """Show a progress bar on stderr, where it is a terminal; yields the function that updates it.

    first: text until the first update. prefix: text before that of each update. is_long: show the time that remains, not the
    time that has passed.
    """
    if not is_terminal():
        yield silent
        return
    from rich.markup import escape

    with _bars(is_long) as bars:
        task, last = bars.add_task(escape(first), total=1.0), 0.0

        def update(what: str, share: float) -> None:
            nonlocal last
            if share < last:
                bars.reset(task)
            last = share
            bars.update(task, completed=share, description=escape(prefix + what))

        yield update


@contextmanager
def show_waiting(what: str) -> Iterator[None]:
    """Show a bar without a share done, where stderr is a terminal, for work that reports no progress."""
    if not is_terminal():
        yield
        return
    from rich.markup import escape

    with _bars(is_long=False) as bars:
        bars.add_task(escape(what), total=None)
        yield


def _bars(is_long: bool) -> "Bars":
    """Return bars on stderr that vanish at the end. is_long: with the time that remains, not the time that has passed."""
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn() if is_long else TimeElapsedColumn()
    return Bars(*columns, console=_log(), transient=True)
