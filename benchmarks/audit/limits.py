"""What ends work that nobody waits for: a limit of processor time, and workers whose parent has ended."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from multiprocessing.connection import wait

AGAIN_S = 1.0  # processor time after which the error is raised again, if a callback has swallowed it [s]


@contextmanager
def limited_time(seconds: float, error: Exception) -> Iterator[None]:
    """Raise an error in the block once it has taken so much processor time of all threads.

    It is raised between two calls of compiled code, in the main thread, which this is for.
    """

    def give_up(*_: object) -> None:
        raise error

    before = signal.signal(signal.SIGPROF, give_up)
    signal.setitimer(signal.ITIMER_PROF, seconds, AGAIN_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def end_with_parent() -> None:
    """End this process as soon as the one that started it has ended, whatever it is at. For a pool's workers."""
    parent = parent_process()
    assert parent is not None, "a worker has a parent"

    def watch() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
