"""`photosite simulate`: one shot or a sweep, with progress."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

import typer

from simulator.atomic_files import atomic_write
from simulator.command_line.screen import show_progress, tell
from simulator.config import Sweep, frame_warnings, load_shot, load_sweep, locate_errors, shot_warnings
from simulator.device import CompilerWarning
from simulator.errors import PhotositeError
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate_on_disk
from simulator.raw.save import save
from simulator.studies.sweep_runner import SKIPPED, Row, run_sweep, take


def simulate_file(path: Path, settings: list[str], out: Path, device: str | None, redo: bool, truth: bool) -> None:
    """Take what a shot file describes; paths of the files go to stdout, everything else to stderr.

    truth: whether the truth twin is written.
    Raises PhotositeError; typer.Exit(1) when points of a sweep failed.
    """
    sweep = load_sweep(path, settings)
    shot = load_shot(path, settings) if sweep is None else sweep[0].shot()
    for warning in shot_warnings(shot):
        tell(f"warning: {warning}")
    with _check_folder(out):
        if sweep is None:
            with locate_errors(path, settings):
                return simulate_shot(shot, out, device, truth)
        failed = simulate_sweep(sweep, out, device, redo, truth)
    if failed:
        tell(f"error: {failed} of {len(sweep)} points failed; the column status of {out / 'manifest.csv'} says why")
        raise typer.Exit(1)


def simulate_shot(shot: Shot, out: Path, device: str | None, truth: bool) -> None:
    """Take and save one shot. truth: whether with its truth twin."""
    with show_progress(shot.name, prefix=f"{shot.name}: ", is_long=False) as progress:
        with (
            warnings.catch_warnings(record=True, action="always", category=UserWarning) as told,
            simulate_on_disk(shot, out, device=device, progress=progress) as raw,
        ):
            files, seen = save(raw, out, truth=truth), frame_warnings(raw)
    resolved: dict[str, Any] = raw.resolved  # plain data, as the sidecar file holds it
    for note in resolved["notes"]:
        tell(f"note: {note}")
    of_numbers = [str(one.message) for one in told if not issubclass(one.category, CompilerWarning)]
    for warning in [*resolved["warnings"], *of_numbers, *seen]:
        tell(f"warning: {warning}")
    for file in files.there():
        print(file)


def simulate_sweep(sweep: Sweep, out: Path, device: str | None, redo: bool, truth: bool) -> int:
    """Take and save all points; returns the number that failed. truth: whether with their truth twins."""

    def report(row: Row) -> None:
        if row.error is not None:
            tell(f"{row.name}: {row.status}")

    with show_progress("sweep") as progress:
        taking = partial(take, device=device, cache=LightCache(), truth=truth)
        rows = run_sweep(sweep, out, take=taking, redo=redo, truth=truth, report=report, progress=progress)
    if skipped := sum(row.status == SKIPPED for row in rows):
        tell(f"note: {skipped} of {len(rows)} points were there already; --redo takes them again")
    print(out / "manifest.csv")
    return sum(row.error is not None for row in rows)


@contextmanager
def _check_folder(out: Path) -> Iterator[None]:
    """Check before the work that the folder can be written to; remove it afterwards if it is new and empty."""
    is_new, probe = not out.exists(), out / ".photosite"
    try:
        with atomic_write(probe) as path:
            path.touch()
        probe.unlink()
    except PhotositeError as error:
        raise error.replace(file=None, key="--out", value=out) from None
    try:
        yield
    finally:
        if is_new:
            with suppress(OSError):  # it holds files: the usual end
                out.rmdir()
