"""Where the command line writes: results to stdout, progress and notes to stderr."""

from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

COUNTED = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())

log = Console(stderr=True, highlight=False, soft_wrap=True)


def console() -> Console:
    """Return a console for results: stdout, 200 columns wide where it is no terminal."""
    # Tables piped into a file keep their text instead of being cut to 80 columns.
    console = Console(highlight=False)
    return console if console.is_terminal else Console(highlight=False, width=200)


@contextmanager
def progress(*columns):
    """Yield a progress bar on stderr that goes away when done; silent where stderr is no terminal."""
    with Progress(*(columns or COUNTED), console=log, transient=True, disable=not log.is_terminal) as bar:
        yield bar
