"""Noisy patches for denoisers: `simulator.sensor.frame_stack` beside the ELD model in NumPy and PyTorch, all in one run, in
turns.

A batch is 64 mosaics of 512 x 512 photosites, which are 4 x 256 x 256 when packed, cut from the pictures of sensor.py. All
contestants get mean electrons as an array in memory and leave codes there. Peers make one patch after the other: whole in a
core's cache, that is faster for them than all at once.

    python benchmarks/pairs.py [--frames 64] [--rounds 5] [--out build/benchmarks]
"""

import argparse
import importlib
from pathlib import Path

import numpy as np
from measuring.contest import Contestant, contest
from measuring.report import Report, Section
from measuring.work import ELD, LIGHT, Sensor
from peers import photosite
from rich.console import Console
from rich.progress import Progress

from simulator.device import DeviceInfo, devices, open_device
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack
from simulator.sensor.seeds import Seeds

SIDE_PX, ACROSS = 512, 8  # of a patch; patches along a picture's ramp
ASKED = {"numpy_eld": 25.0, "torch_eld": 8.0}


def patches(frames: int, low_e: float, high_e: float) -> np.ndarray:
    """Mean electrons (frames, 512, 512) float32: a picture that rises in log steps from left to right, cut up."""
    picture = np.exp(np.linspace(np.log(low_e), np.log(high_e), ACROSS * SIDE_PX)).reshape(ACROSS, 1, SIDE_PX)
    places = np.arange(frames) % ACROSS
    return np.ascontiguousarray(np.broadcast_to(picture, (ACROSS, SIDE_PX, SIDE_PX))[places], dtype=np.float32)


def ours(mean_e: np.ndarray, sensor: Sensor, info: DeviceInfo, at_once: int) -> Contestant:
    """Captures of so many frames at once."""
    device, last = open_device(info.label), {}
    stages = tuple(photosite.stages_of(sensor))
    settings = [FrameSetting(stages, Seeds(body=1, frame=frame)) for frame in range(len(mean_e))]
    parts = [slice(first, first + at_once) for first in range(0, len(mean_e), at_once)]

    def run() -> None:
        last["codes"] = [expose_frame_stack(device, mean_e[part], settings[part]) for part in parts]

    return Contestant(f"{photosite.named(info)}, {at_once} at once", run, lambda: np.concatenate(last["codes"]))


def one_by_one(column: tuple[Contestant, ...]) -> Contestant:
    """One contestant of one for each patch."""

    def run() -> None:
        for each in column:
            each.run()

    return Contestant(column[0].name, run, lambda: np.stack([each.codes() for each in column]))


def theirs(mean_e: np.ndarray, sensor: Sensor, report: Report) -> dict[Contestant, float]:
    """Peers, and what is asked of the ratio to each; a note for those that are not installed."""
    found = {}
    for module, asked in ASKED.items():
        try:
            peer = importlib.import_module(f"peers.{module}")
        except ImportError as error:
            note = f"peers/{module}.py: {error}"
            report.notes += [] if note in report.notes else [note]
            continue
        make = getattr(peer, "contestants", None) or (lambda *work, peer=peer: [peer.contestant(*work)])
        columns = zip(*(make(patch, sensor) for patch in mean_e), strict=True)
        found |= {one_by_one(column): asked for column in columns}
    return found


def measure(frames: int, rounds: int, progress: Progress) -> Report:
    """All contests, by light, and a verdict for each peer."""
    report, ratios, found = Report(SIDE_PX, SIDE_PX), {}, devices()
    for light, limits in LIGHT.items():
        mean_e = patches(frames, *limits)
        peers = theirs(mean_e, ELD, report)
        contestants = [*(ours(mean_e, ELD, info, frames) for info in found), ours(mean_e, ELD, found[0], 1), *peers]
        task = progress.add_task(f"pairs, {light}", total=rounds * len(contestants))
        timings = contest(contestants, rounds, lambda task=task: progress.advance(task))
        rows = [timings[each.name].summary(mean_e.size / 1e6) for each in contestants]
        for row, each in zip(rows, contestants, strict=True):
            row["pairs_per_s"] = frames / row["best_s"]
            flat = (frames * SIDE_PX, SIDE_PX)
            row["mean_error"], row["variance"] = ELD.check(each.codes().reshape(flat), mean_e.reshape(flat))
        report.sections.append(Section(f"ELD model, {frames} patches of 4 x 256 x 256", light, rows, compared=True))
        for each, asked in peers.items():
            ratios.setdefault((each.name, asked), []).append(next(row for row in rows if row["name"] == each.name))
    for (name, asked), rows in ratios.items():
        wall, cpu = sorted(row["ratio"] for row in rows), sorted(row["cpu_ratio"] for row in rows)
        figure = f"{wall[0]:.1f} to {wall[-1]:.1f} x in time, {cpu[0]:.1f} to {cpu[-1]:.1f} x in CPU time"
        verdict = {"what": f"pairs, against {name}", "figure": figure, "asked": f"{asked:g} x in time"}
        report.verdicts.append(verdict | {"reached": wall[0] >= asked})
    return report


def main() -> None:
    """Measure, print, and write pairs.json and pairs.png."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--frames", type=int, default=64, help="patches of a batch")
    parser.add_argument("--rounds", type=int, default=5, help="turns of each contestant")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for pairs.json and pairs.png")
    options = parser.parse_args()
    with Progress(console=Console(stderr=True)) as progress:
        report = measure(options.frames, options.rounds, progress)
    written = report.write(options.out / "pairs")
    report.show(Console(width=140))
    print("wrote", ", ".join(str(path) for path in written))


if __name__ == "__main__":
    main()
