"""Names of files that a command is told to write: of a kind that it writes, and of no file that it reads."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from simulator.errors import require


def check_output(path: Path, key: str, suffixes: Sequence[str], inputs: Callable[[], Iterable[Path]] = tuple) -> None:
    """Raise PhotositeError for a name with another suffix, in any case, and for that of a file which the command reads.

    path: of the file to write. key: option that gave it. inputs: gives the files that the command reads; called where
    a file of that name is there.
    """
    require(path.suffix.lower() in suffixes, key, path, f"end the name with {', '.join(suffixes)}")
    is_input = path.exists() and any(_is_same(path, one) for one in inputs())
    require(not is_input, key, path, "the command reads this file and would write over it; give another name")


def _is_same(path: Path, other: Path) -> bool:
    """Whether both name one file, also through links."""
    try:
        return path.samefile(other)
    except OSError:  # the other is not there
        return False
