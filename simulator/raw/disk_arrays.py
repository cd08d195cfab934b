"""Arrays whose content lies in a file, for frames that are larger than the memory should be."""

import mmap
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

from simulator.atomic_files import reserve

BLOCK_BYTES = 2**24  # of an array that are in use at a time


def disk_array(file: Path, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
    """Return an array of zeros whose content lies in a new file; the file must exist as long as the array is used.

    Raises OSError when the disk has no room for it: it is taken before the array is returned.
    """
    size_bytes = max(int(np.prod(shape)), 1) * np.dtype(dtype).itemsize
    reserve(file, size_bytes)
    with open(file, "r+b") as opened:
        opened.truncate(size_bytes)
        mapped = mmap.mmap(opened.fileno(), size_bytes)
    return np.frombuffer(mapped, dtype, int(np.prod(shape))).reshape(shape)


def in_blocks(array: np.ndarray, step_rows: int = 1) -> Iterator[np.ndarray]:
    """Yield an array's rows in blocks of at most BLOCK_BYTES or step_rows rows, a multiple of step_rows but for the last.

    The memory of a block of a `disk_array` is given back after its use.
    """
    row_bytes = max(array[:1].nbytes, 1)
    rows = max(BLOCK_BYTES // (row_bytes * step_rows), 1) * step_rows
    for first in range(0, len(array), rows):
        yield array[first : first + rows]
        give_back(array)


def give_back(array: np.ndarray) -> None:
    """Give back the memory that an array from `disk_array`, or a part of it, occupies; its content stays in the file.

    Does nothing for other arrays, and where the system cannot (Windows).
    """
    owner: object = array
    while isinstance(owner, np.ndarray | memoryview):
        owner = owner.base if isinstance(owner, np.ndarray) else owner.obj
    if isinstance(owner, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        owner.madvise(mmap.MADV_DONTNEED)
