"""Work of the host that is done by several threads: NumPy computes most of it without Python's lock."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

THREADS = 2  # more would wait for Python's lock
Item = TypeVar("Item")
Other = TypeVar("Other")
Result = TypeVar("Result")


def in_threads(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return the function of each item, as a loop does."""
    items = list(items)
    if len(items) < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(THREADS) as threads:
        return list(threads.map(function, items))


def both(one: Callable[[], Result], other: Callable[[], Other]) -> tuple[Result, Other]:
    """Return the results of two functions, the first of which runs on a thread of its own."""
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(one)
        of_other = other()
        return waiting.result(), of_other
