"""Arrays whose content lies in a file, for frames that are larger than the memory should be."""

import mmap
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike

BLOCK_BYTES = 2**24  # of an array that are in use at a time


def map_array(file: Path, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
    """Return a read-only array whose content lies in a file; the file must exist as long as the array is used.

    Raises OSError when the file cannot be read, and ValueError when it is shorter than the array.
    """
    count = int(np.prod(shape))
    with open(file, "rb") as opened:
        mapped = mmap.mmap(opened.fileno(), 0, access=mmap.ACCESS_READ)
    return np.frombuffer(mapped, dtype, count).reshape(shape)


def in_blocks(array: np.ndarray, step_rows: int = 1) -> Iterator[np.ndarray]:
    """Yield an array's rows in blocks of at most BLOCK_BYTES or step_rows rows, a multiple of step_rows but for the last.

    The memory of a block of a `map_array` is given back after its use.
    """
    row_bytes = max(array[:1].nbytes, 1)
    rows = max(BLOCK_BYTES // (row_bytes * step_rows), 1) * step_rows
    for first in range(0, len(array), rows):
        yield array[first : first + rows]
        give_back(array)


def give_back(array: np.ndarray) -> None:
    """Give back the memory that an array from `map_array`, or a part of it, occupies; its content stays in the file.

    Does nothing for other arrays, and where the system cannot (Windows).
    """
    owner: object = array
    while isinstance(owner, np.ndarray | memoryview):
        owner = owner.base if isinstance(owner, np.ndarray) else owner.obj
    if isinstance(owner, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):
        owner.madvise(mmap.MADV_DONTNEED)
