"""The points of a sweep. Each is made when it is asked for, so memory does not grow with their number."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from simulator.config.build import locate_error, validate
from simulator.config.document import Document, Place
from simulator.config.document_merge import remove_key, replace_value, select_section
from simulator.config.shot_file import apply_overrides, build_shot, load_document
from simulator.config.sweep_section import SweepSection, expand_values
from simulator.errors import PhotositeError
from simulator.pipeline.input_files import named_files
from simulator.pipeline.shot import Shot

# Beginnings of the keys that leave the light on the sensor as it is, so that points that differ in them alone share it.
SENSOR_KEYS = (
    "exposure.iso",
    "seeds.",
    "raw.",
    "camera.bit_depth",
    "camera.black_level",
    "camera.white_level",
    "camera.iso_table",
    "camera.read_noise",
    "camera.conversion_gain",
    "camera.stages",
)
MAX_CHECKED = 2000  # most values of one key that are checked when they are computed; listed values are all checked


@dataclass(frozen=True)
class SweepPoint:
    """One point of a sweep.

    name: stem of its files. values: dotted key -> value, as written.
    """

    index: int
    name: str
    values: dict[str, object]
    document: Document

    def shot(self) -> Shot:
        """Return the shot of this point. Raises PhotositeError with file and line."""
        return build_shot(self.document)

    def locate_error(self, error: PhotositeError) -> PhotositeError:
        """Return an error of taking the point, with file and line where it is about the value of a key of the document."""
        return locate_error(error, self.document)


class Sweep:
    """The points of a document with a `sweep:` section; an iterable that knows its length.

    The last key varies fastest. Each point's seeds.frame is the shot's plus the point's index, so that no two points
    share their noise, unless the sweep varies seeds.frame itself or says `same_noise: true`.
    """

    def __init__(self, document: Document):
        section_document = select_section(document, "sweep")
        section = validate(SweepSection, section_document)
        self._place = section_document.place
        self._base = remove_key(document, ("sweep",))
        self.values: dict[str, Sequence[Any]] = {}
        for key, values in section.vary.items():
            try:
                self.values[key] = expand_values(values)
            except ValueError as error:
                raise section_document.problem(("vary", key), f"{error}", key=f"sweep.vary.{key}") from None
        self._zip, self._same_noise = section.mode == "zip", section.same_noise
        self.listed = {key for key, values in section.vary.items() if isinstance(values, list)}
        lengths = {key: len(values) for key, values in self.values.items()}
        if self._zip and len(set(lengths.values())) > 1:
            counts = ", ".join(f"{key} has {length}" for key, length in lengths.items())
            raise section_document.problem(
                ("vary",), f"mode zip needs as many values for each key, but {counts}", key="sweep.vary"
            )

    def __len__(self) -> int:
        lengths = [len(values) for values in self.values.values()]
        if self._zip:
            return lengths[0]
        total = 1
        for length in lengths:
            total *= length
        return total

    def __iter__(self) -> Iterator[SweepPoint]:
        return (self[index] for index in range(len(self)))

    def by_light(self) -> Iterator[SweepPoint]:
        """Yield all points so that those that share their light follow each other: SENSOR_KEYS vary fastest."""
        if self._zip:
            yield from self
            return
        strides, stride = {}, 1
        for key in reversed(self.values):
            strides[key] = stride
            stride *= len(self.values[key])
        order = sorted(self.values, key=lambda key: key.startswith(SENSOR_KEYS))
        for rows in product(*(range(len(self.values[key])) for key in order)):
            yield self[sum(row * strides[key] for key, row in zip(order, rows, strict=True))]

    def __getitem__(self, index: int) -> SweepPoint:
        if not 0 <= index < len(self):
            raise IndexError(index)
        values, rest = {}, index
        for key in reversed(self.values):
            row = index if self._zip else rest % len(self.values[key])
            rest //= len(self.values[key])
            values[key] = self.values[key][row]
        return self._point(index, {key: values[key] for key in self.values})

    def _point(self, index: int, values: dict[str, object]) -> SweepPoint:
        document = self._base
        for key, value in values.items():
            written = self._place(("vary", key))
            document = _set_value(document, key, value, replace(written, via="sweep"))
        if not self._same_noise and "seeds.frame" not in self.values:
            document = self._advance_frame_seed(document, index)
        digits = max(4, len(str(len(self) - 1)))
        name = f"{self._base.data['name']}_{index:0{digits}d}"
        return SweepPoint(index, name, values, replace_value(document, "name", name, document.place(("name",))))

    def _advance_frame_seed(self, document: Document, index: int) -> Document:
        seeds = document.data.get("seeds")
        frame = seeds.get("frame", 0) if isinstance(seeds, dict) else 0
        if not isinstance(frame, int):
            return document  # the check of the shot names it
        return replace_value(document, "seeds.frame", frame + index, document.place(("seeds", "frame")))

    def check(self) -> None:
        """Build enough shots to check every value once, so that a mistake in the last point is found before the first runs.

        Raises PhotositeError with the line of the first value that is wrong.
        """
        strides, stride = {}, 1
        for key in reversed(self.values):
            strides[key] = stride
            stride *= len(self.values[key])
        for key, values in self.values.items():
            for row in self._rows_to_check(key, len(values)):
                point = self[row if self._zip else row * strides[key]]
                shot = point.shot()
                for keys, path in (
                    named_files(shot.scene, ("scene",))
                    + named_files(shot.lens, ("lens",))
                    + named_files(shot.motion, ("motion",))
                ):
                    if not path.is_file():
                        raise point.document.problem(keys, f"no such file (for {point.name}); check the path", path)

    def _rows_to_check(self, key: str, length: int) -> Iterable[int]:
        if key in self.listed or length <= MAX_CHECKED:
            return range(length)
        return sorted({round(step * (length - 1) / (MAX_CHECKED - 1)) for step in range(MAX_CHECKED)})


def _set_value(document: Document, key: str, value: object, place: Place) -> Document:
    """Return the document with one value of a point set; a camera name is replaced by the full section."""
    if key in ("camera", "camera.base"):
        return apply_overrides(replace_value(document, "camera", value, place), ())
    return replace_value(document, key, value, place)


def load_sweep(path: str | Path, overrides: Iterable[str] | Mapping[str, object] = ()) -> Sweep | None:
    """Return the checked sweep of a shot file, or None when it has no `sweep:` section."""
    document = load_document(path, overrides)
    if document.data.get("sweep") is None:
        return None
    sweep = Sweep(document)
    sweep.check()
    return sweep
