"""Whole files or none: write beside the target, then rename. What a killed process leaves is removed by the next write.

A target such as `a.dng` is written in a hidden folder `.photosite-a.dng.0` beside it. The file `owner` in that folder names the
process and is locked by it. The kernel drops the lock when the process ends, however it ends, and never before: a folder whose
`owner` can be locked belongs to nobody. That holds between machines, too, where the file system has locks.
"""

import errno
import hashlib
import os
import platform
import shutil
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from simulator.errors import PhotositeError

LEFTOVER = ".photosite-"  # begins the name of a folder in which something is being written
_OWNER, _UNLOCKED = "owner", "unlocked"  # names of the file that is locked, or cannot be
_PLACES = 8  # folders of one target that are looked at; a folder beyond them is left to `remove_abandoned`
_BEGUN_BYTES = 2**23  # of a file that is being written, after which the disk begins with them
_LABEL_BYTES = 150  # of a target's name within the folder's; file systems allow 255 for all of it
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
def atomic_write(path: str | os.PathLike, durable: bool = True) -> Iterator[Path]:
    """Yield a temporary path; on success it replaces `path`, on any failure it is removed.

    The temporary file lies in a folder beside the target (a rename works only within one file system) and has the target's
    suffix (writers choose the format by it). A missing folder is made. A link is followed. What killed processes left of the
    same target is removed.
    durable: whether it is on the disk before the rename; False for files that can be made again and are checked when read.
    Raises PhotositeError when the folder cannot be made or written to, the target is not a plain file,
    or the block raises OSError (disk full).
    """
    target = Path(os.path.realpath(path))
    # Renaming over a device such as /dev/null would replace the device.
    if not stat.S_ISREG(_mode(target, stat.S_IFREG)):
        raise PhotositeError("cannot be written: it is not a plain file; choose another name", file=path)
    with write_errors(path), _workplace(target) as folder:
        temporary = folder / f"new{target.suffix}"
        yield temporary
        if durable:
            _to_disk(temporary)
        os.replace(temporary, target)


@contextmanager
def atomic_folder(path: str | os.PathLike) -> Iterator[Path]:
    """Yield the path of a folder to be made; on success it replaces the folder `path`, on any failure it is removed.

    The folder appears with all its files or not at all. An older one of that name is moved away just before, and two
    processes that make the same folder leave one of theirs.
    Raises PhotositeError as `atomic_write` does, and when the target is there and is no folder.
    """
    target = Path(os.path.realpath(path))
    if not stat.S_ISDIR(_mode(target, stat.S_IFDIR)):
        raise PhotositeError("cannot be written: it is not a folder; choose another name", file=path)
    with write_errors(path), _workplace(target) as folder:
        temporary = folder / "new"
        yield temporary
        for file in temporary.rglob("*"):
            if file.is_file():
                _to_disk(file)
        _put_in_place(temporary, target, folder / "old")


@contextmanager
def scratch_folder(path: str | os.PathLike) -> Iterator[Path]:
    """Yield a new folder beside `path` for what is needed while that file is made; it is removed in the end.

    What killed processes left of the same target is removed. Raises PhotositeError when the folder cannot be made or
    written to, or the block raises OSError (disk full).
    """
    with write_errors(path), _workplace(Path(os.path.realpath(path))) as folder:
        yield folder


@contextmanager
def write_errors(path: str | os.PathLike) -> Iterator[None]:
    """Raise PhotositeError that names `path` for an OSError of the block."""
    try:
        yield
    except OSError as error:
        fix = _FIX.get(error.errno or 0, "check the path and the disk")
        raise PhotositeError(f"cannot be written: {error.strerror or error}; {fix}", file=path) from error


def write_buffers(path: str | os.PathLike, buffers: Iterable[bytes | memoryview]) -> None:
    """Write buffers one after the other into a new file. Raises OSError.

    The disk begins with the first ones while later ones are made and copied, so that little is left to wait for in the end.
    """
    with open(path, "wb") as file:
        begun = 0
        for buffer in buffers:
            file.write(buffer)
            if hasattr(os, "posix_fadvise") and file.tell() - begun >= _BEGUN_BYTES:
                file.flush()
                # Linux begins to write what it is told to forget, and forgets only what is on the disk.
                os.posix_fadvise(file.fileno(), begun, file.tell() - begun, os.POSIX_FADV_DONTNEED)
                begun = file.tell()


def cache_folder(name: str) -> Path:
    """Return the folder of files that can be made again.

    It is $PHOTOSITE_CACHE, else photosite/<name> in $XDG_CACHE_HOME or ~/.cache.
    """
    if "PHOTOSITE_CACHE" in os.environ:
        return Path(os.environ["PHOTOSITE_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "photosite" / name


def _mode(path: Path, otherwise: int) -> int:
    """Return the mode of what lies at a path, asked once: another process may take it away; `otherwise` where nothing does."""
    try:
        return path.stat().st_mode
    except OSError:
        return otherwise


def remove_abandoned(folder: Path) -> None:
    """Remove what killed processes were writing in a folder, whatever the target; what a living process writes stays."""
    for place in folder.glob(f"{LEFTOVER}*"):
        _remove_if_abandoned(place)


@contextmanager
def _workplace(target: Path) -> Iterator[Path]:
    """Yield a new folder beside the target in which this process alone works, and remove it in the end. Raises OSError.

    Before that, folders of this target whose processes have ended are removed.
    """
    target.parent.mkdir(parents=True, exist_ok=True)
    for number in range(_PLACES):
        _remove_if_abandoned(_place(target, number))
    claims = (_claim(_place(target, number)) for number in count())
    folder, descriptor, is_locked = next(claim for claim in claims if claim is not None)
    try:
        yield folder
    finally:
        if not is_locked:  # Windows removes no open file
            os.close(descriptor)
        _remove(folder)
        if is_locked:
            os.close(descriptor)


def _place(target: Path, number: int) -> Path:
    """Return the path of a target's working folder."""
    label = target.name
    if len(os.fsencode(label)) > _LABEL_BYTES:
        label = hashlib.sha256(os.fsencode(label)).hexdigest()
    return target.with_name(f"{LEFTOVER}{label}.{number}")


def _claim(folder: Path) -> tuple[Path, int, bool] | None:
    """Make a working folder; return it, the descriptor of its `owner` and whether that is locked. None: another has it."""
    try:
        folder.mkdir()
    except FileExistsError:
        return None
    try:
        descriptor = os.open(folder / _OWNER, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666)
    except (FileExistsError, FileNotFoundError):  # it was taken for an abandoned one while it was empty
        return None
    except OSError:
        with suppress(OSError):
            folder.rmdir()
        raise
    is_locked = _lock(descriptor)
    if is_locked is False or not _is_still(descriptor, folder / _OWNER):
        os.close(descriptor)
        return None
    if is_locked is None:  # nobody can tell whether this process lives, so nobody may remove the folder
        with suppress(OSError):
            os.replace(folder / _OWNER, folder / _UNLOCKED)
    with suppress(OSError):  # of a full disk; the text is for people
        os.write(descriptor, f"process {os.getpid()} on {platform.node()}\n".encode("utf-8", "replace"))
    return folder, descriptor, bool(is_locked)


def _lock(descriptor: int) -> bool | None:
    """Lock an open file: whether that was possible; None where there are no locks (Windows, some network file systems)."""
    try:
        import fcntl
    except ImportError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return None
    return True


def _is_still(descriptor: int, path: Path) -> bool:
    """Return whether a path names the file that is open: another process may have removed it before it was locked."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except FileNotFoundError:
        return False


def _remove_if_abandoned(folder: Path) -> None:
    """Remove a working folder whose process has ended."""
    try:
        descriptor = os.open(folder / _OWNER, os.O_RDWR)
    except FileNotFoundError:
        with suppress(
            OSError
        ):  # it is not there, or its process was killed before it wrote `owner`, or the folder is not empty
            folder.rmdir()
        return
    except OSError:  # another user's, or no folder
        return
    try:
        if _lock(descriptor) and _is_still(descriptor, folder / _OWNER):
            _remove(folder)
    finally:
        os.close(descriptor)


def _remove(folder: Path) -> None:
    """Remove a working folder, `owner` last: while it is there, the next process can go on where this one is killed."""
    with suppress(OSError):
        for path in folder.iterdir():
            if path.name == _OWNER:
                continue
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink()
    with suppress(OSError):
        (folder / _OWNER).unlink(missing_ok=True)
        folder.rmdir()


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


def _to_disk(path: Path) -> None:
    """Flush a file before its rename, or a power cut could leave the new name on an empty file."""
    with open(path, "r+b") as file:
        os.fsync(file.fileno())
