"""Memory for large buffers: huge pages, which cost a tenth of the page faults."""

import mmap
import weakref
from collections import deque
from collections.abc import Callable

import numpy as np

LARGE_BYTES = 2**22  # of buffers that get huge pages on a device that works on the host's memory
HAS_HUGE_PAGES = hasattr(mmap, "MADV_HUGEPAGE")  # Linux has


class HugePages:
    """Memory for large buffers of one queue, whose commands run in order: huge pages, which cost a tenth of the page faults.

    A driver takes fresh memory for each buffer, and Linux clears it page by page: of 300 MB that is three times what a kernel
    needs to fill them. A command may still use memory when the last reference to it is gone. So it is kept until the queue has
    come past what had been enqueued by then.
    mark: returns a function that tells whether the queue has come past what is enqueued now.
    """

    def __init__(self, mark: Callable[[], Callable[[], bool]]) -> None:
        self._mark = mark
        self._retired: deque[tuple[Callable[[], bool], mmap.mmap]] = deque()  # in the order of the queue

    def take(self, size: int) -> np.ndarray:
        """Return an array of zeros (size,) uint8 at the start of a page. Raises OSError when it does not fit."""
        self._release()
        pages = mmap.mmap(-1, size, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)
        pages.madvise(mmap.MADV_HUGEPAGE)
        array = np.frombuffer(pages, np.uint8)
        weakref.finalize(array, self._retire, pages).atexit = False
        return array

    def _retire(self, pages: mmap.mmap) -> None:
        self._retired.append((self._mark(), pages))

    def _release(self) -> None:
        """Give back the memory that no command uses."""
        while self._retired:
            is_past, pages = self._retired.popleft()
            if not is_past():
                self._retired.appendleft((is_past, pages))
                return
