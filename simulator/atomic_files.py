"""Whole files or none: write beside the target, then rename."""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from simulator.errors import PhotositeError

LEFTOVER = ".photosite-"  # begins the name of what is being written; a killed process leaves it behind
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
        raise PhotositeError("cannot be written: it is not a plain file; choose another name", file=path)
    temporary = target.with_name(f"{LEFTOVER}{secrets.token_hex(8)}{target.suffix}")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        _to_disk(temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise _write_error(path, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


@contextmanager
def atomic_folder(path: str | os.PathLike) -> Iterator[Path]:
    """Yield the path of a folder to be made; on success it replaces the folder `path`, on any failure it is removed.

    The folder appears with all its files or not at all. An older one of that name is moved away just before, and two
    processes that make the same folder leave one of theirs.
    Raises PhotositeError as `atomic_write` does, and when the target is there and is no folder.
    """
    target = Path(os.path.realpath(path))
    if target.exists() and not target.is_dir():
        raise PhotositeError("cannot be written: it is not a folder; choose another name", file=path)
    temporary, old = (target.with_name(f"{LEFTOVER}{secrets.token_hex(8)}{kind}") for kind in ("", ".old"))
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        for file in temporary.rglob("*"):
            if file.is_file():
                _to_disk(file)
        _put_in_place(temporary, target, old)
    except OSError as error:
        raise _write_error(path, error) from error
    finally:
        for folder in (temporary, old):
            shutil.rmtree(folder, ignore_errors=True)


def reserve(path: str | os.PathLike, size_bytes: int) -> None:
    """Make sure that a file of this size fits, before a library writes it; raises OSError when not.

    Some image libraries end the process or lose the error when the disk fills up.
    Where the system cannot reserve (no posix_fallocate), nothing is checked.
    """
    if hasattr(os, "posix_fallocate"):
        with open(path, "wb") as file:
            os.posix_fallocate(file.fileno(), 0, max(size_bytes, 1))


def _put_in_place(folder: Path, target: Path, old: Path) -> None:
    """Rename a folder; what has its name is moved to `old` and deleted. Another process may do the same at the same time."""
    for attempt in range(100):
        try:
            return os.replace(folder, target)  # takes the place of nothing, or of an empty folder
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST) or attempt == 99:
                raise
        with suppress(FileNotFoundError):  # the other process was faster
            os.replace(target, old)
        shutil.rmtree(old, ignore_errors=True)


def _write_error(path: str | os.PathLike, error: OSError) -> PhotositeError:
    fix = _FIX.get(error.errno or 0, "check the path and the disk")
    return PhotositeError(f"cannot be written: {error.strerror or error}; {fix}", file=path)


def _to_disk(path: Path) -> None:
    """Flush a file before its rename, or a power cut could leave the new name on an empty file."""
    with open(path, "r+b") as file:
        os.fsync(file.fileno())
