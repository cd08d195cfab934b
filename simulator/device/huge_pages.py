"""Memory for large arrays and buffers: huge pages, which cost a tenth of the page faults, and are used again."""

import ctypes
import mmap
import os
import weakref
from collections import deque
from collections.abc import Callable
from threading import Lock

import numpy as np

LARGE_BYTES = 2**22  # of arrays that get huge pages
MOST_FREE_BYTES = 2**28  # that are kept for the next arrays
MOST_LARGER = 1.5  # times an array, memory that it may take
HAS_HUGE_PAGES = hasattr(mmap, "MADV_HUGEPAGE")  # Linux has
_PAGE_BYTES = 2**21  # sizes are rounded up to these, so that arrays of nearly the same size can follow each other


class HugePages:
    """Memory for large arrays and buffers of one queue, whose commands run in order.

    A driver takes fresh memory for each buffer, and Linux clears it page by page: of 300 MB that is three times what a kernel
    needs to fill them. Huge pages are cleared in half of the time, and memory that nobody uses any more is not cleared again.
    A command may still use memory when the last reference to it is gone. So it is kept until the queue has come past what had
    been enqueued by then.
    mark: returns a function that tells whether the queue has come past what is enqueued now. most_free_bytes: kept for the
    next arrays. What was given back longest ago goes first, also where new memory is needed, so that the peak does not grow.
    """

    def __init__(self, mark: Callable[[], Callable[[], bool]], most_free_bytes: int = MOST_FREE_BYTES) -> None:
        self._mark, self._most_free_bytes, self._process = mark, most_free_bytes, os.getpid()
        self._retired: deque[tuple[Callable[[], bool], mmap.mmap]] = deque()  # in the order of the queue
        self._free: list[mmap.mmap] = []  # in the order in which they were given back
        self._taking = Lock()  # never held by `_retire`, which the garbage collector may call at any place

    def take(self, size: int) -> np.ndarray:
        """Return an uninitialised array (size,) uint8 at the start of a page. Raises OSError when it does not fit.

        Its memory is used again when no array uses it: neither this one nor a view of it.
        """
        whole = -(-size // _PAGE_BYTES) * _PAGE_BYTES
        with self._taking:
            self._release()
            fitting = [pages for pages in self._free if whole <= len(pages) <= MOST_LARGER * whole]
            if fitting:
                pages = min(reversed(fitting), key=len)
                self._free.remove(pages)
            else:
                self._shrink(sum(map(len, self._free)) - whole)
                pages = _new_pages(whole)
        owner = (ctypes.c_uint8 * len(pages)).from_buffer(pages)  # every view refers to it, whatever arrays lie between
        weakref.finalize(owner, self._retire, pages).atexit = False
        return np.frombuffer(memoryview(owner), np.uint8, size)

    def _retire(self, pages: mmap.mmap) -> None:
        if os.getpid() == self._process:  # a forked one has no queue
            self._retired.append((self._mark(), pages))

    def _release(self) -> None:
        """Free the memory that no command uses."""
        while self._retired and self._retired[0][0]():
            self._free.append(self._retired.popleft()[1])
        self._shrink(self._most_free_bytes)

    def _shrink(self, most_bytes: int) -> None:
        """Give free memory back to the system until so much is left at most."""
        while self._free and sum(map(len, self._free)) > most_bytes:
            del self._free[0]


def _new_pages(size: int) -> mmap.mmap:
    pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
    pages.madvise(mmap.MADV_HUGEPAGE)
    return pages
