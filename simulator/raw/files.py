"""Whole files or none: write beside the target, then rename."""

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from simulator.errors import PhotositeError

_FIX = {
    errno.ENOSPC: "free some space or choose another disk",
    errno.EDQUOT: "your disk quota is used up: free some space or choose another disk",
    errno.EFBIG: "the file system or a limit of this process allows no file of this size: choose another disk",
    errno.EACCES: "choose a folder you may write to",
    errno.EPERM: "choose a folder you may write to",
    errno.EROFS: "the disk is read-only: choose another folder",
    errno.ENOTDIR: "a part of the path is a file, not a folder: choose another folder",
    errno.EEXIST: "a part of the path is a file, not a folder: choose another folder",
    errno.ENAMETOOLONG: "choose a shorter name",
}


@contextmanager
def atomic_write(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a temporary path; on success it replaces `path`, on any failure it is removed.

    The temporary file lies in the target's folder (a rename works only within one file system)
    and has its suffix (writers choose the format by it). A missing folder is made. A link is followed.
    Raises PhotositeError when the folder cannot be made or written to, the target is not a plain file,
    or the block raises OSError (disk full).
    """
    target = Path(os.path.realpath(path))
    # Renaming over a device such as /dev/null would replace the device.
    if target.exists() and not target.is_file():
        raise PhotositeError(f"{path}: cannot be written: it is not a plain file; choose another name")
    temporary = target.with_name(f".photosite-{secrets.token_hex(8)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        _to_disk(temporary)
        os.replace(temporary, target)
    except OSError as error:
        fix = _FIX.get(error.errno, "check the path and the disk")
        raise PhotositeError(f"{path}: cannot be written: {error.strerror or error}; {fix}") from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def reserve(path: str | os.PathLike, size_bytes: int) -> None:
    """Make sure that a file of this size fits, before a library writes it; raises OSError when not.

    Some image libraries end the process or lose the error when the disk fills up.
    Where the system cannot reserve (no posix_fallocate), nothing is checked.
    """
    if hasattr(os, "posix_fallocate"):
        with open(path, "wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(size_bytes, 1))


def _to_disk(path: Path) -> None:
    """Flush a file before its rename, or a power cut could leave the new name on an empty file."""
    with open(path, "r+b") as file:
        os.fsync(file.fileno())
