"""A shot file as the page changes it: values of its controls are laid over it, and every other key stays."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simulator.config import dump_yaml, load_shot, named_file
from simulator.errors import PhotositeError
from simulator.explore.controls import Control, controls_of
from simulator.pipeline.input_files import input_files
from simulator.pipeline.shot import Shot

LONGEST_VALUE = 64  # letters


@dataclass(frozen=True)
class OpenedShot:
    """A shot file that the page may open.

    path: of the file, or the name of one in configs/shots. overrides: dotted key -> value, of the command line.
    """

    path: str
    overrides: Mapping[str, object] = field(default_factory=dict)

    def check(self) -> None:
        """Raise PhotositeError for a shot that cannot be read, or whose pictures are missing."""
        shot = self.shot({})
        missing = next((path for path in input_files(shot.scene) if not path.is_file()), None)
        if missing is not None:
            raise PhotositeError("no such file; check the path", key="scene", value=missing.name, file=self.path)

    def is_complete(self) -> bool:
        """Whether all files of the shot are there."""
        try:
            self.check()
        except PhotositeError:
            return False
        return True

    def controls(self) -> tuple[Control, ...]:
        """Return the controls of the shot as its file has it. Raises PhotositeError."""
        return controls_of(self.shot({}))

    def shot(self, settings: Mapping[str, str]) -> Shot:
        """Return the shot with the values of some controls. Raises PhotositeError for what no shot file may hold."""
        _check(settings, self.path)
        values = {key: _plain(key, text) for key, text in settings.items()}
        return load_shot(self.path, {**self.overrides, **values})

    def yaml(self, settings: Mapping[str, str]) -> str:
        """Return the shot as a file that `photosite simulate` takes, its pictures named from the folder of this shot's file."""
        shot = self.shot(settings)
        folder = named_file("shots", self.path).resolve().parent
        is_inside = _relative(shot.resolved, folder)
        lines = ["# A view of photosite explore; save it beside the file that was opened."]
        return "\n".join([*lines, dump_yaml(is_inside)])

    def command(self, settings: Mapping[str, str]) -> str:
        """Return the command that takes this view again."""
        values = {**{key: str(value) for key, value in self.overrides.items()}, **settings}
        given = "".join(f" --set '{key}={_shown(value)}'" for key, value in values.items())
        return f"photosite simulate {Path(self.path).name}{given}"


def _check(settings: Mapping[str, str], path: str) -> None:
    """Raise PhotositeError for keys that are no control's, and values that no control gives."""
    for key, text in settings.items():
        if key not in KEYS:
            raise PhotositeError(f"the page does not change this; it changes {', '.join(sorted(KEYS))}", key=key)
        if not isinstance(text, str) or len(text) > LONGEST_VALUE:
            raise PhotositeError(f"give a text of up to {LONGEST_VALUE} letters, as the shot file writes it", key=key)


KEYS = frozenset(
    {
        "lens.focal_length",
        "lens.f_number",
        "lens.focus_distance",
        "exposure.time",
        "exposure.iso",
        "camera.pixel_pitch",
        "motion.camera.pan",
    }
)


def _plain(key: str, text: str) -> object:
    """Return a value as YAML reads it: an ISO is a whole number."""
    if key == "exposure.iso":
        if not text.isdecimal():
            raise PhotositeError("give a whole number", key=key, value=text)
        return int(text)
    return text


def _shown(value: str) -> str:
    """Return a value without the folder of a file, which is the machine's own business."""
    return Path(value).name if value.startswith("/") else value


def _relative(value: Any, folder: Path) -> Any:
    """Return plain data whose absolute paths are named from a folder, or by their names where they lie elsewhere."""
    if isinstance(value, dict):
        return {key: _relative(inner, folder) for key, inner in value.items()}
    if isinstance(value, list):
        return [_relative(inner, folder) for inner in value]
    if isinstance(value, str) and value.startswith("/"):
        path = Path(value)
        return str(path.relative_to(folder)) if path.is_relative_to(folder) else path.name
    return value
