"""The points of a sweep. Each is made when it is asked for, so memory does not grow with their number."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

from simulator.config.build import locate_error, validate
from simulator.config.document import Document
from simulator.config.document_merge import remove_key, replace_value, select_section
from simulator.config.quantity import format_quantity, parse_quantity
from simulator.config.series_section import SECONDS, SeriesSection, count_exposure_times
from simulator.config.shot_file import CAMERA_KEYS, Setting, apply_settings, build_shot, load_document, parse_overrides
from simulator.config.sweep_section import SweepSection, check_count, expand_values
from simulator.errors import PhotositeError, why_no_file
from simulator.pipeline.input_files import named_files
from simulator.pipeline.motion_span import motion_span
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
BY_HAND = ("manual", "shutter_priority")  # modes of an exposure whose time is stated
COMPENSATION = "exposure.compensation"
FRAME = "frame"  # the frames of a series, among the keys of a sweep
MAX_CHECKED = 2000  # most values of one key that are checked when they are computed; listed values are all checked


@dataclass(frozen=True)
class SweepPoint:
    """One point of a sweep.

    name: stem of its files. values: dotted key -> value, as written. interval_s: to the release of the next frame of a series,
        in which all exposures must end [s]; None: whatever they take.
    """

    index: int
    name: str
    values: dict[str, object]
    document: Document
    interval_s: float | None = None

    def shot(self) -> Shot:
        """Return the shot of this point. Raises PhotositeError with file and line."""
        return replace(build_shot(self.document), interval_s=self.interval_s)

    def locate_error(self, error: PhotositeError) -> PhotositeError:
        """Return an error of taking the point, with file and line where it is about the value of a key of the document."""
        return locate_error(error, self.document)


def _bracket_key(document: Document) -> str:
    """Return the key that a bracket varies: the time, or the compensation where the camera would even out another time."""
    exposure = document.data.get("exposure")
    given = exposure if isinstance(exposure, dict) else {}
    is_metered = given.get("mode", "manual") != "manual" or given.get("auto_iso") is not None
    return COMPENSATION if is_metered else "exposure.time"


class Sweep:
    """The points of a document with a `sweep:` section; an iterable that knows its length.

    The last key varies fastest, and the frames of a series faster still. Each point's seeds.frame is the shot's plus its
    index, so that no two points share their noise, unless the sweep varies seeds.frame itself or says `same_noise: true`.
    """

    def __init__(self, document: Document, settings: Iterable[Setting] = ()):
        """Read a document. settings: those that stand in it already; those of the camera are laid over each that is varied.

        Raises PhotositeError with file and line.
        """
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
        self._series, self._section = section.series, section_document
        if self._series is None and not section.vary:
            rule = "varies nothing; give vary, such as {exposure.iso: [100, 400]}, or a series"
            raise section_document.problem((), rule, key="sweep")
        self._zip, self._same_noise = section.mode == "zip", section.same_noise
        self.listed = {key for key, values in section.vary.items() if isinstance(values, list)}
        lengths = {key: len(values) for key, values in self.values.items()}
        if self._zip and len(set(lengths.values())) > 1:
            counts = ", ".join(f"{key} has {length}" for key, length in lengths.items())
            raise section_document.problem(
                ("vary",), f"mode zip needs as many values for each key, but {counts}", key="sweep.vary"
            )
        if self._series is not None:
            with self._locate_series():
                self._series.check()
        try:
            check_count(self._count)
        except ValueError as error:
            raise section_document.problem((), f"{error}", key="sweep") from None
        laid = [one for one in settings if one[0].startswith("camera.") and one[0] not in CAMERA_KEYS]
        self._laid = laid if any(key in CAMERA_KEYS for key in self.values) else []

    @contextmanager
    def _locate_series(self) -> Iterator[None]:
        """Turn a ValueError about the series into a PhotositeError with its line."""
        try:
            yield
        except ValueError as error:
            raise self._section.problem(("series",), f"{error}", key="sweep.series") from None

    @property
    def frames(self) -> int:
        """Frames of the series at every point; 1 without a series."""
        return 1 if self._series is None else self._series.frames

    @property
    def keys(self) -> list[str]:
        """Dotted keys that differ from point to point, those of the series last."""
        bracketed = [] if self._series is None or not self._series.bracket else [_bracket_key(self._base)]
        series = [] if self._series is None else ["exposure.start", *bracketed]
        return [*(key for key in self.values if key not in series), *series]

    def __len__(self) -> int:
        return self._count

    @property
    def _count(self) -> int:
        """Number of points, also where len() could not hold it."""
        lengths = [len(values) for values in self.values.values()]
        return self.frames * (lengths[0] if self._zip and lengths else math.prod(lengths))

    def __iter__(self) -> Iterator[SweepPoint]:
        return (self[index] for index in range(len(self)))

    def by_light(self) -> Iterator[SweepPoint]:
        """Yield all points so that those that share their light follow each other: SENSOR_KEYS vary fastest."""
        if self._zip:
            yield from self
            return
        strides = self._strides()
        order = sorted(strides, key=lambda key: key.startswith(SENSOR_KEYS))
        counts = {key: len(values) for key, values in self.values.items()} | {FRAME: self.frames}
        for rows in product(*(range(counts[key]) for key in order)):
            yield self[sum(row * strides[key] for key, row in zip(order, rows, strict=True))]

    def _strides(self) -> dict[str, int]:
        """Distance between the indices of points that differ by one value of a key; frames lie side by side."""
        strides, stride = {}, self.frames
        for key in reversed(self.values):
            strides[key] = stride
            stride *= len(self.values[key])
        return dict(reversed(strides.items())) | {FRAME: 1}

    def __getitem__(self, index: int) -> SweepPoint:
        if not 0 <= index < len(self):
            raise IndexError(index)
        place, frame = divmod(index, self.frames)
        values, rest = {}, place
        for key in reversed(self.values):
            row = place if self._zip else rest % len(self.values[key])
            rest //= len(self.values[key])
            values[key] = self.values[key][row]
        return self._point(index, {key: values[key] for key in self.values}, frame)

    def _point(self, index: int, values: dict[str, object], frame: int) -> SweepPoint:
        varied = [(key, value, replace(self._place(("vary", key)), via="sweep")) for key, value in values.items()]
        document = apply_settings(self._base, [*self._laid, *varied])
        if self._series is not None:
            document, times = self._set_frame(document, self._series, frame)
            values |= times
        if not self._same_noise and "seeds.frame" not in self.values:
            document = self._advance_frame_seed(document, index)
        digits = max(4, len(str(len(self) - 1)))
        name = f"{self._base.data['name']}_{index:0{digits}d}"
        document = replace_value(document, "name", name, document.place(("name",)))
        return SweepPoint(index, name, values, document, None if self._series is None else self._series.interval)

    def _set_frame(self, document: Document, series: SeriesSection, frame: int) -> tuple[Document, dict[str, object]]:
        """Return the document of a frame of the series, and its exposure.start and what is bracketed, as written.

        Those of the document are the first frame's, and of a bracket those at 0 stops. Where they cannot be read, the check of
        the shot names them.
        """
        exposure = document.data.get("exposure")
        given = exposure if isinstance(exposure, dict) else {}
        try:
            base_s, first_s = (parse_quantity(given.get(key, "0 s"), SECONDS) for key in ("time", "start"))
        except ValueError:
            return document, {}
        key = _bracket_key(document)
        is_metered_bracket = series.bracket is not None and key == COMPENSATION
        is_by_hand = given.get("mode", "manual") in BY_HAND
        if series.interval is None and (is_metered_bracket or not is_by_hand):
            rule = "the camera chooses the exposure when it is planned, so that no gap says when it ends; give an interval"
            raise self._section.problem(("series",), rule, key="sweep.series")
        needs_flow_time = _needs_flow_time(document)
        if needs_flow_time and not is_by_hand and len(set(series.bracket or ())) > 1:
            rule = (
                "the camera chooses the time of each frame of the bracket when it is planned, so that nothing says how far "
                "the middle of the next exposure is, to which the flow leads; give motion.flow_time, or leave flow out of truth"
            )
            raise self._section.problem(("series",), rule, key="sweep.series")
        with self._locate_series():
            known = base_s, count_exposure_times(document), not is_metered_bracket
            (start_s, time_s), (next_start_s, next_time_s) = (series.times(one, *known) for one in (frame, frame + 1))
        # In 12 digits, so that 3 times 0.1 s reads 0.3 s.
        values: dict[str, object] = {"exposure.start": format_quantity(float(f"{first_s + start_s:.12g}"), SECONDS)}
        if series.bracket is not None and is_metered_bracket:
            stated = given.get("compensation", 0.0)
            if not isinstance(stated, int | float):
                return document, {}
            values[key] = stated + series.bracket[frame % len(series.bracket)]
        elif series.bracket is not None:
            values[key] = format_quantity(float(f"{time_s:.12g}"), SECONDS)
        place = replace(self._place(("series",)), via="sweep")
        for key, value in values.items():
            document = replace_value(document, key, value, place)
        if needs_flow_time:
            flow_s = next_start_s + 0.5 * next_time_s - (start_s + 0.5 * time_s)  # to the middle of the next exposure
            document = replace_value(document, "motion.flow_time", format_quantity(float(f"{flow_s:.12g}"), SECONDS), place)
        return document, values

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
        for index in self._indices_to_check():
            self._check_series(index)

    def covering_points(self) -> Iterator[SweepPoint]:
        """Yield points that between them have each value that `check` builds, and each frame of a series.

        Two sweeps of as many points are the same where these points are, so that many points need not be compared.
        """
        for index in dict.fromkeys((*range(self.frames), *self._indices_to_check())):
            yield self[index]

    def _check_series(self, index: int) -> None:
        """Build the shots of the first and the last frame from a point on, and check that paths hold for both."""
        point, last = self[index], self[index + self.frames - 1]
        shot = self._check_point(point)
        if shot.motion is None:
            return
        try:
            spans = [span for one in (shot, last.shot()) if (span := motion_span(one)) is not None]
            shot.motion.check_span(min(first_s for first_s, _ in spans), max(last_s for _, last_s in spans))
        except PhotositeError as error:
            series = f" (for the {self.frames} frames of sweep.series)" if self.frames > 1 else ""
            raise last.locate_error(error.replace(rule=f"{error.rule}{series}")) from None

    def _check_point(self, point: SweepPoint) -> Shot:
        """Return the shot of a point. Raises PhotositeError, also for a file that is not there."""
        shot = point.shot()
        sections = (shot.scene, "scene"), (shot.lens, "lens"), (shot.motion, "motion")
        for keys, path in (named for section, key in sections for named in named_files(section, (key,))):
            if not path.is_file():
                raise point.document.problem(keys, f"{why_no_file(path)} (for {point.name}); check the path", path)
        return shot

    def _indices_to_check(self) -> Iterator[int]:
        """Yield the index of a point for each value of each key, its first frame; that of the first point without keys."""
        if not self.values:
            yield 0
        strides = self._strides()
        for key, values in self.values.items():
            for row in self._rows_to_check(key, len(values)):
                yield row * (self.frames if self._zip else strides[key])

    def _rows_to_check(self, key: str, length: int) -> Iterable[int]:
        if key in self.listed or length <= MAX_CHECKED:
            return range(length)
        return sorted({round(step * (length - 1) / (MAX_CHECKED - 1)) for step in range(MAX_CHECKED)})


def _needs_flow_time(document: Document) -> bool:
    """Return whether a document asks for the flow of what moves and does not state the time that it spans."""
    motion, truth = (document.data.get(key) for key in ("motion", "truth"))
    return isinstance(motion, dict) and "flow_time" not in motion and isinstance(truth, list) and "flow" in truth


def load_sweep(path: str | Path, overrides: Iterable[str] | Mapping[str, object] = ()) -> Sweep | None:
    """Return the checked sweep of a shot file, or None when it has no `sweep:` section."""
    overrides = overrides if isinstance(overrides, Mapping) else list(overrides)
    document = load_document(path, overrides)
    if document.data.get("sweep") is None:
        return None
    sweep = Sweep(document, parse_overrides(overrides))
    sweep.check()
    return sweep
