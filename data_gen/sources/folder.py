"""Files of a folder as pictures of a data set."""

import os
import unicodedata
from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from pathlib import Path
from typing import ClassVar

from simulator.errors import PhotositeError, require


class FolderSource:
    """Names of a source that reads the files of one folder; a data class, which has the folder under the name `key`.

    extensions: of the files to take, in lower case.
    """

    key: ClassVar[str]
    extensions: tuple[str, ...]

    def names(self) -> tuple[str, ...]:
        """Return paths relative to the folder, see `picture_names`."""
        return self._names

    def fingerprints(self) -> Iterator[str]:
        """Yield name and size [bytes] of each picture: a folder may be too large for reading all of it."""
        folder = getattr(self, self.key)
        for name in self.names():
            yield f"{name} {_size_bytes(os.path.join(folder, name))}"

    @cached_property
    def _names(self) -> tuple[str, ...]:
        return self._listed()

    def _listed(self) -> tuple[str, ...]:
        return picture_names(getattr(self, self.key), self.extensions, self.key)


def picture_names(folder: Path, extensions: Iterable[str], key: str) -> tuple[str, ...]:
    """Names of all pictures below a folder: paths relative to it with "/", sorted by their UTF-8 bytes.

    extensions: such as ".png", in lower case; files that end so in any case are taken. Hidden files and folders are left out,
    links to folders are not followed.
    key: of the configuration, for messages.
    Raises PhotositeError for a folder that is missing, cannot be read or holds no such file, for a name that is no UTF-8, and
    for two names that only differ in how Unicode composes an accent: other systems take them for one.
    """
    folder, endings = Path(folder), tuple(extensions)
    require(folder.is_dir(), key, folder, "no such folder; check the path")
    found = []
    for parent, folders, files in os.walk(folder, onerror=_refuse_unreadable(key)):
        folders[:] = [name for name in folders if not name.startswith(".")]
        below = Path(parent).relative_to(folder)
        found += [(below / name).as_posix() for name in files if not name.startswith(".") and name.lower().endswith(endings)]
    for name in found:
        shown = os.fsencode(name).decode("utf-8", "backslashreplace")
        require(_is_utf8(name), key, folder / shown, "the name is no UTF-8; rename the file")
    require(bool(found), key, folder, f"holds no file that ends in {', '.join(endings)}; check the folder")
    _check_distinct(found, folder, key)
    return tuple(sorted(found, key=str.encode))


def check_extensions(extensions: tuple[str, ...]) -> None:
    """Raise PhotositeError unless every extension is a point and lower-case letters."""
    good = bool(extensions) and all(len(each) > 1 and each.startswith(".") and each == each.lower() for each in extensions)
    require(good, "extensions", extensions, "give endings in lower case with their point, such as .png")


def _check_distinct(names: list[str], folder: Path, key: str) -> None:
    """Raise PhotositeError for two names that are equal in Unicode's composed form (NFC)."""
    composed: dict[str, str] = {}
    for name in names:
        other = composed.setdefault(unicodedata.normalize("NFC", name), name)
        require(other == name, key, folder / name, "a second file has this name, composed of other characters; rename one")


def _size_bytes(path: str) -> int:
    """Return the size of a file; -1 for one that cannot be found, such as a broken link, which reading tells."""
    try:
        return os.stat(path).st_size
    except OSError:
        return -1


def _is_utf8(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True


def _refuse_unreadable(key: str) -> Callable[[OSError], None]:
    """Return the handler of `os.walk` that raises PhotositeError for a folder that cannot be read."""

    def refuse(error: OSError) -> None:
        raise PhotositeError(f"{error.strerror}; make the folder readable", key=key, value=error.filename) from error

    return refuse
