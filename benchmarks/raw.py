"""Writing a raw file beside a plain write of its bytes, and beside taking the shot: all in one run, in turns.

A plain write is written beside and renamed, too, and reaches the disk in the same way, so that only the making of the
file differs.
"""

from pathlib import Path

from measuring.record import Record
from measuring.run import Run

from simulator import load_shot, save, simulate
from simulator.atomic_files import atomic_write
from simulator.device import open_device
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import plan
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.sensor.readout import read_out

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "color_checker.yaml"
ASKED_BEYOND_S = 0.1  # of a DNG beyond a plain write of its bytes
ASKED_RATIO = 2.0  # of a DNG with its twin to taking the shot
ASKED_END_TO_END = 4.0  # times sensor kernel and plain write
TEXT = """\
{size} photosites; a plain write is written beside and renamed like the others, and is on the disk when it returns.
"""


def measure_raw(run: Run) -> Record:
    """Times of writing, of taking the shot, and of both beside the sensor kernel and a plain write."""
    columns = {"name": ["", ""], "best_s": ["best [s]", ".3f"], "median_s": ["median [s]", ".3f"]}
    record, shot, folder, device = (
        Record("raw", "Writing raw files", TEXT, columns=columns),
        load_shot(SHOT),
        run.folder,
        open_device(),
    )
    raw, planned = simulate(shot), plan(shot)
    mosaic = expose(planned, device)
    record.facts["size"] = "{1} x {0}".format(*raw.dn.shape)
    payload, files = dng_bytes(raw), save(raw, folder)
    payloads = {path: path.read_bytes() for path in (files.dng, files.twin, files.sidecar)}

    def write(contents: dict[Path, bytes]) -> None:
        for place, content in contents.items():
            with atomic_write(place) as path:
                path.write_bytes(content)

    runs = {
        "plain write of the DNG's bytes": lambda: write({folder / "plain.dng": payload}),
        "DNG": lambda: write_dng(raw, folder / "a.dng"),
        "plain write of all files": lambda: write(payloads),
        "DNG, truth twin and settings": lambda: save(raw, folder),
        "sensor kernel": lambda: read_out(device, planned.sensor, mosaic, shot.seeds),
        "simulate": lambda: simulate(shot),
        "simulate, with all files": lambda: save(simulate(shot), folder),
    }
    found = run.turns("raw files", runs)
    for name, timing in found.items():
        record.add("raw files", name, timing)
    best = {name: timing["best_s"] for name, timing in found.items()}
    beyond_s = best["DNG"] - best["plain write of the DNG's bytes"]
    what = "a DNG beyond a plain write of its bytes"
    record.judge(what, f"{beyond_s:.3f} s", f"{ASKED_BEYOND_S} s", beyond_s <= ASKED_BEYOND_S)
    ratio = best["DNG, truth twin and settings"] / best["simulate"]
    record.judge("a DNG with twin, over taking the shot", f"{ratio:.2f}", f"{ASKED_RATIO:g}", ratio <= ASKED_RATIO)
    ratio = (best["simulate, with all files"] - best["plain write of all files"]) / best["sensor kernel"]
    what = "sharp frame with files less their plain write, over the sensor kernel"
    record.judge(what, f"{ratio:.1f} x", f"{ASKED_END_TO_END:g} x", ratio <= ASKED_END_TO_END)
    return record
