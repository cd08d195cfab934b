"""`photosite dataset`: make, estimate or verify a data set, with progress."""

import shutil
from pathlib import Path

import typer
from rich.markup import escape
from rich.table import Table

from data_gen.recipe.dataset_config import DataSet, load_data_set
from data_gen.report.estimate import estimate
from data_gen.run import run
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.storage.manifest import verify
from simulator.command_line.amounts import format_bytes, format_count, format_duration
from simulator.command_line.screen import console, show_progress, tell

SHOWN_PROBLEMS = 20


def make(
    path: Path,
    settings: list[str],
    out: Path,
    device: str | None,
    workers: int,
    scheduler: str | None,
    decoded: DecodedPictures,
) -> None:
    """Make a data set; the manifest's path goes to stdout, problems of pictures to stderr."""
    config = load_data_set(path, settings)
    _show_warnings(config)
    with show_progress("samples") as progress:
        outcome = run(config, out, device=device, workers=workers, scheduler=scheduler, progress=progress, decoded=decoded)
    _show_problems(outcome.problems, f"; {outcome.manifest.name} lists all")
    tell(f"{format_count(outcome.made, 'shard')} made, {outcome.kept} already there")
    print(outcome.manifest)


def verify_folder(out: Path) -> None:
    """Compare a data set with its manifest. Raises typer.Exit(1) when something differs."""
    with show_progress("shards") as progress:
        found = verify(out, progress)
    for line in found:
        print(line)
    if found:
        raise typer.Exit(1)
    print(f"{out}: every byte is that of the manifest")


def show_plan(path: Path, settings: list[str], out: Path, device: str | None, workers: int, decoded: DecodedPictures) -> None:
    """Print what a run would make, and what it would take."""
    config = load_data_set(path, settings)
    found = estimate(config, device, decoded)
    free = shutil.disk_usage(next(folder for folder in (out.absolute(), *out.absolute().parents) if folder.is_dir())).free
    needed, seconds = config.count * found.bytes_per_sample, found.seconds / workers
    milliseconds, processor = (f"{1e3 * value:.3g}" for value in (found.seconds_per_sample, found.cpu_seconds_per_sample))
    shape, stored = (config.frames, *config.crop_px), config.writer
    rows = {
        "samples": f"{config.count} of {' x '.join(map(str, shape))}, mode {config.mode}",
        "shards": f"{found.shards} of {stored.samples_per_shard} samples, {stored.format}, {stored.channels}",
        "pictures": ", ".join(f"{name}: {count}" for name, count in found.pictures.items()) or "none",
        "disk": f"{format_bytes(needed)} of {format_bytes(free)} free, {format_bytes(found.bytes_per_sample)} per sample",
        "time": f"{format_duration(seconds)} on {format_count(workers, 'worker')}: {milliseconds} ms per sample, "
        f"{processor} ms of processor time",
        "exposure ratio": f"{found.ratios[0]:g} to {found.ratios[1]:g}",
    }
    if found.decodings:
        each, times = format_duration(found.seconds_per_decoding), format_duration(found.decodings * found.seconds_per_decoding)
        rows["decoding"] = f"{found.decodings:.0f} photographs of {each}, together {times}, of the time above"
        cache = f"{format_bytes(found.decoded_bytes)} of decoded photographs, {format_bytes(decoded.limit_bytes)} are kept"
        rows["cache"] = f"{cache} in {decoded.place}"
    rows |= {f"noise: {name}": f"ISO {isos}" if isos[0].isdigit() else isos for name, isos in config.noise.table()}
    table = Table(show_header=False, box=None, pad_edge=False)
    for name, value in rows.items():
        table.add_row(name, escape(value))
    console().print(table)
    _show_warnings(config)
    made = f" for the {format_count(found.made, 'sample')} made for this estimate"
    _show_problems(found.problems, f"{made}; those of the data set are counted when it is made")
    if needed > free:
        tell(f"warning: {out}: the disk has too little space; choose another --out or a smaller count")


def _show_warnings(config: DataSet) -> None:
    """Print what is to be known of the cameras' noise."""
    for line in config.noise.warnings():
        tell(f"warning: {line}")


def _show_problems(problems: dict[str, int], rest: str) -> None:
    """Print the first problems of pictures, and how many there are. rest: of the line that says this."""
    for message, count in list(problems.items())[:SHOWN_PROBLEMS]:
        tell(f"skipped: {message} (drawn for {format_count(count, 'sample')})")
    if problems:
        tell(f"{format_count(len(problems), 'problem')}, drawn {format_count(sum(problems.values()), 'time')}{rest}")
