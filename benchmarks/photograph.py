"""Whole photographs: the price of a real lens, of a crop, of a start, of a sweep and of a large frame, each in one run.

The scene is that of `make demo`, the Middlebury motorcycle with measured depth, taken with all 12 megapixels. Times are of the
second call in a process, ratios of turns in the same run, unless a row is a process of its own.

    python benchmarks/photograph.py [--rounds 3] [--only lens,crop,...] [--large 12,48,100] [--out build/benchmarks]
"""

import argparse
import json
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring.contest import turns
from measuring.report import Report
from rich.console import Console
from rich.progress import Progress

from data_gen.sources.motorcycle import motorcycle_scene
from simulator import load_shot, save, simulate, simulate_many
from simulator.atomic_files import atomic_write
from simulator.device import open_device
from simulator.pipeline.execution import expose
from simulator.pipeline.passes import PROGRAM_BYTES
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window
from simulator.sensor.readout import read_out

SHOTS = Path(__file__).parent.parent / "configs" / "shots"
STOPPED_DOWN, WIDE_OPEN = "motorcycle_stopped_down", "motorcycle_wide_open"
RIMS = "{front: {distance: 30 mm, diameter: 44 mm}, rear: {distance: 20 mm, diameter: 26 mm}}"
CHROMATIC = "[{wavelength: 450 nm, focus: 20 um}, {wavelength: 550 nm, focus: 0 um}, {wavelength: 650 nm, focus: 15 um}]"
LENSES = {
    "diffraction": ["lens.diffraction=true"],
    "spherical, coma, chromatic": [f"lens.aberrations={{spherical: 0.5 um, coma: 1 um, chromatic: {CHROMATIC}}}"],
    "low-pass filter": ["camera.low_pass=4 um"],
    "fill factor": ["camera.fill_factor=0.6"],
    "rims": [f"lens.vignetting={RIMS}"],
    "blades": ["lens.aperture={blades: 7}"],
    "distortion": ["lens.distortion={k1: -0.03}"],
    "glare": ["lens.veiling_glare=0.02"],
}
ASKED_LENS, ASKED_ALL = 3.0, 6.0  # times the ideal lens
ASKED_CROP, ASKED_CROP_S, CROP = 1.5, 0.010, Window(1700, 1200, 512, 512)  # times its share, and seconds beside it
ASKED_FLAT_S, ASKED_SHOT_S = 0.8, 3.0  # as processes
ASKED_WIDE_OPEN_S = 1.2
ASKED_END_TO_END = 4.0  # times sensor kernel and plain write
ASKED_SWEEP = 3.0  # times one shot, for all ISOs of its camera
ASKED_PEAK = 0.2  # of the stated peak
CALLS, ASKED_GROWTH = 200, 0.02  # growth of the memory over these calls


def taking(shot: Shot) -> Callable[[], object]:
    """Taking a shot."""
    return lambda: simulate(shot)


class Bench:
    """The scene's file, the rows and verdicts found, and how often each contestant takes its turn."""

    def __init__(self, folder: Path, rounds: int, large_mpx: list[float]) -> None:
        self.folder, self.rounds, self.large_mpx = folder, rounds, large_mpx
        self.rows: dict[str, list[dict]] = {}
        self.verdicts: list[dict] = []
        motorcycle_scene(folder / "motorcycle.exr")

    def shot(self, name: str, *settings: str) -> Shot:
        """A shot of the scene."""
        return load_shot(SHOTS / f"{name}.yaml", [f"scene.image={self.folder / 'motorcycle.exr'}", *settings])

    def judge(self, what: str, figure: str, asked: str, reached: bool) -> None:
        """Note a verdict."""
        self.verdicts.append({"what": what, "figure": figure, "asked": asked, "reached": bool(reached)})

    def _run_process(self, name: str, settings: list[str]) -> tuple[float, int]:
        """Run `photosite simulate` on a shot, files and all; returns its time [s] and the peak of its memory [byte]."""
        options = [word for setting in settings for word in ("--set", setting)]
        out, started = self.folder / "out", time.perf_counter()
        command = [sys.executable, "-m", "simulator", "simulate", name, *options, "--out", str(out)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        time_s = time.perf_counter() - started
        if process.returncode != 0:
            raise RuntimeError(f"{' '.join(command)} failed")
        shutil.rmtree(out)
        return time_s, 1024 * used.ru_maxrss

    def lens(self) -> None:
        """Real lenses beside the ideal one."""
        everything = [setting for settings in LENSES.values() for setting in settings]
        for name in (STOPPED_DOWN, WIDE_OPEN):
            options = {"ideal": [], **LENSES, "all together": everything}
            shots = {option: self.shot(name, *settings) for option, settings in options.items()}
            found = turns({option: taking(shot) for option, shot in shots.items()}, self.rounds)
            ideal_s, label = found["ideal"]["best_s"], f"f/{shots['ideal'].lens.f_number:g}"
            for option, times in found.items():
                ratio = times["best_s"] / ideal_s
                self.rows.setdefault("lens", []).append({"name": f"{label}, {option}", **times, "ratio": ratio})
            worst = max((option for option in LENSES), key=lambda option: found[option]["best_s"])
            ratio = found[worst]["best_s"] / ideal_s
            self.judge(f"{label}: dearest part, {worst}", f"{ratio:.1f} x", f"{ASKED_LENS:g} x", ratio <= ASKED_LENS)
            ratio = found["all together"]["best_s"] / ideal_s
            self.judge(f"{label}: all together", f"{ratio:.1f} x", f"{ASKED_ALL:g} x", ratio <= ASKED_ALL)

    def crop(self) -> None:
        """A window beside its share of the whole frame."""
        for name, settings in ((STOPPED_DOWN, []), (WIDE_OPEN, []), (STOPPED_DOWN, ["lens.diffraction=true"])):
            whole = self.shot(name, *settings)
            part = replace(whole, camera=replace(whole.camera, window=CROP))
            found = turns({"whole": taking(whole), "window": taking(part)}, self.rounds)
            share = CROP.width * CROP.height / (whole.camera.width_px * whole.camera.height_px)
            whole_s, window_s = found["whole"]["best_s"], found["window"]["best_s"]
            label = ", ".join([f"f/{whole.lens.f_number:g}", *(["diffraction"] if settings else [])])
            most_s = ASKED_CROP * share * whole_s + ASKED_CROP_S
            self.rows.setdefault("crop", []).append({"name": label, "whole_s": whole_s, "window_s": window_s, "most_s": most_s})
            self.judge(f"{label}: 512 x 512", f"{1e3 * window_s:.0f} ms", f"{1e3 * most_s:.0f} ms", window_s <= most_s)

    def start(self) -> None:
        """Processes with warm caches."""
        window = "camera.window={x: 0, y: 0, width: 512, height: 512}"
        scene = f"scene.image={self.folder / 'motorcycle.exr'}"
        for what, name, settings, most_s in (
            ("flat field, 512 x 512", "flat_field", [window], ASKED_FLAT_S),
            ("wide open, 12 Mpixel", WIDE_OPEN, [scene], ASKED_SHOT_S),
        ):
            took = [self._run_process(name, settings)[0] for _ in range(self.rounds + 1)]
            best_s = min(took[1:])
            self.rows.setdefault("start", []).append({"name": what, "best_s": best_s, "median_s": statistics.median(took[1:])})
            self.judge(f"photosite simulate: {what}", f"{best_s:.2f} s", f"{most_s:g} s", best_s <= most_s)

    def photograph(self) -> None:
        """The photographs themselves, with an ideal lens."""
        shots = {
            "f/8": self.shot(STOPPED_DOWN),
            "f/1.4, background unknown": self.shot(WIDE_OPEN, "scene.hidden=none"),
            "f/1.4, background continued": self.shot(WIDE_OPEN),
        }
        found = turns({name: taking(shot) for name, shot in shots.items()}, self.rounds)
        self.rows["photograph"] = [{"name": name, **times} for name, times in found.items()]
        best_s = found["f/1.4, background continued"]["best_s"]
        asked = f"{ASKED_WIDE_OPEN_S:g} s"
        self.judge("f/1.4, background continued", f"{best_s:.2f} s", asked, best_s <= ASKED_WIDE_OPEN_S)

    def again(self) -> None:
        """The ISOs of a camera, which share the light on the sensor."""
        shot = self.shot(WIDE_OPEN)
        isos = [replace(shot, exposure=replace(shot.exposure, iso=iso)) for iso in shot.camera.isos]

        def sweep() -> None:
            for _ in simulate_many(isos):
                pass

        found = turns({"one shot": taking(shot), f"its {len(isos)} ISOs": sweep}, self.rounds)
        self.rows["again"] = [{"name": name, **times} for name, times in found.items()]
        one_s, all_s = (times["best_s"] for times in found.values())
        self.judge(f"{len(isos)} ISOs over one", f"{all_s / one_s:.1f} x", f"{ASKED_SWEEP:g} x", all_s <= ASKED_SWEEP * one_s)

    def end_to_end(self) -> None:
        """A sharp frame with its files beside the sensor kernel and a plain write of the same bytes."""
        shot, device = load_shot(SHOTS / "color_checker.yaml"), open_device()
        planned = plan(shot)
        mosaic = expose(planned, device)
        files = save(simulate(shot), self.folder)
        payloads = [(path, path.read_bytes()) for path in (files.dng, files.twin, files.sidecar)]

        def plain() -> None:
            for path, payload in payloads:
                with atomic_write(path) as temporary:
                    temporary.write_bytes(payload)

        runs = {
            "sensor kernel": lambda: read_out(device, planned.sensor, mosaic, shot.seeds),
            "plain write of the files": plain,
            "shot with its files": lambda: save(simulate(shot), self.folder),
        }
        found = turns(runs, max(self.rounds, 5))
        self.rows["end to end"] = [{"name": name, **times} for name, times in found.items()]
        kernel_s, plain_s, whole_s = (times["best_s"] for times in found.values())
        ratio = (whole_s - plain_s) / kernel_s
        what, asked = "sharp frame less plain write, over the sensor kernel", f"{ASKED_END_TO_END:g} x"
        self.judge(what, f"{ratio:.1f} x", asked, ratio <= ASKED_END_TO_END)

    def large(self) -> None:
        """Large frames as processes: time, peak and stated peak of memory."""
        rows = []
        for megapixels in self.large_mpx:
            side = 16 * round(1e3 * megapixels**0.5 / 16)
            settings = [f"camera.width={side}", f"camera.height={side}"]
            stated = plan(load_shot(SHOTS / "color_checker.yaml", settings)).memory_bytes() + PROGRAM_BYTES
            time_s, peak = self._run_process("color_checker", settings)
            rows.append({"megapixels": 1e-6 * side**2, "time_s": time_s, "peak_bytes": peak, "stated_bytes": stated})
        self.rows["large"] = rows
        for row in rows:
            off = row["peak_bytes"] / row["stated_bytes"] - 1.0
            figure = f"{1e-9 * row['peak_bytes']:.2f} GB, {off:+.0%}"
            asked = f"{1e-9 * row['stated_bytes']:.2f} GB stated, 20 %"
            self.judge(f"peak at {row['megapixels']:.0f} Mpixel", figure, asked, abs(off) <= ASKED_PEAK)
        if len(rows) > 1:
            size, time_s = (np.log([row[key] for row in rows]) for key in ("megapixels", "time_s"))
            slope = float(np.polyfit(size, time_s, 1)[0])
            self.judge("time over pixels, slope of the logarithms", f"{slope:.2f}", "1.1", slope <= 1.1)

    def memory(self) -> None:
        """Memory of many calls in one process."""
        shot = self.shot(WIDE_OPEN)
        shot = replace(shot, camera=replace(shot.camera, window=CROP))
        held = []
        for _ in range(CALLS):
            simulate(shot)
            held.append(resident_bytes())
        early, late = statistics.median(held[CALLS // 10 : CALLS // 5]), statistics.median(held[-CALLS // 10 :])
        growth = late / early - 1.0
        self.rows["memory"] = [{"name": f"{CALLS} calls", "early_bytes": early, "late_bytes": late}]
        self.judge(f"memory over {CALLS} calls", f"{growth:+.1%}", f"{ASKED_GROWTH:.0%}", growth <= ASKED_GROWTH)


def resident_bytes() -> int:
    """Memory of this process that is in use."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize()


PARTS = {"large": Bench.large, "lens": Bench.lens, "crop": Bench.crop, "start": Bench.start, "photograph": Bench.photograph}
PARTS |= {"again": Bench.again, "end to end": Bench.end_to_end, "memory": Bench.memory}


def main() -> None:
    """Measure, print, and write photograph.json."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=3, help="turns of each contestant")
    parser.add_argument("--only", default=",".join(PARTS), help="parts, separated by commas")
    parser.add_argument("--large", default="12,48,100", help="megapixels of the large frames; 400 takes 4 GB of disk")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for photograph.json")
    options = parser.parse_args()
    chosen = options.only.split(",")
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder, Progress(console=Console(stderr=True)) as progress:
        bench = Bench(Path(folder), options.rounds, [float(number) for number in options.large.split(",")])
        task = progress.add_task("photographs", total=len(chosen))
        for name in chosen:
            progress.update(task, description=name)
            PARTS[name](bench)
            progress.advance(task)
    for name, rows in bench.rows.items():
        for row in rows:
            print(name, *(f"{key} {value:.4g}" if isinstance(value, float) else value for key, value in row.items()))
    for verdict in bench.verdicts:
        word = "reached" if verdict["reached"] else "missed"
        print(f"{verdict['what']}: {verdict['figure']} (asked: {verdict['asked']}): {word}")
    options.out.mkdir(parents=True, exist_ok=True)
    record = Report(4240, 2832, verdicts=bench.verdicts).as_json() | {"rows": bench.rows}
    with atomic_write(options.out / "photograph.json") as path:
        path.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(f"wrote {options.out / 'photograph.json'}")


if __name__ == "__main__":
    main()
