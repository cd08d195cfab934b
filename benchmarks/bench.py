"""The benchmark: run time against error beside other packages, what skips save, and how time grows.

    python benchmarks/bench.py [--size quick|standard|full] [--only defocus,motion] [--resume] [--out build/benchmarks]

Each section writes <out>/<section>.json and, where it has one, <out>/<section>.png as soon as it is measured, so that a run
that is cut off can be resumed. docs/make_benchmarks.py writes docs/benchmarks.md from these files. `make bench` is the standard
size, under 10 minutes on two cores; `make bench-full` has larger frames, more turns, and the sections that take long. Processor
times and errors of a commit are kept in .asv/results for `make bench-compare`.
"""

import argparse
import importlib
import json
import os
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from measuring.charts import draw
from measuring.record import Record, commit
from measuring.results import keep
from measuring.run import Run
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from simulator.errors import PhotositeError

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Section:
    """A section: where its function is, its share of the whole in seconds of the standard size, and whether that has it."""

    module: str
    function: str
    about_s: float
    only_full: bool = False

    @property
    def measure(self) -> Callable[[Run], Record]:
        """The function that measures it."""
        return getattr(importlib.import_module(self.module), self.function)


SECTIONS = {
    "photograph": Section("photograph", "measure_photograph", 70),
    "lenses": Section("photograph", "measure_lenses", 45),
    "defocus": Section("defocus", "measure_defocus", 45),
    "psf": Section("psf", "measure_psf", 30),
    "motion": Section("motion", "measure_motion", 80),
    "moving": Section("motion", "measure_moving", 60),
    "spectra": Section("spectra", "measure_spectra", 8),
    "sensor": Section("sensor", "measure_sensor", 35),
    "stages": Section("sensor", "measure_stages", 6),
    "poisson": Section("poisson", "measure_poisson", 7),
    "pairs": Section("pairs", "measure_pairs", 20),
    "skips": Section("skips", "measure_skips", 18),
    "scaling": Section("scaling", "measure_scaling", 45),
    "starts": Section("photograph", "measure_starts", 30),
    "raw": Section("raw", "measure_raw", 5),
    "live": Section("live", "measure_live", 60, only_full=True),
    "large": Section("photograph", "measure_large", 60, only_full=True),
    "cats_eyes": Section("cats_eyes", "measure_cats_eyes", 30, only_full=True),
}


def chosen(only: str | None, size: str) -> list[str]:
    """Names of the sections to measure. Raises PhotositeError for one that there is not."""
    if only is None:
        return [name for name, section in SECTIONS.items() if size == "full" or not section.only_full]
    names = only.split(",")
    for name in names:
        if name not in SECTIONS:
            raise PhotositeError(f"no such section; give some of {', '.join(SECTIONS)}", key="--only", value=name)
    return names


def is_measured(path: Path, size: str) -> bool:
    """Whether a section's file holds this size of this commit, so that --resume leaves it."""
    if not path.exists():
        return False
    there = json.loads(path.read_text(encoding="utf-8"))
    return there.get("size") == size and there.get("commit") == commit()


def cpu_seconds() -> float:
    """Processor time of this process and of those that it waited for."""
    used = os.times()
    return used.user + used.system + used.children_user + used.children_system


def measure_sections(names: list[str], size: str, out: Path, console: Console) -> list[dict]:
    """Measure sections one after the other, each written when it is done; returns their records as they were written.

    One that fails is told with its traceback, and the others go on.
    """
    columns = TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn()
    records = []
    with Progress(*columns, console=console, transient=True) as progress:
        whole = progress.add_task("benchmark", total=sum(SECTIONS[name].about_s for name in names))
        for name in names:
            progress.update(whole, description=name)
            started, used = time.perf_counter(), cpu_seconds()
            try:
                with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
                    record = SECTIONS[name].measure(Run(size, Path(folder), progress))  # type: ignore[arg-type]
            except Exception:  # a night's run is not lost by one section
                console.print(traceback.format_exc(), f"{name} failed", markup=False)
                continue
            draw(record, out)
            written = record.write(out, size, time.perf_counter() - started, cpu_seconds() - used)
            records.append(json.loads(written.read_text(encoding="utf-8")))
            record.show(console)
            took = f"{records[-1]['seconds']:.0f} s, of processors {records[-1]['cpu_seconds']:.0f} s"
            console.print(f"{name}: {took}, wrote {written}")
            progress.advance(whole, SECTIONS[name].about_s)
    return records


def main() -> int:
    """Measure, print and write; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", choices=("quick", "standard", "full"), default="standard", help="quick is to try the scripts")
    parser.add_argument("--only", metavar="NAMES", help=f"sections, separated by commas: {', '.join(SECTIONS)}")
    parser.add_argument("--resume", action="store_true", help="leave sections that were measured at this commit and size")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "benchmarks", help="folder for JSON and charts")
    parser.add_argument("--results", type=Path, default=ROOT / ".asv" / "results", help="folder of the results by commit")
    options = parser.parse_args()
    console = Console(stderr=True, width=150)
    try:
        names = chosen(options.only, options.size)
    except PhotositeError as problem:
        console.print(str(problem))
        return 2
    if options.resume:
        names = [name for name in names if not is_measured(options.out / f"{name}.json", options.size)]
    records = measure_sections(names, options.size, options.out, console)
    kept = keep(records, options.results) if records else None
    if kept:
        console.print(f"kept under the commit: {kept}")
    elif records:
        console.print("not kept under a commit: the checkout has changes that are not committed")
    return 0 if len(records) == len(names) else 1


if __name__ == "__main__":
    sys.exit(main())
