"""Run the points of a sweep, skip those whose files are up to date, and write the manifest."""

import csv
import json
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from simulator import __version__
from simulator.atomic_files import atomic_write, remove_abandoned
from simulator.config import Sweep, SweepPoint, dump_yaml
from simulator.errors import PhotositeError, reading
from simulator.pipeline.input_files import fingerprints
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.shot import Shot
from simulator.progress import Progress, Steps, silent

FAILURES_IN_A_ROW = 3  # a single bad picture does not stop a sweep; a full disk, which fails every point, does
SKIPPED = "skipped: already there"


@dataclass(frozen=True)
class Row:
    """One line of manifest.csv.

    seconds: time that the point took [s]. error: why it failed; the status holds its message.
    """

    index: int
    name: str
    values: dict[str, object]
    files: dict[str, str]
    seconds: float
    status: str
    error: PhotositeError | None = None


def take(
    shot: Shot, directory: Path, device: str | None = None, cache: LightCache | None = None, *, truth: bool = True
) -> None:
    """Simulate a shot and save its files. cache: light of earlier shots. truth: False leaves the truth twin out."""
    from simulator.pipeline.simulate import simulate_on_disk
    from simulator.raw.save import save

    with simulate_on_disk(shot, directory, device=device, cache=cache) as raw:
        save(raw, directory, truth=truth)


def run_sweep(
    sweep: Sweep,
    directory: Path,
    *,
    take: Callable[[Shot, Path], object] = take,
    map: Callable[..., Iterable[Row]] = map,
    redo: bool = False,
    truth: bool | None = None,
    report: Callable[[Row], None] = lambda row: None,
    progress: Progress = silent,
) -> list[Row]:
    """Run all points into `directory`, those that share their light one after the other; returns the rows of manifest.csv.

    The rows have the order of the sweep.
    take: simulates one shot and saves it, as `simulator.save` does; give it a cache, such as partial(take, cache=LightCache()),
        of which each worker process gets one of its own.
    map: like the built-in; an executor's map spreads points over processes.
    redo: run also points whose files are up to date. report: called with each row as it is done.
    truth: True: a point is done only when its truth twin stands; False: `take` leaves it out; None: nobody looks.
    progress: called with the name of each point and the share done.
    What a killed run was writing in `directory` is removed.
    A point that fails is a row whose status says why; three in a row end the run.
    Raises PhotositeError when that happens. The manifest is written whatever ends the run.
    """
    remove_abandoned(Path(directory))
    rows, failures, steps = [], 0, Steps(progress, len(sweep))
    try:
        for row in map(partial(run_point, directory=Path(directory), take=take, redo=redo, truth=truth), sweep.by_light()):
            rows.append(row)
            report(row)
            steps.add(row.name)
            failures = 0 if row.error is None else failures + 1
            if row.error is not None and failures == FAILURES_IN_A_ROW:
                rule = f"{row.error.rule} ({failures} failures in a row: stopped)"
                raise row.error.replace(rule=rule).inside(row.name)
    finally:
        rows.sort(key=lambda row: row.index)
        write_manifest(rows, sweep.keys, Path(directory) / "manifest.csv")
    return rows


def run_point(
    point: SweepPoint, directory: Path, take: Callable[[Shot, Path], object], redo: bool = False, truth: bool | None = None
) -> Row:
    """Run one point unless its files exist and this version made them from the same configuration and input files.

    truth: as of `run_sweep`.
    """
    start, status, failure = time.perf_counter(), "", None
    files = {kind: f"{point.name}{end}" for kind, end in (("dng", ".dng"), ("truth", ".truth.exr"), ("sidecar", ".json"))}
    try:
        shot = point.shot()
        settings, sidecar = directory / f"{point.name}.yaml", directory / files["sidecar"]
        text = dump_yaml(shot.resolved)
        wanted = ("dng", "truth") if truth is True else ("dng",)
        has_all = all((directory / files[kind]).is_file() for kind in wanted)
        if not redo and has_all and _is_up_to_date(text, settings, sidecar, shot):
            status = SKIPPED
        else:
            # The sidecar is written last and vouches for the rest, so an old one has to go first.
            sidecar.unlink(missing_ok=True)
            with atomic_write(settings) as path:
                path.write_text(text, encoding="utf-8")
            take(shot, directory)
            status = "done"
        if truth is False:
            del files["truth"]
    except PhotositeError as error:
        failure = point.locate_error(error)
    except (OSError, MemoryError) as error:
        failure = PhotositeError(f"{error}")
    if failure is not None:
        status, files = f"failed: {failure}", {}
    return Row(point.index, point.name, point.values, files, time.perf_counter() - start, status, failure)


def _is_up_to_date(text: str, settings: Path, sidecar: Path, shot: Shot) -> bool:
    """Return whether this version made a complete set of files with these settings from this content of all input files."""
    try:
        if settings.read_text(encoding="utf-8") != text:
            return False
        with reading(sidecar, "take the point again"):
            made = json.loads(sidecar.read_text(encoding="utf-8"))
        is_ours = made["versions"]["photosite"] == __version__
        return is_ours and made["inputs"] == fingerprints(shot.scene, shot.lens, shot.motion)
    except (
        OSError,
        UnicodeDecodeError,
        PhotositeError,
        KeyError,
        TypeError,
    ):  # a file is missing, cut short, or of another program
        return False


def write_manifest(rows: list[Row], keys: list[str], path: Path) -> None:
    """One line per point: index, name, varied values, files, seconds, status. Raises PhotositeError."""
    with atomic_write(path) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["index", "name", *keys, "dng", "truth", "sidecar", "seconds", "status"])
        for row in rows:
            values = [row.values.get(key, "") for key in keys]
            outputs = [row.files.get(kind, "") for kind in ("dng", "truth", "sidecar")]
            writer.writerow([row.index, row.name, *values, *outputs, f"{row.seconds:.3f}", row.status])
