"""Decoded pictures as files that all processes of a machine map into memory: a picture is decoded once, not for each patch."""

import hashlib
import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from simulator.atomic_files import atomic_write, cache_folder, remove_abandoned
from simulator.errors import PhotositeError, reading, require

DEFAULT_BYTES = 8_000_000_000
ENDING = ".decoded.npy"
_FREE_SHARE = 0.5  # of the free disk that the folder may fill
_OPEN_FILES = 64  # that a process keeps mapped; opening one takes 0.2 ms


@dataclass
class DecodingCost:
    """What a process spent on decoding: pictures, their bytes decoded, seconds of the clock and of the processor."""

    pictures: int = 0
    decoded_bytes: int = 0
    seconds: float = 0.0
    cpu_seconds: float = 0.0


class DecodedPictures:
    """A folder of decoded pictures. What is in it changes the time that reading takes, never a bit.

    A file is an array as `numpy.save` writes it, under a name that follows from the picture's path, size, time of change and
    the decoder's version. The files that were not used for longest are removed for new ones. A folder that cannot be written
    to, a full disk, and a picture larger than the limit mean that pictures are decoded at each reading.
    limit_bytes: of all files together; never more than half of the free disk. 0: nothing is kept.
    folder: default: $PHOTOSITE_CACHE, else photosite/decoded in $XDG_CACHE_HOME or ~/.cache. It may be deleted at any time.
    cost: of what this process decoded.
    """

    def __init__(self, limit_bytes: int = DEFAULT_BYTES, folder: Path | None = None) -> None:
        """Raises PhotositeError for a limit below 0."""
        require(limit_bytes >= 0, "cache", f"{limit_bytes} bytes", "give a size above 0, or 0 for no cache")
        self.limit_bytes, self.folder, self.cost = limit_bytes, folder, DecodingCost()
        self._mapped: dict[Path, np.ndarray] = {}
        self._kept_since_s: float | None = None  # time [s since the epoch] from which on what is used is not removed

    def keeping_used(self) -> Self:
        """Return the same folder for draws in random order, in which what is used from now on is not removed for new pictures.

        Where few of many pictures fit, any of them is as likely to be drawn next: writing each to the disk would be in vain.
        """
        other = type(self)(self.limit_bytes, self.folder)
        other.cost, other._mapped, other._kept_since_s = self.cost, self._mapped, time.time()
        return other

    def __reduce__(self) -> tuple[type, tuple[int, Path | None]]:
        return type(self), (self.limit_bytes, self.folder)  # files are mapped anew in another process

    @property
    def place(self) -> Path:
        """Folder of the files on this machine."""
        return cache_folder("decoded") if self.folder is None else self.folder

    def codes(self, picture: Path, decode: Callable[[Path], np.ndarray]) -> np.ndarray:
        """Return what `decode` gives for a picture, read-only; from the folder where it lies there. Raises as `decode` does."""
        try:
            state = picture.stat()
        except OSError:
            return self._decode(picture, decode)  # which says what is wrong
        if self.limit_bytes == 0:
            return self._decode(picture, decode)
        path = self.place / f"{_fingerprint(picture, state)}{ENDING}"
        found = self._open(path)
        if found is not None:
            return found
        with _locked(self.place / f"lock-{path.name[:2]}"):  # another process may be decoding it
            found = self._open(path)
            if found is not None:
                return found
            return self._decode(picture, decode, path)

    def _decode(self, picture: Path, decode: Callable[[Path], np.ndarray], path: Path | None = None) -> np.ndarray:
        """Decode a picture, write it to a file where one is named, and add what that took to `cost`."""
        start, begun = time.perf_counter(), time.process_time()
        codes = decode(picture)
        codes.flags.writeable = False
        if path is not None:
            with suppress(PhotositeError, OSError):
                self._store(path, codes)
        self.cost.seconds += time.perf_counter() - start
        self.cost.cpu_seconds += time.process_time() - begun
        self.cost.pictures += 1
        self.cost.decoded_bytes += codes.nbytes
        return codes

    def _open(self, path: Path) -> np.ndarray | None:
        """Return the array of a file, mapped, and note the use as its time; None where there is none or it was cut short."""
        try:
            with suppress(PermissionError):  # another user's
                os.utime(path)
        except OSError:
            self._mapped.pop(path, None)
            return None
        if path not in self._mapped:
            if len(self._mapped) >= _OPEN_FILES:
                del self._mapped[next(iter(self._mapped))]
            try:
                with reading(path, "it is made again"):
                    found = np.load(path, mmap_mode="r")
            except PhotositeError:
                return None
            self._mapped[path] = found.view(np.ndarray)  # not a memmap, whose every slice costs microseconds
        return self._mapped[path]

    def _store(self, path: Path, codes: np.ndarray) -> None:
        """Write an array, after making room for it. Raises PhotositeError or OSError when that fails."""
        self.place.mkdir(parents=True, exist_ok=True)
        with _locked(self.place / "lock"):
            remove_abandoned(self.place)
            if self._make_room(codes.nbytes):
                with atomic_write(path, durable=False) as temporary, open(temporary, "wb") as file:
                    np.save(file, codes)
        # What this process maps keeps its room on the disk, also after another one removed it.
        for gone in [one for one in self._mapped if not one.exists()]:
            del self._mapped[gone]

    def _make_room(self, wanted_bytes: int) -> bool:
        """Remove the files that were not used for longest until so many bytes have room; return whether they have."""
        wanted_bytes += 128  # the header of the file
        files = sorted(
            (one for one in os.scandir(self.place) if one.name.endswith(ENDING)), key=lambda one: one.stat().st_mtime
        )
        used = sum(one.stat().st_size for one in files)
        most = min(self.limit_bytes, used + int(_FREE_SHARE * _free_bytes(self.place)))
        if wanted_bytes > most:
            return False
        removable = (one for one in files if self._kept_since_s is None or one.stat().st_mtime < self._kept_since_s)
        while used + wanted_bytes > most:
            oldest = next(removable, None)
            if oldest is None:
                return False
            os.unlink(oldest.path)
            used -= oldest.stat().st_size
        return True


def _fingerprint(picture: Path, state: os.stat_result) -> str:
    """Return the name of a picture's file: 32 hexadecimal digits."""
    import OpenImageIO as oiio

    words = (oiio.VERSION_STRING, os.path.abspath(picture), state.st_size, state.st_mtime_ns)
    return hashlib.sha256("\n".join(map(str, words)).encode("utf-8", "surrogateescape")).hexdigest()[:32]


def _free_bytes(folder: Path) -> int:
    """Return the free bytes of the disk that a folder lies on."""
    return shutil.disk_usage(folder).free


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock between the processes of a machine; none where there are no locks (Windows, some network file systems)."""
    with ExitStack() as stack:
        with suppress(ImportError, OSError):
            import fcntl

            path.parent.mkdir(parents=True, exist_ok=True)
            file = stack.enter_context(open(path, "ab"))
            fcntl.flock(file, fcntl.LOCK_EX)
        yield
