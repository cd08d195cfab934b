"""Consoles of the command line: results go to stdout, progress and notes to stderr."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, ProgressColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bars

from simulator.progress import Progress

log = Console(stderr=True, highlight=False, soft_wrap=True)


class _LogHandler(logging.Handler):
    """Prints what the simulator logs, such as the device it chose."""

    def emit(self, record: logging.LogRecord) -> None:
        log.print(escape(record.getMessage()))


def show_log() -> None:
    """Print on stderr what the simulator logs at level INFO and above."""
    logger = logging.getLogger("simulator")
    logger.setLevel(logging.INFO)
    if not any(isinstance(handler, _LogHandler) for handler in logger.handlers):
        logger.addHandler(_LogHandler())


def console() -> Console:
    """Return a console for results: stdout, 200 columns wide where it is no terminal."""
    # Tables piped into a file keep their text instead of being cut to 80 columns.
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


@contextmanager
def show_progress(first: str, *, prefix: str = "", is_long: bool = True) -> Iterator[Progress]:
    """Show a progress bar on stderr; yields the function that updates it.

    first: text until the first update. prefix: text before that of each update. is_long: show the time that remains, not the
    time that has passed.
    """
    with _bars(TimeRemainingColumn() if is_long else TimeElapsedColumn()) as bars:
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
    """Show a bar without a share done, for work that reports no progress."""
    with _bars(TimeElapsedColumn()) as bars:
        bars.add_task(escape(what), total=None)
        yield


def _bars(time: ProgressColumn) -> Bars:
    """Return bars on stderr that vanish at the end; nothing is shown where stderr is no terminal."""
    columns = TextColumn("{task.description}"), BarColumn(), time
    return Bars(*columns, console=log, transient=True, disable=not log.is_terminal)
