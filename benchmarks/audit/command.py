"""The audit of the promise: random shots against the reference path, their errors beside those that the plans state.

    python benchmarks/audit --shots 200 --seed 1 [--jobs 1] [--out build/benchmarks] [--fresh]
    python benchmarks/audit --shots 65 --seed 2 --only cost
    python benchmarks/audit --seed 1 --write 17 --out FOLDER
    python benchmarks/audit --laws

A run that was stopped goes on where it was: each shot is a line of audit_SEED.jsonl. `--only cost` takes the times alone, into
cost_SEED.jsonl. `--write` writes one shot as a shot file
with its arrays. `--laws` measures laws of small blur circles against float64, without shots. The audit stands apart from the
other benchmarks because `make benchmark` runs those without arguments.
Exit status: 0 the promise is kept, 1 it is not.
"""

import argparse
import json
import tempfile
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from audit.blur_laws import measure_laws
from audit.chart import draw_chart
from audit.costs import Cost, measure_cost, read_costs, show_costs
from audit.drawn_shots import draw_shot
from audit.limits import end_with_parent
from audit.machine import machine_factor
from audit.measured_shot import METHODS, TRUTH_S, Record, measure_shot
from audit.records import append, read_numbers, read_records
from audit.shot_truth import NoTruthError
from audit.summary import summarise, tightness, verdicts
from simulator.device import open_device


def take(seed: int, number: int, truth_s: float | None = TRUTH_S, machine: float = 1.0) -> dict:
    """Draw and measure a shot; returns its line, or that of its failure, or of the reference path's refusal.

    truth_s: processor time for the rays of its truth [s]; None: only its cost is measured. machine: of
    `machine_factor`, by which predicted times count.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
            drawn, device = draw_shot(seed, number), open_device(None)
            if truth_s is None:
                found: Cost | Record = measure_cost(drawn, Path(folder), device)
            else:
                found = measure_shot(drawn, Path(folder), device, truth_s)
            return found.as_json() | {"cost_ms": machine * found.cost_ms}
    except NoTruthError as error:
        return {"seed": seed, "number": number, "refused": str(error)}
    except Exception as error:  # noqa: BLE001  a shot that fails breaks the promise, and the others are taken
        return {"seed": seed, "number": number, "error": f"{type(error).__name__}: {error}"}


def take_all(seed: int, numbers: list[int], jobs: int, truth_s: float | None, path: Path, console: Console) -> None:
    """Take shots, each a line of a file, in as many processes. truth_s: as of `take`."""
    machine = machine_factor(open_device(None)) if numbers else 1.0
    console.print(f"the machine takes {machine:.2f} x the predicted times of calibration shots, and counts so")
    with Progress(console=console) as progress:
        task = progress.add_task("shots", total=len(numbers))
        if jobs == 1:
            for number in numbers:
                append(path, take(seed, number, truth_s, machine))
                progress.advance(task)
            return
        with ProcessPoolExecutor(jobs, get_context("spawn"), initializer=end_with_parent) as pool:
            waiting: list[Future[dict]] = [pool.submit(take, seed, number, truth_s, machine) for number in numbers]
            for done in as_completed(waiting):
                append(path, done.result())
                progress.advance(task)


def show(records: list[Record], failed: dict[int, str], refused: dict[int, str], console: Console) -> bool:
    """Print tables by method and of broken promises, and verdicts; returns whether all are reached."""
    table = Table(title="errors by method, in sigma of each photosite's noise", title_justify="left")
    for heading in ("method", "shots", "kept", "median error", "median error / prediction"):
        table.add_column(heading, justify="left" if heading == "method" else "right")
    for method in METHODS:
        own = [one for one in records if one.method == method and one.is_judged]
        if own:
            kept, errors = sum(one.excess <= 1.0 for one in own), sorted(one.p99_9 for one in own)
            table.add_row(method, str(len(own)), str(kept), f"{errors[len(own) // 2]:.2g}", f"{tightness(own):.2g}")
    console.print(table)
    found = summarise(records, len(refused))
    for one in found.broken:
        console.print(
            f"{one.seed}:{one.number} {one.method}, tolerance {one.tolerance:g}, predicted {one.predicted:.2g}: "
            f"{one.p99_9:.2g} sigma; {', '.join(one.kinds)}"
        )
    for one in found.random_broken:
        console.print(
            f"{one.seed}:{one.number} random plan: {one.random_p99_9:.2g} sigma, predicted {one.random_predicted:.2g}"
        )
    for one in found.looser:
        console.print(f"{one.seed}:{one.number} {one.p99_9:.2g} sigma, at a tighter tolerance {one.tighter_p99_9:.2g}")
    for one in found.unjudged:
        console.print(
            f"{one.seed}:{one.number} {one.method}: not judged, standard error of the truth {one.truth_sigma:.2g} sigma, "
            f"allowed {one.allowed:.2g}; {', '.join(one.kinds)}"
        )
    for number, message in refused.items():
        console.print(f"not taken {number}: {message}")
    for number, message in failed.items():
        console.print(f"failed {number}: {message}")
    judged = verdicts(found)
    for verdict in judged:
        word = "reached" if verdict["reached"] else "missed"
        console.print(f"{verdict['what']}: {verdict['figure']} (asked: {verdict['asked']}): {word}")
    return all(verdict["reached"] for verdict in judged) and not failed


def main() -> int:
    """Run the audit."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--shots", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--truth-seconds", type=float, default=TRUTH_S, help="processor time for the rays of a shot's truth")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"))
    parser.add_argument("--only", choices=["cost"], help="predicted times beside measured ones, without truths")
    parser.add_argument("--fresh", action="store_true", help="forget the shots that were taken before")
    parser.add_argument("--write", type=int, metavar="N", help="write shot N as a shot file into --out and end")
    parser.add_argument("--laws", action="store_true", help="measure laws of small blur circles and end")
    options = parser.parse_args()
    console = Console()
    if options.laws:
        return 0 if measure_laws(console.print) else 1
    if options.write is not None:
        console.print(str(draw_shot(options.seed, options.write).write(options.out)))
        return 0
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / f"{options.only or 'audit'}_{options.seed}.jsonl"
    if options.fresh:
        path.unlink(missing_ok=True)
    missing = sorted(set(range(options.shots)) - read_numbers(path))
    take_all(options.seed, missing, options.jobs, None if options.only else options.truth_seconds, path, console)
    if options.only:
        return 0 if show_costs(read_costs(path), console) else 1
    records, failed, refused = read_records(path)
    console.print(f"{len(records)} shots; {len(refused)} more are not taken")
    good = show(records, failed, refused, console)
    figures = verdicts(summarise(records, len(refused)))
    (options.out / "audit.json").write_text(json.dumps({"seed": options.seed, "verdicts": figures}, indent=1) + "\n", "utf-8")
    try:
        console.print(f"chart: {draw_chart(records, options.out / 'audit.png')}")
    except ImportError:
        console.print("left out: the chart, because matplotlib is missing: pip install 'photosite[bench]'")
    return 0 if good else 1
