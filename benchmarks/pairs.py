"""Noisy patches for denoisers: `simulator.sensor.frame_stack` beside the ELD model in NumPy and PyTorch, all in one run, in
turns.

A batch is of mosaics of 512 x 512 photosites, which are 4 x 256 x 256 when packed, cut from the pictures of sensor.py. All
contestants get mean electrons as an array in memory and leave codes there. Peers make one patch after the other: whole in a
core's cache, that is faster for them than all at once.
"""

import numpy as np
from measuring.contest import Contestant
from measuring.record import Record, Row
from measuring.run import Run
from measuring.work import ELD, LIGHT, Sensor
from peers import photosite
from sensor import judge_peers, peers_of, with_ratios

from simulator.device import DeviceInfo, devices, open_device
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack
from simulator.sensor.seeds import Seeds

TEXT = """\
ELD model, {frames} patches of 4 x 256 x 256. A patch is a mosaic of 512 x 512 photosites, cut from the pictures of the sensor
benchmark; it goes from mean electrons in memory to codes in memory. Peers make one patch after the other, which a core's cache
holds. "{frames} at once" is one call of `simulator.sensor.frame_stack` for all patches, "1 at once" one call for each.
"""
SIDE_PX, ACROSS = 512, 8  # of a patch; patches along a picture's ramp
ASKED = {"numpy_eld": 20.0, "torch_eld": 8.0}


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

    return Contestant(f"{photosite.named(info)}, {at_once} at once", run, lambda: np.concatenate(last["codes"]), True)


def one_by_one(column: tuple[Contestant, ...]) -> Contestant:
    """One contestant of one for each patch."""

    def run() -> None:
        for each in column:
            each.run()

    return Contestant(column[0].name, run, lambda: np.stack([each.codes() for each in column]))


def theirs(mean_e: np.ndarray, sensor: Sensor, record: Record) -> dict[Contestant, float]:
    """Peers, and what is asked of the ratio to each; a note for those that are not installed."""
    patches_of = [peers_of(ASKED, patch, sensor, record) for patch in mean_e]
    found = {}
    for module in patches_of[0]:
        columns = zip(*(made[module] for made in patches_of), strict=True)
        found |= {one_by_one(column): ASKED[module] for column in columns}
    return found


def measure_pairs(run: Run) -> Record:
    """All contests, by light, and a verdict for each peer."""
    columns = {"light": ["light", ""], "name": ["method", ""], "pairs_per_s": ["pairs per second", ".0f"]}
    record = Record("pairs", "Pairs for denoisers", TEXT, columns=columns, chart="rates")
    frames, found = run.pick(4, 32, 64), devices()
    record.facts["frames"] = frames
    rows_of: dict[str, list[Row]] = {}
    asked: dict[str, float] = {}
    for light, limits in LIGHT.items():
        mean_e = patches(frames, *limits)
        peers = theirs(mean_e, ELD, record)
        asked |= {each.name: ratio for each, ratio in peers.items()}
        contestants = [*(ours(mean_e, ELD, info, frames) for info in found), ours(mean_e, ELD, found[0], 1), *peers]
        timings, rows, flat = run.contest(f"pairs, {light}", contestants), [], (frames * SIDE_PX, SIDE_PX)
        for each in contestants:
            timing = timings[each.name].summary()
            rate = {"mpixel_per_s": mean_e.size / 1e6 / timing["best_s"], "pairs_per_s": frames / timing["best_s"]}
            mean_error, variance = ELD.check(each.codes().reshape(flat), mean_e.reshape(flat))
            more = {"mean_error": mean_error, "variance": variance, "contest": "ELD model", "light": light}
            rows.append(record.add(f"ELD model, {light}", each.name, timing, **rate, **more))
        for row in with_ratios(rows):
            if row["name"] in asked:
                rows_of.setdefault(row["name"], []).append(row)
    judge_peers(record, "pairs", rows_of, asked)
    return record
