"""The arrays of a frame, put together from its strips: in memory, or in files where the frame is large."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from simulator.atomic_files import scratch_folder
from simulator.raw.disk_arrays import disk_array, give_back

# Makes an array for the whole frame. name: of the quantity. shape, dtype: of the array.
Allocate = Callable[[str, tuple[int, ...], np.dtype], np.ndarray]


def in_memory(_name: str, shape: tuple[int, ...], dtype: np.dtype) -> np.ndarray:
    """Make an array in memory."""
    return np.empty(shape, dtype)


@contextmanager
def on_disk(path: Path) -> Iterator[Allocate]:
    """Make arrays in files of a folder beside `path`, which are removed in the end.

    Raises PhotositeError when they do not fit on the disk.
    """
    with scratch_folder(path) as folder:
        yield lambda name, shape, dtype: disk_array(folder / name, shape, dtype)


class FrameArrays:
    """Arrays of a frame by name, filled strip by strip from the top; those of a frame of one strip are the strip's own."""

    def __init__(self, rows: int, allocate: Allocate) -> None:
        self._rows, self._allocate, self._next_row = rows, allocate, 0
        self.arrays: dict[str, np.ndarray] = {}

    def append(self, strip: dict[str, np.ndarray]) -> None:
        """Append the arrays of the next strip, (rows, ...) each. Raises OSError when a file for them has no room."""
        rows = len(next(iter(strip.values())))
        if rows == self._rows:
            self.arrays = strip
            return
        for name, part in strip.items():
            if name not in self.arrays:
                self.arrays[name] = self._allocate(name, (self._rows, *part.shape[1:]), part.dtype)
            self.arrays[name][self._next_row : self._next_row + rows] = part
            give_back(self.arrays[name])
        self._next_row += rows
