"""`photosite study`: take the points of a study, or tell what that would take."""

import os
import shutil
from pathlib import Path

import typer
from rich.markup import escape
from rich.table import Table

from simulator.command_line.amounts import format_bytes, format_count, format_duration
from simulator.command_line.screen import console, show_progress, tell
from simulator.config.study_command import shot_name
from simulator.config.study_file import Study
from simulator.errors import PhotositeError
from simulator.studies.study_estimate import estimate_study
from simulator.studies.study_folder import TABLE
from simulator.studies.study_point import Outcome
from simulator.studies.study_run import load_study, run_study
from simulator.studies.study_table import PARQUET_HINT, has_parquet

SHOWN_FAILURES = 5


def take_study(
    path: Path,
    settings: list[str],
    out: Path | None,
    device: str | None,
    workers: int,
    scheduler: str | None,
    redo: bool,
    parquet: bool,
) -> None:
    """Take the points of a study; the path of the table goes to stdout, failures to stderr as they happen.

    out: folder; None: named as the study, in the current one. parquet: the table is wanted as Parquet, too.
    Raises PhotositeError; typer.Exit(1) when points failed.
    """
    if parquet and not has_parquet():
        raise PhotositeError(f"needs pyarrow: {PARQUET_HINT}", key="--parquet")
    study = load_study(path, settings)
    folder = out or Path(study.name)

    def report(outcome: Outcome) -> None:
        if outcome.record.error is not None:
            tell(f"failed: {outcome.name}: {outcome.record.error}\n  repeat it with: {outcome.command}")

    with show_progress(study.name) as progress:
        done = run_study(
            study,
            folder,
            device=device,
            workers=workers,
            scheduler=scheduler,
            redo=redo,
            report=report,
            progress=progress,
        )
    if done.kept:
        tell(f"note: {done.kept} of {len(study)} points were done already; --redo takes them again")
    print(folder / TABLE)
    if done.failed:
        tell(f"error: {len(done.failed)} of {len(study)} points failed; the column error of {folder / TABLE} says why")
        raise typer.Exit(1)


def show_study(path: Path, settings: list[str], out: Path | None, device: str | None, workers: int, redo: bool) -> None:
    """Print what a run would take: points by state, time and disk. Raises PhotositeError."""
    study = load_study(path, settings)
    folder = out or Path(study.name)
    with show_progress(study.name) as progress:
        found = estimate_study(study, folder, device, redo, progress)
    free = shutil.disk_usage(next(one for one in (folder.absolute(), *folder.absolute().parents) if one.is_dir())).free
    about = "" if found.planned == len(study) else f", from the plans of {found.planned}"
    processes = min(workers, os.cpu_count() or 1)
    rows = {
        "study": f"{study.name}, of {shot_name(study.shot_path)}",
        "points": f"{len(study)} = {_describe_axes(study)}",
        "states": ", ".join(f"{count} {state}" for state, count in sorted(found.states.items())) + about,
        "to take": f"{format_count(found.to_take, 'point')}, {format_count(found.lights, 'image')} of the light",
        "time": f"{format_duration(found.seconds / processes)} on {format_count(workers, 'worker')}, kernels built{about}",
        "disk": f"{format_bytes(found.bytes)} of {format_bytes(free)} free in {folder}",
        "measured": ", ".join(f"{label}: {next(iter(one))}" for label, one in study.measured.items()) or "nothing",
        "kept": ", ".join(study.keep) or "no frames",
    }
    table = Table(show_header=False, box=None, pad_edge=False)
    for name, value in rows.items():
        table.add_row(name, escape(value))
    console().print(table)
    for name, error in list(found.failures.items())[:SHOWN_FAILURES]:
        tell(f"will fail: {name}: {error}")
    if len(found.failures) > SHOWN_FAILURES:
        tell(f"{len(found.failures)} points will fail")
    if found.bytes > free:
        tell(f"warning: {folder}: the disk has too little space; choose another --out, or keep less")


def _describe_axes(study: Study) -> str:
    """Return the axes with their lengths, such as `9 exposure.iso x 4 (lens.f_number, exposure.time)`."""
    named = [(length, ", ".join(keys)) for keys, length in study.dimensions]
    return " x ".join(f"{length} ({text})" if "," in text else f"{length} {text}" for length, text in named)
