"""Live pairs: how long a small training step waits for them, and how many come a second from a folder of photographs.

The network is three convolutions of 16 channels, 4 x 256 x 256 in and out, batches of 8: about the least that trains a
denoiser, so that the loader's share is near its greatest. Sources: the clean frames of a data set with live noise, drawings
with live noise, and stored pairs for comparison. The network alone gets one batch again and again.
"""

import json
import statistics
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from measuring.record import Record
from measuring.run import Run

from data_gen.recipe.dataset_config import DataSet
from data_gen.run import run as write_data_set
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
        write_data_set(config(f"{name}.yaml", side=side, **drawn), folder / name)
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


TEXT = """\
Batches of {batch} pairs of 4 x 256 x 256 from `data_gen.torch` feed three convolutions of 16 channels, on the CPU: about
the least that trains a denoiser, so that the loader's share is near its greatest. A step waits for its batch, then trains.
PyTorch and PoCL use all cores, so what a worker saves in waiting it takes from the network: "over" says what a step costs in
all. Pictures of the data set are read and cut beforehand.

Photographs: 4 x 128 x 128 from a folder of JPEGs of 24 megapixels, in shuffled epochs without a network; "over" is the rate of
later epochs over that of the NumPy loop (`benchmarks/peers/numpy_pairs.py`), which decodes each picture once in each worker,
cuts, and draws Poisson and normal numbers. The first epoch starts the workers and decodes.
"""
COLUMNS = {
    "case": ["", ""],
    "name": ["batches", ""],
    "workers": ["workers", "d"],
    "median_s": ["step [s]", ".3f"],
    "share": ["waiting", ".1%"],
    "first": ["first epoch [1/s]", ".0f"],
    "later": ["later epochs [1/s]", ".0f"],
    "over": ["over", ".2f"],
}


def measure_live(run: Run) -> Record:
    """Rows by source and number of workers; a note instead when PyTorch is missing."""
    record = Record("live", "Live pairs and a training step", TEXT, columns=COLUMNS, facts={"batch": BATCH})
    try:
        import torch  # noqa: F401
    except ImportError:
        record.note("PyTorch is missing: pip install 'photosite[torch]'")
        return record
    rounds, steps, photographs, epochs = run.pick(1, 2, 4), run.pick(1, 3, 5), run.pick(0, 4, 12), run.pick(1, 2, 4)
    found = sources(run.folder)
    batch = next(endless(found["stored pairs"], 0))
    kinds: dict[tuple[str, int], Iterator] = {("the network alone", 0): iter(lambda: batch, None)}
    kinds |= {(name, workers): endless(pairs, workers) for name, pairs in found.items() for workers in (0, 1)}
    task = run.progress.add_task("  steps", total=rounds * len(kinds) * (WARM_UP + steps))
    waits = in_turns(kinds, rounds, steps, lambda: run.progress.advance(task))
    run.progress.remove_task(task)
    alone = waits["the network alone", 0].step_s
    for (name, workers), wait in waits.items():
        more = {"workers": workers, "share": wait.share, "over": wait.step_s / alone}
        record.add("step", name, {"median_s": wait.step_s}, **more)
    if photographs:
        task = run.progress.add_task("  photographs", total=2 * 2 * (1 + epochs))
        rows = measure_photographs(run.folder, photographs, epochs, lambda: run.progress.advance(task))
        run.progress.remove_task(task)
        for row in rows:
            record.add("photographs", row.pop("name"), {}, over=row.pop("over_loop"), **row)
    return record
