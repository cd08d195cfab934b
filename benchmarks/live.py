"""Live pairs: how long a small training step waits for them, and how many come a second from a folder of photographs.

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
PHOTOGRAPHS = "photos: {{photographs: {folder}}}"
PHOTO_SIZE, SIDE, PAIRS, EACH = (4000, 6000), 256, 960, 8  # height, width; of a mosaic; pairs of an epoch; crops of a picture
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


def write_photographs(folder: Path, count: int) -> None:
    """JPEGs of 24 megapixels: the motorcycle scene of scikit-image, enlarged, shifted, with noise."""
    import numpy as np
    import OpenImageIO as oiio
    from scipy import ndimage
    from skimage.data import stereo_motorcycle

    height, width = PHOTO_SIZE
    left = stereo_motorcycle()[0].astype(np.float32)
    rows, columns = np.linspace(0, left.shape[0] - 1, height), np.linspace(0, left.shape[1] - 1, width)
    places = np.meshgrid(rows, columns, indexing="ij")
    large = np.stack([ndimage.map_coordinates(left[..., channel], places, order=1) for channel in range(3)], axis=-1)
    noise = np.random.default_rng(1).normal(0, 3, (height, 500, 3)).astype(np.float32)
    for number in range(count):
        picture = np.roll(large, number * width // count, axis=1)
        picture += np.tile(np.roll(noise, number, axis=0), (1, width // 500, 1))
        spec = oiio.ImageSpec(width, height, 3, oiio.UINT8)
        spec.attribute("Compression", "jpeg:92")
        path = str(folder / f"{number:03d}.jpg")
        output = oiio.ImageOutput.create(path)
        output.open(path, spec)
        output.write_image(np.clip(np.rint(picture), 0, 255).astype(np.uint8))
        output.close()


def pairs_per_second(batches: Iterator, pairs: int) -> float:
    """Pairs that an epoch gives a second, from asking for the first batch on."""
    start, found = time.perf_counter(), 0
    for batch in batches:
        found += len(batch["noisy"])
    if found != pairs:
        raise RuntimeError(f"{found} pairs instead of {pairs}")
    return pairs / (time.perf_counter() - start)


def measure_photographs(folder: Path, count: int, epochs: int, tell: Callable[[], None]) -> list[dict[str, object]]:
    """Rows by contestant and number of workers: pairs per second in the first epoch and in later ones, which take turns."""
    from peers.numpy_pairs import NumpyPairs

    from data_gen.sources.decoded_pictures import DecodedPictures
    from data_gen.torch import DataLoader, LivePairs, loader

    pictures = folder / "photographs"
    pictures.mkdir()
    write_photographs(pictures, count)
    text = DRAWN.format(count=PAIRS, side=SIDE, pictures=PHOTOGRAPHS.format(folder=json.dumps(str(pictures))))
    path = folder / "photographs.yaml"
    path.write_text(f"{text}crops_per_picture: {EACH}\n", encoding="utf-8")
    rows = []
    for workers in (1, 2):
        ours = LivePairs(path, decoded=DecodedPictures(folder=folder / f"decoded-{workers}"))
        options = {"multiprocessing_context": "forkserver", "persistent_workers": True, "shuffle": True}
        contestants = {
            "Photosite": (ours, loader(ours, BATCH, num_workers=workers)),
            "NumPy loop": (None, DataLoader(NumpyPairs(pictures, PAIRS, SIDE), BATCH, num_workers=workers, **options)),
        }
        found: dict[str, list[float]] = {name: [] for name in contestants}
        for epoch in range(1 + epochs):
            for name, (pairs, batches) in contestants.items():
                if pairs is not None:
                    pairs.set_epoch(epoch)
                found[name].append(pairs_per_second(batches, PAIRS))
                tell()
        loop = statistics.median(found["NumPy loop"][1:])
        for name, (first, *later) in found.items():
            median = statistics.median(later)
            row = {
                "name": name,
                "workers": workers,
                "first": first,
                "later": median,
                "best": max(later),
                "over_loop": median / loop,
            }
            rows.append(row)
    return rows


def measure(rounds: int, steps: int, photographs: int, epochs: int, progress: Progress) -> dict[str, object]:
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
        record["photographs"] = []
        if photographs:
            task = progress.add_task("photographs", total=2 * 2 * (1 + epochs))
            record["photographs"] = measure_photographs(Path(folder), photographs, epochs, lambda: progress.advance(task))
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
    parser.add_argument("--photographs", type=int, default=12, help="JPEGs of 24 megapixels; 0 leaves them out")
    parser.add_argument("--epochs", type=int, default=4, help="of each contestant, after the first")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for live.json")
    options = parser.parse_args()
    with Progress(console=Console(stderr=True)) as progress:
        record = measure(options.rounds, options.steps, options.photographs, options.epochs, progress)
    for row in record["rows"]:
        times = f"step {1e3 * row['step_s']:.0f} ms, waiting {100 * row['share']:.1f} %, {row['over_alone']:.2f} x alone"
        print(f"{row['name']:40s} {row['workers']} workers: {times}")
    for row in record.get("photographs", []):
        rates = f"first epoch {row['first']:.0f}, later {row['later']:.0f} pairs/s, {row['over_loop']:.2f} x the loop"
        print(f"{row['name']:40s} {row['workers']} workers, photographs: {rates}")
    for note in record["notes"]:
        print(f"left out: {note}")
    options.out.mkdir(parents=True, exist_ok=True)
    with atomic_write(options.out / "live.json") as path:
        path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {options.out / 'live.json'}")


if __name__ == "__main__":
    main()
