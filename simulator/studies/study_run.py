"""Run a study: take the points that are missing or stale, in this process or on a cluster, and write the table."""

import os
import platform
import shlex
import sys
import time
from collections import Counter
from collections.abc import Callable, Container, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from simulator import __version__
from simulator.atomic_files import atomic_write, remove_abandoned
from simulator.config import dump_yaml
from simulator.config.document import read_document
from simulator.config.study_file import Study, load_study_file
from simulator.device import devices
from simulator.errors import PhotositeError
from simulator.measurement.quantities import QUANTITIES
from simulator.progress import Progress, Steps, silent
from simulator.raw.canonical_json import json_text
from simulator.studies.cluster import cluster, map_on_cluster
from simulator.studies.study_folder import PROVENANCE, STUDY, Record, files_of_point, read_time, write_record
from simulator.studies.study_point import Outcome, StudyTask, find_done, take_point, take_points
from simulator.studies.study_result import StudyResult, load
from simulator.studies.study_table import make_table, write_table

# Between tables that are written while points are taken, so that they can be looked at: seconds, and times that one takes.
TABLE_EVERY_S, TABLE_EVERY = 60.0, 20.0
MOST_IN_CHUNK = 16  # points that a worker takes one after the other, since they have the same light
CHUNKS_PER_WORKER = 4
LIBRARIES = ("numpy", "scipy", "pyopencl", "rawpy", "OpenImageIO", "pydantic", "pyarrow", "pandas", "xarray", "distributed")


@dataclass(frozen=True)
class StudyRun:
    """What a run did. folder: of the results. taken, kept: points taken here, and points that were done. failed: those."""

    folder: Path
    taken: int
    kept: int
    failed: tuple[Outcome, ...]

    def result(self) -> StudyResult:
        """Read the results."""
        return load(self.folder)


def load_study(path: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Study:
    """Return the checked study of a file, or of a name in configs/studies.

    overrides: `dotted.path=value` texts, set in the shot of every point, as --set of `photosite simulate` takes them.
    Raises PhotositeError with file and line.
    """
    return load_study_file(Path(path), QUANTITIES, overrides)


def run_study(
    study: Study | str | os.PathLike[str],
    folder: str | os.PathLike[str],
    *,
    device: str | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    redo: bool = False,
    report: Callable[[Outcome], None] = lambda outcome: None,
    progress: Progress = silent,
) -> StudyRun:
    """Take the points of a study that are not done, and write its table. Killed at any time, the next run goes on.

    study: path of a study file, a name in configs/studies, or what `load_study` gives. folder: for the results; made when it is
        missing.
    workers: processes of this machine. scheduler: address of a running dask.distributed cluster instead, all of whose machines
        see the folder under its path. Files and table are the same for any number, the column of times excepted.
    redo: take also points that are done. report: called with each point as soon as it is taken or found done.
    progress: called while points that are done are looked for, then with the name of each point and the share done.
    A point that cannot be taken is told by `report`, and the others go on.
    Raises PhotositeError for a study or folder that cannot be used, and where results cannot be written.
    """
    studied = study if isinstance(study, Study) else load_study(study)
    place = Path(folder).absolute()
    _claim_folder(studied, place)
    task = StudyTask(studied, place, device, redo=redo)
    started, began = datetime.now(UTC), time.monotonic()
    checked, failed = dict[int, Record](), list[Outcome]()
    next_table = began + TABLE_EVERY_S
    try:
        for outcome in _find_done(task, progress):
            checked[outcome.index] = outcome.record
            report(outcome)
        kept, steps = len(checked), Steps(progress, len(studied) - len(checked))
        for outcome in _take(task, workers, scheduler, checked.keys()):
            checked[outcome.index] = outcome.record
            if outcome.record.error is not None:
                failed.append(outcome)
            report(outcome)
            steps.add(outcome.name)
            if (now := time.monotonic()) > next_table:
                write_table(make_table(studied, place, checked), place)
                next_table = time.monotonic() + max(TABLE_EVERY_S, TABLE_EVERY * (time.monotonic() - now))
    finally:
        table = make_table(studied, place, checked)
        write_table(table, place)
        states = Counter(str(row["state"]) for row in table.rows)
        _write_provenance(studied, place, states, started, time.monotonic() - began)
    return StudyRun(place, len(checked) - kept, kept, tuple(failed))


def _find_done(task: StudyTask, progress: Progress) -> Iterator[Outcome]:
    """Yield the outcomes of the points that are done already."""
    known = [point.index for point in task.study if files_of_point(task.folder, point.name).record.exists()]
    steps = Steps(progress, len(known))
    for index in known:
        found = find_done(task, index)
        if found is not None:
            yield found
        steps.add("looking for points that are done")


def _take(task: StudyTask, workers: int, scheduler: str | None, done: Container[int]) -> Iterator[Outcome]:
    """Yield the outcome of every point that is not done, as it is known."""
    groups = [[index for index in group if index not in done] for group in task.study.by_light()]
    count = sum(map(len, groups))
    if count == 0:
        return
    if workers == 1 and scheduler is None:
        for group in groups:
            for index in group:
                yield take_point(task, index)
        return
    with cluster(workers, scheduler) as client:
        processes = max(1, len(client.scheduler_info()["workers"]))
        most = max(1, min(MOST_IN_CHUNK, count // (CHUNKS_PER_WORKER * processes)))
        chunks = [tuple(group[first : first + most]) for group in groups for first in range(0, len(group), most)]
        lost: list[tuple[int, ...]] = []
        for chunk, made in map_on_cluster(client, partial(take_points, task), chunks):
            if isinstance(made, PhotositeError):
                lost.append(chunk)
                continue
            yield from made
        # Each point alone, so that the one whose workers die does not take others with it.
        for (index,), made in map_on_cluster(client, partial(take_points, task), [(index,) for one in lost for index in one]):
            yield from [_fail(task, index, made)] if isinstance(made, PhotositeError) else made


def _fail(task: StudyTask, index: int, error: PhotositeError) -> Outcome:
    """Write the record of a point whose workers failed. Raises PhotositeError where that is impossible, too."""
    point, record = task.study[index], Record("", str(error))
    write_record(files_of_point(task.folder, point.name).record, record)
    return Outcome(index, point.name, point.command, "taken", record)


def _claim_folder(study: Study, folder: Path) -> None:
    """Write what the study is into its folder. Raises PhotositeError for a folder that holds another study."""
    path = folder / STUDY
    if path.is_file():
        there = read_document(path).data.get("study")
        if there != study.name:
            raise PhotositeError(f"holds the study {there}; choose another folder for {study.name}", file=folder)
    for inner in ("", "points", "curves", "times"):
        remove_abandoned(folder / inner)
    with atomic_write(path) as temporary:
        temporary.write_text(dump_yaml(study.describe()), encoding="utf-8")


def _write_provenance(study: Study, folder: Path, states: Counter[str], started: datetime, wall_s: float) -> None:
    """Write provenance.json. Raises PhotositeError."""
    times = (read_time(files_of_point(folder, point.name).time) for point in study)
    labels = sorted({one.device for one in times if one is not None and one.device})
    platforms = {one.label: one.platform for one in _devices()}
    told = {
        "photosite": __version__,
        "python": platform.python_version(),
        "system": platform.platform(),
        "libraries": {name: _version(name) for name in LIBRARIES},
        "devices": [{"name": label, "platform": platforms.get(label, "")} for label in labels],
        "command": shlex.join([Path(sys.argv[0]).name, *sys.argv[1:]]),
        "started": started.isoformat(timespec="seconds"),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "wall_seconds": round(wall_s, 3),
        "points": dict(sorted(states.items())),
    }
    with atomic_write(folder / PROVENANCE) as path:
        path.write_text(json_text("provenance", told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def _devices() -> Iterable:
    try:
        return devices()
    except PhotositeError:
        return []


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
