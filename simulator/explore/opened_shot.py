"""A shot file as the page changes it: values of its controls are laid over it, and every other key stays."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simulator.config import dump_yaml, load_shot, named_file
from simulator.config.shot_file import load_document
from simulator.config.yaml_dialect import dump_flow
from simulator.errors import PhotositeError, why_no_file
from simulator.explore import camera_list, scene_list
from simulator.explore.camera_list import camera_labels, camera_names, library_camera, nearest_iso
from simulator.explore.controls import Control, controls_of, list_control, with_own
from simulator.explore.scene_list import CHARTS, chart_section, scene_labels
from simulator.pipeline.input_files import named_files
from simulator.pipeline.shot import Shot

LONGEST_VALUE = 64  # letters


@dataclass(frozen=True)
class Panel:
    """The controls of a view. settings: with which its shot can be taken. notes: what was changed for that."""

    controls: tuple[Control, ...]
    settings: Mapping[str, str]
    notes: tuple[str, ...]


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
        parts = (shot.scene, SCENE), (shot.lens, "lens"), (shot.motion, "motion")
        for keys, path in (found for part, name in parts for found in named_files(part, (name,))):
            if not path.is_file():
                key = ".".join(keys)
                rule = f"{why_no_file(path)}; name one with --set {key}=FILE, or open a shot that lies beside its pictures"
                raise PhotositeError(rule, key=key, value=path.name, file=self.path)

    def is_complete(self) -> bool:
        """Whether all files of the shot are there."""
        try:
            self.check()
        except PhotositeError:
            return False
        return True

    def panel(self, settings: Mapping[str, str]) -> Panel:
        """Return the controls at the values of a view; one that the chosen camera does not have is brought to its nearest.

        Raises PhotositeError for values that no control gives.
        """
        opened = self.shot({})
        settled, notes = self._settle(settings, opened)
        lists = {key: settled[key] for key in (SCENE, CAMERA) if key in settled}
        base, _ = self._settle(lists, opened)
        own = {control.key: control for control in controls_of(self.shot(base)) if control.key not in base}
        sliders = [with_own(one, own.get(one.key)) for one in controls_of(self.shot(settled))]
        scene = list_control(SCENE, "Scene", scene_labels(opened), settled.get(SCENE, scene_list.OWN))
        camera = list_control(CAMERA, "Camera", camera_labels(opened.camera), settled.get(CAMERA, camera_list.OWN))
        return Panel((scene, camera, *sliders), settled, notes)

    def shot(self, settings: Mapping[str, str]) -> Shot:
        """Return the shot with the values of some controls. Raises PhotositeError for what no shot file may hold."""
        return load_shot(self.path, self._values(settings))

    def yaml(self, settings: Mapping[str, str]) -> str:
        """Return the shot as a file that `photosite simulate` takes, its pictures named from the folder of this shot's file."""
        shot = self.shot(settings)
        folder = named_file("shots", self.path).resolve().parent
        is_inside = _relative(shot.resolved, folder)
        lines = ["# A view of photosite explore; save it beside the file that was opened."]
        return "\n".join([*lines, dump_yaml(is_inside)])

    def command(self, settings: Mapping[str, str]) -> str:
        """Return the command that takes this view again."""
        given = "".join(f" --set {_quoted(f'{key}={_shown(value)}')}" for key, value in self._values(settings).items())
        return f"photosite simulate {Path(self.path).name}{given}"

    def _values(self, settings: Mapping[str, str]) -> dict[str, object]:
        """Return the values that are laid over the file: of the command line, and of the page's controls.

        Another scene or camera comes without what was said of the opened one, and without the motion of its layers.
        """
        _check(settings, self.path)
        values = _without(self.overrides, "sweep") | ({"sweep": None} if "sweep" in load_document(self.path).data else {})
        scene, camera = settings.get(SCENE, scene_list.OWN), settings.get(CAMERA, camera_list.OWN)
        if scene != scene_list.OWN:
            section = chart_section(scene, load_shot(self.path, self.overrides))
            values = _without(values, SCENE) | {SCENE: section} | _still(load_document(self.path, self.overrides).data)
        if camera != camera_list.OWN:
            values = _without(values, CAMERA) | {CAMERA: camera}
        return values | {key: _plain(key, text) for key, text in settings.items() if key not in (SCENE, CAMERA)}

    def _settle(self, settings: Mapping[str, str], opened: Shot) -> tuple[dict[str, str], tuple[str, ...]]:
        """Return the settings without those that are the file's own, with an ISO that the camera has, and what was changed."""
        _check(settings, self.path)
        settled = {
            key: text
            for key, text in settings.items()
            if (key, text) not in ((SCENE, scene_list.OWN), (CAMERA, camera_list.OWN))
        }
        name = settled.get(CAMERA)
        camera = opened.camera if name is None else library_camera(name)
        wanted = int(settled.get(ISO, opened.exposure.iso))
        nearest = nearest_iso(camera, wanted)
        if nearest == wanted:
            return settled, ()
        told = f"{camera.make} {camera.model} has ISO {camera.isos[0]} to {camera.isos[-1]}: {nearest} in place of {wanted}"
        return settled | {ISO: str(nearest)}, (told,)


SCENE, CAMERA, ISO = "scene", "camera", "exposure.iso"
KEYS = frozenset(
    {
        SCENE,
        CAMERA,
        "lens.focal_length",
        "lens.f_number",
        "lens.focus_distance",
        "exposure.time",
        ISO,
        "camera.pixel_pitch",
        "motion.camera.pan",
    }
)


def _check(settings: Mapping[str, str], path: str) -> None:
    """Raise PhotositeError for keys that are no control's, and values that no control gives."""
    for key, text in settings.items():
        if key not in KEYS:
            raise PhotositeError(f"the page does not change this; it changes {', '.join(sorted(KEYS))}", key=key)
        if not isinstance(text, str) or len(text) > LONGEST_VALUE:
            raise PhotositeError(f"give a text of up to {LONGEST_VALUE} letters, as the shot file writes it", key=key)
        known = {SCENE: (scene_list.OWN, *CHARTS), CAMERA: (camera_list.OWN, *camera_names())}.get(key)
        if known is not None and text not in known:
            raise PhotositeError(f"the page has {', '.join(known)}", key=key, value=text)
        if key == ISO and not (text.isascii() and text.isdecimal()):
            raise PhotositeError("give a whole number", key=key, value=text)


def _plain(key: str, text: str) -> object:
    """Return a value as YAML reads it: an ISO is a whole number."""
    return int(text) if key == ISO else text


def _without(values: Mapping[str, object], section: str) -> dict[str, object]:
    """Return values by dotted key without those of a section."""
    return {key: value for key, value in values.items() if key.partition(".")[0] != section}


def _still(data: Mapping[str, Any]) -> dict[str, object]:
    """Return the value that removes the motion of a scene's own parts from a shot file; {} where there is none."""
    motion = data.get("motion")
    if not isinstance(motion, dict) or not motion.keys() & {"layers", "vectors"}:
        return {}
    kept = {key: value for key, value in motion.items() if key not in ("layers", "vectors")}
    return {"motion": kept or None}


def _quoted(text: str) -> str:
    """Return a word for the shell."""
    return "'" + text.replace("'", "'\\''") + "'"


def _shown(value: object) -> str:
    """Return a value as --set takes it, without the folder of a file, which is the machine's own business."""
    if isinstance(value, str):
        return Path(value).name if value.startswith("/") else value
    return dump_flow(value)


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
