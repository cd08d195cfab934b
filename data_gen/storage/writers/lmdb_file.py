"""LMDB databases that have the same bytes each time: one table, keys in order, no free pages, no lock file.

Its pages are as large as the machine's memory pages, so the bytes are the same between machines where those are.
"""

import errno
import mmap
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import lmdb

_PAGE_BYTES = mmap.PAGESIZE  # LMDB takes the machine's
_BATCH_BYTES = 2**26  # of values that one transaction holds in memory


@contextmanager
def new_lmdb(folder: Path) -> Iterator[Callable[[str, bytes], None]]:
    """Make an empty folder with `data.mdb` in it; yield the function that stores a value under a key.

    The map grows with the values and ends near the size of the file, so that a reader of many shards does not
    exhaust the address space. Raises ValueError for a key that does not sort behind the one before, and OSError, also for
    LMDB's own errors.
    """
    import lmdb

    draft = folder / "draft"
    draft.mkdir(parents=True)
    try:
        with lmdb.open(str(draft), map_size=2**20, lock=False, sync=False) as database:
            batch: list[tuple[str, bytes]] = []

            def put(key: str, value: bytes) -> None:
                batch.append((key, value))
                if sum(len(value) for _, value in batch) >= _BATCH_BYTES:
                    _commit(database, batch)

            yield put
            _commit(database, batch)
            database.copy(str(folder), compact=True)  # leaves out pages that were freed while writing
    except lmdb.Error as error:
        full = "No space left" in str(error)
        raise OSError(errno.ENOSPC if full else errno.EIO, f"LMDB: {error}") from error
    (draft / "data.mdb").unlink()
    draft.rmdir()


@contextmanager
def read_lmdb(folder: Path) -> Iterator["lmdb.Transaction[bytes]"]:
    """Open a database that nobody writes to, for reading."""
    import lmdb

    with lmdb.open(str(folder), readonly=True, lock=False, max_readers=1, readahead=False) as database:
        with database.begin() as transaction:
            yield transaction


def page_bytes(sizes: Mapping[str, int]) -> int:
    """Bytes that values of these sizes take, by key: large ones fill pages of their own, small ones share."""
    total = 0
    for key, size in sizes.items():
        entry = 8 + len(key) + 2  # header and pointer of an entry of a leaf
        if entry + size > _PAGE_BYTES // 2:
            total += -(-(size + 16) // _PAGE_BYTES) * _PAGE_BYTES + entry + 8
        else:
            total += entry + size
    return total


def _commit(database: "lmdb.Environment", batch: list[tuple[str, bytes]]) -> None:
    """Write a batch and empty it. Raises ValueError for keys out of order."""
    needed = sum(len(value) + 3 * _PAGE_BYTES for _, value in batch)
    database.set_mapsize((database.info()["last_pgno"] + 1) * _PAGE_BYTES + needed + 2**20)
    with database.begin(write=True) as transaction:
        for key, value in batch:
            if not transaction.put(key.encode("ascii"), value, append=True):
                raise ValueError(f"key {key} does not sort behind the one before it, and would be lost")
    batch.clear()
