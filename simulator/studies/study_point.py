"""Take one point of a study: simulate it, measure it, and write its files with the hash of all that they follow from."""

import hashlib
import inspect
import json
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from simulator import __version__
from simulator.atomic_files import atomic_write
from simulator.config import dump_yaml
from simulator.config.document_merge import is_table
from simulator.config.quantity import split_quantity
from simulator.config.study_file import Study, StudyPoint
from simulator.config.unit_words import APERTURES, SHORT
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.measurement.quantities import Figure, Measured, MeasuredFrame
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate_on_disk
from simulator.raw.dng.writer import write_dng
from simulator.raw.raw_image import Raw
from simulator.raw.truth_exr import write_twin
from simulator.studies.study_folder import (
    PointFiles,
    Record,
    State,
    Timing,
    files_of_point,
    read_record,
    write_record,
    write_time,
)
from simulator.studies.study_preview import write_preview

UNITS = {*SHORT.values(), *APERTURES}  # of the numbers in a resolved shot


@dataclass(frozen=True)
class StudyTask:
    """All that taking points needs; it travels to other machines.

    folder: where results are written; on a cluster every machine sees it under this path.
    device: part of an OpenCL device's label, None for the default. cache: light of earlier points; each worker has its own.
    redo: take also points that are done.
    """

    study: Study
    folder: Path
    device: str | None = None
    cache: LightCache = field(default_factory=LightCache)
    redo: bool = False


@dataclass(frozen=True)
class Outcome:
    """What became of a point. how: taken here, or kept since it was there. record: its state with all that was measured."""

    index: int
    name: str
    command: str
    how: Literal["taken", "kept"]
    record: Record


def take_points(task: StudyTask, indices: tuple[int, ...]) -> list[Outcome]:
    """Take points one after the other, those that are not done. Raises PhotositeError where no record can be written."""
    return [take_point(task, index) for index in indices]


def take_point(task: StudyTask, index: int) -> Outcome:
    """Take a point unless it is done. A point that cannot be taken has a record that says why.

    Raises PhotositeError where not even the record can be written.
    """
    start, point = time.perf_counter(), task.study[index]
    files = files_of_point(task.folder, point.name)
    key, label = "", ""
    try:
        shot = point.shot()
        key = key_of_point(task.study, shot)
        if (there := _done_record(task, files, key)) is not None:
            return Outcome(index, point.name, point.command, "kept", there)
        label = open_device(task.device).info.label
        record = _make(task, point, shot, key, files)
    except PhotositeError as error:
        record = Record(key, str(point.locate_error(error)))
    except (OSError, MemoryError) as error:
        record = Record(key, f"{type(error).__name__}: {error}")
    write_time(files.time, Timing(round(time.perf_counter() - start, 4), label))
    write_record(files.record, record)
    return Outcome(index, point.name, point.command, "taken", record)


def find_done(task: StudyTask, index: int) -> Outcome | None:
    """Return the outcome of a point that is done; None of one that is to be taken."""
    point = task.study[index]
    files = files_of_point(task.folder, point.name)
    if task.redo:
        return None
    try:
        there = _done_record(task, files, key_of_point(task.study, point.shot()))
    except PhotositeError:
        return None
    return None if there is None else Outcome(index, point.name, point.command, "kept", there)


def _done_record(task: StudyTask, files: PointFiles, key: str) -> Record | None:
    """Return the record of a point that is done with this key, whose files all stand; None where it is to be taken."""
    there = None if task.redo else _known(files)
    return there if there is not None and there.key == key and is_complete(task.study, files, there) else None


def state_of_point(task: StudyTask, point: StudyPoint) -> State:
    """Return the state of a point by its files. Raises PhotositeError where the point gives no shot."""
    files = files_of_point(task.folder, point.name)
    there = _known(files)
    if there is None:
        return "missing"
    if there.key != key_of_point(task.study, point.shot()):
        return "stale"
    return there.state if there.error is not None or is_complete(task.study, files, there) else "missing"


def is_complete(study: Study, files: PointFiles, record: Record) -> bool:
    """Return whether a point is done and all its files stand."""
    kept = {"dng": files.dng, "truth": files.truth}
    wanted = [files.shot, *(kept[kind] for kind in study.keep), *([files.curves] if record.curves else [])]
    return record.error is None and all(path.is_file() for path in wanted)


def key_of_point(study: Study, shot: Shot) -> str:
    """Return the hash of all that a point's results follow from: shot, content of its files, what is measured, version.

    Raises PhotositeError for a file that cannot be read.
    """
    try:
        inputs = fingerprints(shot.scene, shot.lens, shot.motion)
    except OSError as error:
        raise PhotositeError(f"{error.strerror}; check the path", file=error.filename) from None
    contents = {one["path"]: one["sha256"] for one in inputs}
    told = [__version__, _by_content(shot.resolved, contents), inputs_without_paths(inputs), study.measured, study.keep]
    digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode())
    for quantity in study.measure.values():
        digest.update(_code_of(quantity))
    return digest.hexdigest()[:32]


def inputs_without_paths(inputs: list[dict[str, str]]) -> list[tuple[str, str]]:
    """Return key and hash of each input file."""
    return [(one["key"], one["sha256"]) for one in inputs]


def _by_content(value: Any, contents: dict[str, str]) -> Any:
    """Return plain data with the hash of a file in place of its path, so that a study may be moved with its files."""
    if isinstance(value, dict):
        return {str(key): _by_content(inner, contents) for key, inner in value.items()}
    if isinstance(value, list):
        return [_by_content(inner, contents) for inner in value]
    return contents.get(value, value) if isinstance(value, str) else value


def _code_of(quantity: object) -> bytes:
    """Return the source of a quantity that is a function of the user's own."""
    load = getattr(quantity, "load", None)
    if load is None:
        return b""
    function = load()
    try:
        return Path(inspect.getsourcefile(function) or "").read_bytes()
    except (TypeError, OSError):  # a function without a file, or an object that can be called
        return repr(function).encode()


def _known(files: PointFiles) -> Record | None:
    """Return the record of a point; None where there is none that can be read."""
    try:
        return read_record(files.record)
    except PhotositeError:
        return None


def _make(task: StudyTask, point: StudyPoint, shot: Shot, key: str, files: PointFiles) -> Record:
    """Simulate and measure a point, and write all its files but the record. Raises PhotositeError, OSError, MemoryError."""
    # The record vouches for the other files, so an old one goes before the first of them changes.
    files.record.unlink(missing_ok=True)
    predicted_s = None if shot.time_budget_s is not None else 1e-3 * plan(shot, cache=task.cache).cost_ms()
    with simulate_on_disk(shot, files.dng.parent, device=task.device, cache=task.cache) as raw:
        measured = measure_all(task.study, raw, shot)
        resolved: dict[str, Any] = raw.resolved  # plain data, as the sidecar of a frame holds it
        with atomic_write(files.shot, durable=False) as path:
            path.write_text(dump_yaml(shot.resolved), encoding="utf-8")
        _write_kept(task.study, raw, files)
        _write_curves(measured, files.curves)
        if not write_preview(raw, files.preview):
            files.preview.unlink(missing_ok=True)
    return Record(
        key,
        resolved=flat_leaves(resolved["shot"] or shot.resolved),
        figures={label: _plain_figures(one) for label, one in measured.items()},
        curves={label: _axes_of_curves(one) for label, one in measured.items() if one.curves},
        warnings=tuple(resolved["warnings"]),
        predicted_error_sigma=float(resolved["error_budget"]["predicted_sigma"]),
        predicted_seconds=resolved["time_budget"]["predicted_s"] if predicted_s is None else float(f"{predicted_s:.4g}"),
    )


def measure_all(study: Study, raw: Raw, shot: Shot) -> dict[str, Measured]:
    """Return what every label of a study measures in a frame. Raises PhotositeError, which names the label."""
    frame, found = MeasuredFrame.from_raw(raw, shot), {}
    for label, quantity in study.measure.items():
        try:
            found[label] = quantity.measure(frame)
        except PhotositeError as error:
            raise error.inside(f"measure.{label}") from error
    return found


def _write_kept(study: Study, raw: Raw, files: PointFiles) -> None:
    """Write the files of a frame that stay; remove those that an earlier run of the study kept."""
    for kind, path, write in (("dng", files.dng, write_dng), ("truth", files.truth, write_twin)):
        if kind in study.keep:
            write(raw, path)
        else:
            path.unlink(missing_ok=True)


def _write_curves(measured: dict[str, Measured], path: Path) -> None:
    """Write all curves of a point as arrays `LABEL.CURVE.x` and `.y`."""
    arrays: dict[str, Any] = {}
    for label, one in measured.items():
        for name, curve in one.curves.items():
            arrays |= {
                f"{label}.{name}.x": np.asarray(curve.x, np.float64),
                f"{label}.{name}.y": np.asarray(curve.y, np.float64),
            }
    if not arrays:
        with suppress(FileNotFoundError):
            path.unlink()
        return
    with atomic_write(path, durable=False) as temporary, open(temporary, "wb") as file:
        np.savez(file, **arrays)


def _plain_figures(measured: Measured) -> dict[str, Figure]:
    """Return figures whose numbers are Python's own, as they are read back from a record."""
    return {
        name: Figure(float(one.value), one.unit, None if one.sigma is None else float(one.sigma))
        for name, one in measured.figures.items()
    }


def _axes_of_curves(measured: Measured) -> dict[str, dict[str, str]]:
    """Return names and units of the axes of each curve."""
    names = ("x_name", "x_unit", "y_name", "y_unit")
    return {name: {one: getattr(curve, one) for one in names} for name, curve in measured.curves.items()}


def flat_leaves(value: Any, keys: tuple[str, ...] = ()) -> dict[str, Any]:
    """Return dotted key -> number or text of all leaves of a resolved shot, without lists, curves and tables."""
    if isinstance(value, dict):
        if is_table(value) or keys[-1:] == ("source",):
            return {}
        return {key: leaf for name, inner in value.items() for key, leaf in flat_leaves(inner, (*keys, str(name))).items()}
    return {} if value is None or isinstance(value, list) or keys[-1:] == ("source",) else {".".join(keys): value}


def number_and_unit(text: object) -> tuple[object, str]:
    """Return number and unit of a resolved value that is a quantity; others as they are, "".

    F-numbers and T-stops are without their unit.
    """
    if not isinstance(text, str):
        return text, ""
    with suppress(ValueError):
        number, unit = split_quantity(text)
        if text.startswith("infinity"):
            return number, "m"  # only a distance can be infinite
        if unit in UNITS:
            return number, "" if unit in APERTURES else unit
    return text, ""
