"""`photosite new`: a commented file to start from, valid as it is."""

import re
import shlex
from pathlib import Path

from simulator.atomic_files import atomic_write
from simulator.color.color_tables import CONFIGS
from simulator.errors import PhotositeError, require

TEMPLATES = CONFIGS / "templates"
# What to do with a new file, by kind.
NEXT = {
    "camera": "photosite validate noise {path}",
    "dataset": "photosite dataset {path} --out pairs --dry-run",
    "shot": "photosite simulate {path} --out frames",
    "study": "photosite study {path} --dry-run",
}


def write_new_file(kind: str, name: str | None) -> tuple[Path, str]:
    """Write a start file; return its path and the command that uses it.

    kind: one of NEXT. name: of the file, `.yaml` added where no ending is given; the kind itself when None.
    Raises PhotositeError for an unknown kind, a file that is there, and a folder that cannot be written to.
    """
    require(kind in NEXT, "KIND", kind, f"give one of {', '.join(NEXT)}")
    path = Path(kind if name is None else name)
    path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
    if path.exists():
        raise PhotositeError("is there already and is left as it is; give another NAME", file=path)
    text = (TEMPLATES / f"{kind}.yaml").read_text(encoding="utf-8")
    if kind == "study" and name is not None:  # the study's name is that of the folder of its results
        stem = re.sub(r"[^A-Za-z0-9_.+-]", "_", path.stem)
        text = text.replace("study: my_study", f'study: "{stem}"', 1)  # in quotes, since 2026 would be a number
    with atomic_write(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path, NEXT[kind].format(path=shlex.quote(str(path)))
