"""When the process of a command searches for unused cycles of objects."""

import atexit
import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager

OBJECTS = 10_000  # new ones that start a search; with Python's 700 a start spends a tenth of its time on it


def search_seldom() -> None:
    """Let this process, which a command has for itself, search seldom, and not at its end."""
    gc.set_threshold(OBJECTS)
    atexit.register(_freeze)


@contextmanager
def without_search() -> Iterator[None]:
    """Search for nothing in this block, nor later among what it made: modules, which live as long as the process.

    A process that does more than one command searches as it does.
    """
    if gc.get_threshold()[0] != OBJECTS or gc.get_freeze_count():
        yield
        return
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _freeze() -> None:
    """Let the interpreter search for no unused cycles at its end, which takes longer than a small frame.

    OpenImageIO is the exception: its bindings report the objects that are left as leaks.
    """
    if "OpenImageIO" not in sys.modules:
        gc.freeze()
