"""The command line that takes one point of a study alone."""

import re
import shlex
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from simulator.color.color_tables import CONFIGS
from simulator.config.document import Place, absolute_path
from simulator.config.shot_file import Setting
from simulator.config.yaml_dialect import dump_flow
from simulator.errors import PhotositeError

FILE = re.compile(r"[^\s:]*\.[A-Za-z][A-Za-z0-9]{1,4}")  # a text that can only be the name of a file


def simulate_command(shot: Path, settings: Sequence[Setting], has_sweep: bool) -> str:
    """Return `photosite simulate SHOT --set ...`, whose shot has these settings, from any folder.

    shot: path of the shot file. has_sweep: whether that file has a sweep, which is left out.
    """
    items = [f"{key}={dump_flow(absolute_files(value, place.folder))}" for key, value, place in settings]
    items += ["sweep=null"] if has_sweep else []
    return shlex.join(["photosite", "simulate", shot_name(shot), *(word for item in items for word in ("--set", item))])


def shot_name(shot: Path) -> str:
    """Return the name of a shot of configs/shots, else the path of the file."""
    return shot.stem if shot.parent == CONFIGS / "shots" else str(shot)


def absolute_files(value: Any, folder: Path) -> Any:
    """Return plain data whose texts that name files, relative to a folder, are absolute paths."""
    if isinstance(value, dict):
        return {key: absolute_files(inner, folder) for key, inner in value.items()}
    if isinstance(value, list):
        return [absolute_files(inner, folder) for inner in value]
    if not isinstance(value, str) or not value or len(value) > 1000 or "\0" in value:
        return value
    if FILE.fullmatch(value) or (folder / value).is_file():
        with suppress(PhotositeError):  # of a home that is not known, which the shot says when it is read
            return str(absolute_path(value, Place(value, folder), "--set"))
    return value
