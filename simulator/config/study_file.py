"""A study in YAML: a shot, what varies from point to point, and what is measured at each point."""

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from simulator.config.build import build, locate_error, validate
from simulator.config.dataclass_sections import make_section
from simulator.config.document import Document, read_document
from simulator.config.document_merge import (
    find_config,
    named_file,
    parse_override,
    remove_key,
    replace_value,
    select_section,
)
from simulator.config.messages import suggest_nearest
from simulator.config.section_types import Section
from simulator.config.shot_file import Setting, apply_settings, build_shot, dump_resolved, load_document, make_shot_section
from simulator.config.study_axes import Axis, Product, dimensions, read_vary
from simulator.config.study_command import absolute_files, shot_name, simulate_command
from simulator.errors import PhotositeError, why_no_file
from simulator.pipeline.input_files import named_files
from simulator.pipeline.shot import Shot

NAME_LETTERS = 90  # of a point's name that are made of its values; a longer one ends in a hash
SEEDS = 2**32  # of frames
Kept = Literal["dng", "truth"]


class StudySection(Section):
    """The keys of a study file."""

    study: Annotated[str, Field(pattern=r"^[\w+-][\w.+ -]{0,79}$", description="name of the study")]
    shot: Annotated[str, Field(description="a name in configs/shots or the path of a shot file; its own sweep is left out")]
    description: Annotated[str, Field(description="for the report")] = ""
    set: Annotated[dict[str, Any], Field(description="dotted key -> value, at every point")] = {}
    vary: Annotated[list[Any], Field(description="entries whose combinations are the points")]
    measure: Annotated[dict[str, Any], Field(description="label -> {quantity: settings}")] = {}
    keep: Annotated[list[Kept], Field(description="files of each point that stay: dng, truth")] = []
    same_noise: Annotated[
        bool, Field(description="use seeds.frame as it is at every point; otherwise each point has its own")
    ] = False
    resolved: Annotated[dict[str, Any] | None, Field(description="written by a run, not read")] = None


@dataclass(frozen=True)
class StudyPoint:
    """One point of a study.

    name: stem of its files. It follows from the values alone, so that it stays when the study grows; where an axis has values
        that read alike in a file name, it ends in a hash of them.
    values: dotted key of an axis -> value as written, or the name of a variant.
    base: document of the study's shot, which lies in shot_path. settings: of this point, in it.
    had_sweep: whether the file has a sweep, which is left out.
    """

    index: int
    name: str
    values: dict[str, object]
    base: Document
    settings: tuple[Setting, ...]
    shot_path: Path
    had_sweep: bool

    @property
    def command(self) -> str:
        """Line that takes the shot alone, from any folder."""
        return simulate_command(self.shot_path, self.settings, self.had_sweep)

    @cached_property
    def document(self) -> Document:
        """The document of the shot. Raises PhotositeError for a setting that cannot be made."""
        return apply_settings(self.base, self.settings)

    def shot(self) -> Shot:
        """Return the shot of this point. Raises PhotositeError with file and line."""
        return build_shot(self.document)

    def locate_error(self, error: PhotositeError) -> PhotositeError:
        """Return an error of taking the point, with file and line where it is about the value of a key of the document."""
        try:
            return locate_error(error, self.document)
        except PhotositeError:
            return error


class Study:
    """The points of a study file; a sequence whose points are made when they are asked for.

    name, description, keep: as the file states them. measure: label -> object of a quantity. measured: the same as plain data.
    """

    def __init__(self, document: Document, quantities: Mapping[str, type], settings: Iterable[Setting] = ()) -> None:
        """Read a document. quantities: class of each word of `measure:`. settings: of every point, after those of the file.

        Raises PhotositeError with file and line.
        """
        section = validate(StudySection, document)
        self.name, self.description, self.keep = section.study, section.description, tuple(section.keep)
        self._document, self._same_noise = document, section.same_noise
        self.shot_path = find_config("shots", section.shot, document.place(("shot",)), "shot")
        base = load_document(self.shot_path)
        self._had_sweep = base.data.get("sweep") is not None
        self._base = remove_key(base, ("sweep",)) if "sweep" in base.data else base
        self._set = (*_settings(document), *settings)
        self.vary: Product = read_vary(select_section(document, "vary"))
        self._axes: dict[str, Axis] = {axis.key: axis for axis in self.vary.axes}
        self.measure: dict[str, Any] = {}
        self.measured: dict[str, Any] = {}
        for label in section.measure:
            self.measure[label], self.measured[label] = _read_quantity(document, label, quantities)

    def __len__(self) -> int:
        return len(self.vary)

    def __iter__(self) -> Iterator[StudyPoint]:
        return (self[index] for index in range(len(self)))

    def __getitem__(self, index: int) -> StudyPoint:
        if not 0 <= index < len(self):
            raise IndexError(index)
        rows = self.vary.rows(index)
        axes = [(axis, rows[key]) for key, axis in self._axes.items()]
        values: dict[str, object] = {axis.key: axis.values[row] for axis, row in axes}
        varied = [one for axis, row in axes for one in axis.settings(row)]
        name, place = _name_point(values, self._alike), self._document.place(("study",))
        settings = [*self._set, *varied, ("name", name, place)]
        if not self._same_noise and self._base_seed is not None and not any(map(_states_frame_seed, varied)):
            settings.append(("seeds.frame", (int(_digest(values)[:8], 16) + self._base_seed) % SEEDS, place))
        return StudyPoint(index, name, values, self._base, tuple(settings), self.shot_path, self._had_sweep)

    @cached_property
    def _alike(self) -> dict[str, frozenset[str]]:
        """Texts that several values of an axis have in file names, by its key; steps and whole numbers have none."""
        found: dict[str, frozenset[str]] = {}
        for key, axis in self._axes.items():
            listed = axis.values if isinstance(axis.values, list) else ()
            counts = Counter(_as_file_name(_value_text(value)) for value in listed)
            found[key] = frozenset(text for text, count in counts.items() if count > 1)
        return found

    @cached_property
    def _base_seed(self) -> int | None:
        """Frame seed of the shot with what is set at every point; None where it is none, which the check of the shot names."""
        document = self._base
        try:
            for setting in self._set:
                if setting[0].partition(".")[0] == "seeds":
                    document = replace_value(document, *setting)
        except PhotositeError:
            return None
        seeds = document.data.get("seeds")
        found = (seeds or {}).get("frame", 0) if isinstance(seeds, dict | None) else None
        return found if isinstance(found, int) and 0 <= found < SEEDS else None

    @property
    def keys(self) -> list[str]:
        """Axes in the order of the file: dotted keys, and names of variants."""
        return list(self._axes)

    @property
    def dimensions(self) -> list[tuple[tuple[str, ...], int]]:
        """Axes that vary together, and the number of their values; the points are all combinations, the last fastest."""
        return [(tuple(axis.key for axis in part.axes), len(part)) for part in dimensions(self.vary)]

    def by_light(self) -> list[list[int]]:
        """Return the indices of the points, those that have the same light on the sensor in one list, in the order to take."""
        deciding = [key for key, axis in self._axes.items() if not axis.keeps_light]
        groups: dict[tuple[int, ...], list[int]] = {}
        for index in range(len(self)):
            rows = self.vary.rows(index)
            groups.setdefault(tuple(rows[key] for key in deciding), []).append(index)
        return list(groups.values())

    def check(self) -> None:
        """Build shots so that every value is met, before the first point is taken.

        A value that gives no shot beside any of the first, middle and last values of the other axes is refused: it is a mistake
        in the file. One that only some combinations refuse is not.
        Raises PhotositeError with the line.
        """
        fine: set[int] = set()
        for axis in self.vary.axes:
            for row in axis.to_check():
                self._check_value(axis, row, fine)

    def _check_value(self, axis: Axis, row: int, fine: set[int]) -> None:
        """Find a point with a value that gives a shot. fine: those known to. Raises the PhotositeError of the first."""
        first: PhotositeError | None = None
        for index in self.vary.find(axis.key, row):
            try:
                if index not in fine:
                    self._check_point(self[index])
                    fine.add(index)
                return
            except PhotositeError as error:
                first = error if first is None else first
        if first is not None:
            raise first

    def _check_point(self, point: StudyPoint) -> None:
        """Build the shot of a point. Raises PhotositeError, also for a file that is not there."""
        shot = point.shot()
        sections = (shot.scene, "scene"), (shot.lens, "lens"), (shot.motion, "motion")
        for keys, path in (named for section, key in sections for named in named_files(section, (key,))):
            if not path.is_file():
                raise point.document.problem(keys, f"{why_no_file(path)} (for {point.name}); check the path", path)

    def describe(self) -> dict[str, Any]:
        """Return the study as plain data that can be read from any folder, with what it was resolved to."""
        data = {key: value for key, value in self._document.data.items() if key != "resolved"}
        folder = self._document.place(()).folder
        data["shot"] = shot_name(self.shot_path)
        settings = {key: absolute_files(value, place.folder) for key, value, place in self._set}
        data |= {"set": settings} if settings else {}
        data["vary"] = absolute_files(data["vary"], folder)
        data |= {"measure": self.measured} if self.measured else {}
        base = apply_settings(self._base, self._set)
        return data | {"resolved": {"points": len(self), "shot": _resolve(base)}}


def _resolve(document: Document) -> dict[str, Any]:
    """Return the full configuration of a shot; {} where only the points' own values make it one."""
    try:
        return build_shot(document).resolved
    except PhotositeError:
        return {}


def load_study_file(path: str | Path, quantities: Mapping[str, type], overrides: Iterable[str] = ()) -> Study:
    """Return the checked study of a file, or of a name in configs/studies.

    quantities: class of each word of `measure:`. overrides: `dotted.path=value` texts, set in the shot of every point, as
    --set of `photosite simulate` takes them. Raises PhotositeError with file and line.
    """
    study = Study(read_document(named_file("studies", path)), quantities, [parse_override(text) for text in overrides])
    study.check()
    return study


def _settings(document: Document) -> list[Setting]:
    """Return the settings of `set:`."""
    given = document.data.get("set") or {}
    return [(str(key), value, document.place(("set", key))) for key, value in given.items()]


def _states_frame_seed(setting: Setting) -> bool:
    key, value, _ = setting
    return key == "seeds.frame" or (key == "seeds" and isinstance(value, dict) and "frame" in value)


def _read_quantity(document: Document, label: str, quantities: Mapping[str, type]) -> tuple[Any, dict[str, Any]]:
    """Return the object of an entry of `measure:`, and its plain data with defaults."""
    place = ("measure", label)
    if not re.fullmatch(r"[A-Za-z_][\w-]*", str(label)):
        raise document.problem(place, "a label is letters, digits, _ and -, and begins with a letter", label, key="measure")
    if label in make_shot_section().model_fields:
        rule = f"{label} is a section of the shot, whose values are columns of the results, too; choose another label"
        raise document.problem(place, rule, key="measure")
    given = document.data["measure"][label]
    given = {given: None} if isinstance(given, str) else given
    if not isinstance(given, dict) or len(given) != 1:
        rule = f"give one quantity, such as {{patch: {{area: [0, 0, 64, 64]}}}}; there are {', '.join(quantities)}"
        raise document.problem(place, rule, key=f"measure.{label}")
    ((word, settings),) = given.items()
    if word not in quantities:
        raise document.problem((*place, word), f"no such quantity; {suggest_nearest(str(word), list(quantities))}", word)
    model = make_section(quantities[word])
    if settings is None:
        settings = {}
    elif not isinstance(settings, dict):  # the value of its first key alone
        name, field = next(iter(model.model_fields.items()))
        settings = {field.alias or name: settings}
    places = {keys[len(place) + 1 :]: one for keys, one in document.places.items() if keys[: len(place) + 1] == (*place, word)}
    section = Document(settings, places | {(): document.place((*place, word))})
    try:
        values = validate(model, section)
        return build(values, (), section), {word: dump_resolved(values)}
    except PhotositeError as error:
        key = ".".join(filter(None, ("measure", label, str(word), error.key)))
        raise error.replace(key=key) from None


def _name_point(values: Mapping[str, object], alike: Mapping[str, frozenset[str]]) -> str:
    """Return the stem of a point's files: the last word of each key with its value.

    alike: texts that several values of an axis have in file names, by its key. A name ends in a hash where it has one of them,
    where it is long or holds other signs than numbers and paths do, and where a value reads as if the next key began in it.
    """
    last = [key.rpartition(".")[2] for key in values]
    words = [key if last.count(word) > 1 else word for key, word in zip(values, last, strict=True)]
    texts = {key: _value_text(value) for key, value in values.items()}
    plain = "_".join(f"{word}-{text}" for word, text in zip(words, texts.values(), strict=True))
    safe, words_alone = _as_file_name(plain), _as_file_name("_".join(f"{word}-" for word in words))
    begins = [_as_file_name(f"_{word}-") for word in words[1:]]
    is_hashed = (
        len(safe) > NAME_LETTERS
        or re.search(r"[^\w.+/ -]", plain) is not None
        or any(_as_file_name(text) in alike[key] for key, text in texts.items())
        or any(safe.count(begin) > words_alone.count(begin) for begin in begins)
    )
    return f"{safe[:NAME_LETTERS]}_{_digest(values)[:12]}" if is_hashed else safe


def _value_text(value: object) -> str:
    return str(value) if isinstance(value, str | int | float) else json.dumps(value)


def _as_file_name(text: str) -> str:
    return re.sub(r"[^\w.+-]+", "-", text)


def _digest(values: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
