"""Live pairs feeding a small training step on the CPU: how long the step waits for its batch, with 0 and 1 workers.

The network is three convolutions of 16 channels, 4 x 256 x 256 in and out, batches of 8: about the least that trains a
denoiser, so that the loader's share is near its greatest. Sources: the clean frames of a data set with live noise, drawings
with live noise, and stored pairs for comparison. The network alone gets one batch again and again.

    python benchmarks/live.py [--rounds 4] [--steps 5] [--out build/benchmarks]
"""

import argparse
import json
import os
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.progress import Progress

from data_gen.recipe.dataset_config import DataSet
from data_gen.run import run
from simulator.atomic_files import atomic_write
from simulator.config import load_file

if TYPE_CHECKING:
    from data_gen.torch import Pairs

BATCH, PICTURES, WARM_UP, CHANNELS = 8, 48, 4, 16
DRAWN = """\
count: {count}
crop: [{side}, {side}]
pictures: {{{pictures}}}
noise: {{cameras: {{sony_a7s2: {{iso: {{measured: [800, 25600]}}}}}}}}
exposure_ratio: {{uniform: [100, 300]}}
"""
DRAWINGS = "drawings: {procedural: [dead_leaves, gradients, text], width: 640, height: 640}"


@dataclass
class Waits:
    """Seconds of each step, whole and waiting for its batch."""

    whole_s: list[float]
    waiting_s: list[float]

    @property
    def share(self) -> float:
        """Of the waiting in the time of all steps."""
        return sum(self.waiting_s) / sum(self.whole_s)

    @property
    def step_s(self) -> float:
        """Median of the whole steps."""
        return statistics.median(self.whole_s)


def in_turns(kinds: dict, rounds: int, steps: int, tell: Callable[[], None]) -> dict[object, Waits]:
    """Waits of each kind of batches; they take turns, so that a load on the machine meets all of them."""
    waits, train = {kind: Waits([], []) for kind in kinds}, training()
    for _ in range(rounds):
        for kind, batches in kinds.items():
            take_steps(waits[kind], batches, train, steps, tell)
    return waits


def take_steps(waits: Waits, batches: Iterator, train: Callable[[object], None], steps: int, tell: Callable[[], None]) -> None:
    """Train, and time, so many steps behind those that start workers and empty the queues they filled meanwhile."""
    for step in range(WARM_UP + steps):
        start = time.perf_counter()
        batch = next(batches)
        got = time.perf_counter()
        train(batch)
        if step >= WARM_UP:
            waits.waiting_s.append(got - start)
            waits.whole_s.append(time.perf_counter() - start)
        tell()


def training() -> Callable[[dict], None]:
    """One training step of a new network."""
    from torch import nn, optim

    layers = [nn.Conv2d(4, CHANNELS, 3, padding=1), nn.ReLU(), nn.Conv2d(CHANNELS, CHANNELS, 3, padding=1), nn.ReLU()]
    network = nn.Sequential(*layers, nn.Conv2d(CHANNELS, 4, 3, padding=1))
    optimizer = optim.Adam(network.parameters(), lr=1e-4)

    def train(batch: dict) -> None:
        optimizer.zero_grad()
        nn.functional.l1_loss(network(batch["noisy"]), batch["clean"]).backward()
        optimizer.step()

    return train


def endless(pairs: "Pairs", workers: int) -> Iterator[dict[str, Any]]:
    """Batches of one epoch after the other."""
    from data_gen.torch import loader

    batches = loader(pairs, BATCH, num_workers=workers, drop_last=True)
    for epoch in count():
        pairs.set_epoch(epoch)
        yield from batches


def sources(folder: Path) -> dict[str, object]:
    """Pairs by the name of where they come from; clean patches and stored pairs are made in a folder."""
    from data_gen.torch import LivePairs, StoredPairs

    def config(name: str, **values: Any) -> DataSet:
        path = folder / name
        path.write_text(DRAWN.format(**values), encoding="utf-8")
        return load_file(DataSet, path)

    drawn = {"count": PICTURES, "pictures": DRAWINGS}
    # Two pixels larger than a crop, because mosaics are flipped.
    for name, side in (("clean", 514), ("stored", 512)):
        run(config(f"{name}.yaml", side=side, **drawn), folder / name)
    patches = f"clean: {{data_set: {json.dumps(str(folder / 'clean'))}}}"
    return {
        "clean frames of a data set, live noise": LivePairs(config("live.yaml", count=PICTURES, side=512, pictures=patches)),
        "drawings, live noise": LivePairs(config("drawings.yaml", side=512, **drawn)),
        "stored pairs": StoredPairs(folder / "stored"),
    }


def measure(rounds: int, steps: int, progress: Progress) -> dict[str, object]:
    """Rows by source and number of workers; a note instead when PyTorch is missing."""
    record = {"machine": {"cores": os.cpu_count(), "load": os.getloadavg()}, "batch": BATCH, "rows": [], "notes": []}
    try:
        from torch import __version__ as version
    except ImportError:
        return record | {"notes": ["PyTorch is missing: pip install 'photosite[torch]'"]}
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        found = sources(Path(folder))
        batch = next(endless(found["stored pairs"], 0))
        kinds = {("the network alone", 0): iter(lambda: batch, None)}
        kinds |= {(name, workers): endless(pairs, workers) for name, pairs in found.items() for workers in (0, 1)}
        task = progress.add_task("steps", total=rounds * len(kinds) * (WARM_UP + steps))
        waits = in_turns(kinds, rounds, steps, lambda: progress.advance(task))
    alone = waits["the network alone", 0].step_s
    for (name, workers), wait in waits.items():
        row = {"name": name, "workers": workers, "step_s": wait.step_s, "share": wait.share, "over_alone": wait.step_s / alone}
        record["rows"].append(row)
    record["machine"]["load"] = os.getloadavg()
    return record | {"torch": version}


def main() -> None:
    """Measure, print, and write live.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=4, help="turns of each kind")
    parser.add_argument("--steps", type=int, default=5, help="steps of a turn")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for live.json")
    options = parser.parse_args()
    with Progress(console=Console(stderr=True)) as progress:
        record = measure(options.rounds, options.steps, progress)
    for row in record["rows"]:
        times = f"step {1e3 * row['step_s']:.0f} ms, waiting {100 * row['share']:.1f} %, {row['over_alone']:.2f} x alone"
        print(f"{row['name']:40s} {row['workers']} workers: {times}")
    for note in record["notes"]:
        print(f"left out: {note}")
    options.out.mkdir(parents=True, exist_ok=True)
    with atomic_write(options.out / "live.json") as path:
        path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {options.out / 'live.json'}")


if __name__ == "__main__":
    main()
