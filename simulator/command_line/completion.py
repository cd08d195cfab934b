"""What a shell completes: names of the library, and paths of YAML files and folders.

Imports nothing that takes time, because a shell waits for it at each press of the tabulator.
"""

from collections.abc import Iterator
from pathlib import Path

_HOUSE = Path(__file__).resolve().parents[1]
_CONFIGS = next((folder for folder in (_HOUSE / "configs", _HOUSE.parent / "configs") if folder.is_dir()), _HOUSE / "configs")


def complete_name(kind: str, begun: str) -> list[str]:
    """Return the names in configs/<kind> and the paths of YAML files and folders that begin with a text.

    kind: cameras, shots, studies, datasets or responses. A file in a folder there has that folder in its name.
    """
    library = _CONFIGS / kind
    names = sorted(path.relative_to(library).with_suffix("").as_posix() for path in library.rglob("*.yaml"))
    return [name for name in names if name.startswith(begun)] + sorted(_paths(begun))


def complete_template(begun: str) -> list[str]:
    """Return the kinds of files that `photosite new` writes, as far as they begin with a text."""
    return sorted(path.stem for path in (_CONFIGS / "templates").glob(f"{begun}*.yaml"))


def _paths(begun: str) -> Iterator[str]:
    folder, _, start = begun.rpartition("/")
    prefix = begun[: len(begun) - len(start)]
    try:
        found = list(Path(folder or ("/" if prefix else ".")).iterdir())
    except OSError:
        return
    for path in found:
        if path.name.startswith(start) and not (path.name.startswith(".") and not start):
            if path.is_dir():
                yield f"{prefix}{path.name}/"
            elif path.suffix in (".yaml", ".yml"):
                yield f"{prefix}{path.name}"
