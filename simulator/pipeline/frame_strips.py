"""The arrays of a frame, put together from its strips: in memory, or in files where the frame is large."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

import numpy as np

from simulator.atomic_files import reserve, scratch_folder
from simulator.raw.disk_arrays import map_array


class Store(Protocol):
    """An array of the whole frame that is filled from the top."""

    def append(self, rows: np.ndarray) -> None:
        """Append rows, (rows, ...). Raises OSError when there is no room for them on the disk."""
        ...

    def array(self) -> np.ndarray:
        """Return the array, when all of its rows are there."""
        ...


# Makes the store of a quantity. name: of the quantity. shape, dtype: of its array.
Allocate = Callable[[str, tuple[int, ...], np.dtype], Store]


class MemoryStore:
    """A store in memory."""

    def __init__(self, _name: str, shape: tuple[int, ...], dtype: np.dtype) -> None:
        self._array, self._next_row = np.empty(shape, dtype), 0

    def append(self, rows: np.ndarray) -> None:
        """Append rows, (rows, ...)."""
        self._array[self._next_row : self._next_row + len(rows)] = rows
        self._next_row += len(rows)

    def array(self) -> np.ndarray:
        """Return the array, when all of its rows are there."""
        return self._array


class FileStore:
    """A store in a new file; the file must exist as long as its array is used.

    Raises OSError when the disk has no room for the array: it is taken at once.
    """

    def __init__(self, file: Path, shape: tuple[int, ...], dtype: np.dtype) -> None:
        self._file, self._shape, self._dtype = file, shape, dtype
        reserve(file, int(np.prod(shape)) * dtype.itemsize)
        self._opened = open(file, "r+b")  # noqa: SIM115 (closed by `array`)

    def append(self, rows: np.ndarray) -> None:
        """Append rows, (rows, ...)."""
        rows.tofile(self._opened)

    def array(self) -> np.ndarray:
        """Return the array, read-only, when all of its rows are there."""
        self._opened.close()
        return map_array(self._file, self._shape, self._dtype)


@contextmanager
def on_disk(path: Path) -> Iterator[Allocate]:
    """Make stores in files of a folder beside `path`, which are removed in the end.

    Raises PhotositeError when they do not fit on the disk.
    """
    with scratch_folder(path) as folder:
        yield lambda name, shape, dtype: FileStore(folder / name, shape, dtype)


class FrameArrays:
    """Arrays of a frame by name, filled strip by strip from the top."""

    def __init__(self, rows: int, allocate: Allocate) -> None:
        self._rows, self._allocate = rows, allocate
        self._stores: dict[str, Store] = {}

    def append(self, strip: dict[str, np.ndarray]) -> None:
        """Append the arrays of the next strip, (rows, ...) each. Raises OSError when a file for them has no room."""
        for name, part in strip.items():
            if name not in self._stores:
                self._stores[name] = self._allocate(name, (self._rows, *part.shape[1:]), part.dtype)
            self._stores[name].append(part)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the whole arrays by name."""
        return {name: store.array() for name, store in self._stores.items()}
