"""How time grows: with megapixels, blur radius, path length, layers, threads and batch size, with slopes of the logarithms.

Run as a script, it takes a shot on so many processors and prints its times: a process of its own for each number of threads.

    python benchmarks/scaling.py PROCESSORS MEGAPIXELS ROUNDS
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from defocus import depth_of
from measuring.contest import turns
from measuring.record import Record, is_ours, slope
from measuring.run import Run
from measuring.work import ELD
from motion import LENS, camera_of, frame_size, moving_shot, squares, surfaces
from pairs import patches
from peers import photosite
from skips import scene_of

from simulator import simulate
from simulator.device import open_device
from simulator.exposure.settings import Exposure
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack
from simulator.sensor.readout import read_out
from simulator.sensor.seeds import Seeds

MOST_SLOPE = {"megapixels": 1.1}  # of the logarithms; what is not named is only shown
BLURRED_PX = 6.0
LARGEST_HELD = 25.0  # megapixels that one process takes from a scene in memory; larger frames are processes with files
ASKED_SENSOR, ASKED_GROWTH = 5.0, 2.0  # a radius of 16 px over the sensor kernel; 32 px over 16 px
TEXT = """\
Whole shots in colour of squares with a pixel for each photosite, tolerance 0.1 σ. Megapixels: in focus, out of focus (radius 6)
and moving (20 photosites); frames above 25 megapixels, of a chart, are processes that write their files. Radius: one picture
out of focus, {radius_size} photosites. Path: one picture that moves, {path_size} photosites. Layers: all out of focus by
different radii, each with holes, {layer_size} photosites. Threads: a blurred shot on so many processors, its wall time. Batch:
patches of 128 x 128 through the sensor in one call of `simulator.sensor.frame_stack`. The slope is that of the logarithms over
all sizes above 0.
"""


def focused_shot(megapixels: float, radius_px: float) -> Shot:
    """A shot of one picture whose blur circle has this radius."""
    width, height = frame_size(megapixels)
    camera = camera_of(width, height, 3)
    depth_m = depth_of(np.array([radius_px]), camera.pixel_pitch_um)
    return Shot(scene_of(squares(width, height, 1)[0], depth_m), LENS, Exposure(1e-3), camera)


def path_shot(megapixels: float, length_px: float) -> Shot:
    """A shot of one picture in focus that moves on a path of this length."""
    way = (0.95 * length_px, 0.312 * length_px)
    held = surfaces(squares(*frame_size(megapixels), 1), (0.0,), (way,))
    shot = moving_shot(held, 3, 0.1)
    return shot if length_px else replace(shot, motion=None)


def layered_shot(megapixels: float, count: int) -> Shot:
    """A shot of so many layers, all but the last with holes, out of focus by radii from -6 to 6."""
    width, height = frame_size(megapixels)
    camera, lights = camera_of(width, height, 3), squares(width, height, count)
    radii = np.linspace(-BLURRED_PX, BLURRED_PX, count) if count > 1 else np.array([BLURRED_PX])
    y, x = np.mgrid[:height, :width]
    layers = []
    for number, (light, radius) in enumerate(zip(lights, radii, strict=True)):
        is_last, step = number + 1 == count, 90 + 14 * number
        inside = (x % step - 40) ** 2 + (y % step - 40) ** 2 < 35**2
        coverage = None if is_last else inside.astype(np.float32)
        planes = np.repeat((light if coverage is None else light * coverage)[..., None], 3, axis=2).astype(np.float32)
        layers.append(Layer(planes, depth_of(np.array([radius]), camera.pixel_pitch_um), coverage))
    first, *behind = layers
    scene = replace(scene_of(lights[0], first.depth_m), planes=first.planes, coverage=first.coverage, behind=tuple(behind))
    for array in scene.arrays():
        array.setflags(write=False)
    return Shot(scene, LENS, Exposure(1e-3), camera)


def taking(shot: Shot) -> Callable[[], object]:
    """Taking a shot."""
    return lambda: simulate(shot)


def batch(count: int) -> Callable[[], object]:
    """A batch of patches through the sensor."""
    device, mean_e = open_device(), patches(count, 1.0, 1000.0)[:, :128, :128]
    mean_e, stages = np.ascontiguousarray(mean_e), tuple(photosite.stages_of(ELD))
    settings = [FrameSetting(stages, Seeds(body=1, frame=frame)) for frame in range(count)]
    return lambda: expose_frame_stack(device, mean_e, settings)


def grow(run: Run, record: Record, case: str, family: str, sizes: Iterable[float], make: Callable[[Any], Callable]) -> None:
    """Add rows of one kind of work over its sizes."""
    runs = {f"Photosite, {family}, {size:g}": (size, make(size)) for size in sizes}
    found = run.turns(f"{case}: {family}", {name: work for name, (_, work) in runs.items()})
    for name, (size, _) in runs.items():
        record.add(case, name, found[name], x=float(size), family=family)


def measure_scaling(run: Run) -> Record:
    """Times over all that grows."""
    columns = {"case": ["over", ""], "family": ["work", ""], "x": ["size", ".4g"], "best_s": ["time [s]", ".3g"]}
    columns |= {"cpu_s": ["processor time [s]", ".3g"]}
    record = Record("scaling", "How time grows", TEXT, columns=columns, chart="scaling")
    sizes = run.pick((0.05, 0.1, 0.2), (0.1, 0.3, 1.0, 3.0, 10.0), (0.1, 0.3, 1.0, 3.0, 10.0, 25.0, 48.0, 100.0, 400.0))
    most = run.pick(0.2, 3.0, 10.0)  # of those that are blurred or move
    kinds = {"in focus": lambda size: taking(focused_shot(size, 0.0)), "radius 6": lambda size: taking(focused_shot(size, 6.0))}
    kinds["path of 20"] = lambda size: taking(path_shot(size, 20.0))
    for family, make in kinds.items():
        for size in sizes:  # one after the other, so that no more than one is held
            if size > LARGEST_HELD:
                if family == "in focus":
                    _large(run, record, size)
            elif family == "in focus" or size <= most:
                grow(run, record, "megapixels", family, [size], make)
    small = run.pick(0.1, 1.0, 3.0)
    record.facts |= dict.fromkeys(("radius_size", "path_size", "layer_size"), "{} x {}".format(*frame_size(small)))
    radii = run.pick((0, 2, 16, 32), (0, 1, 2, 4, 8, 16, 32, 64, 128, 256), (0, 1, 2, 4, 8, 16, 32, 64, 128, 256))
    grow(run, record, "radius in px", "one picture", radii, lambda radius: taking(focused_shot(small, radius)))
    paths = run.pick((0, 8, 32), (0, 2, 8, 32, 128, 256), (0, 1, 2, 4, 8, 16, 32, 64, 128, 256))
    grow(run, record, "path in px", "one picture", paths, lambda length: taking(path_shot(small, length)))
    counts = run.pick((1, 2), (1, 2, 4, 8), (1, 2, 3, 4, 6, 8, 12))
    grow(run, record, "layers", "out of focus", counts, lambda count: taking(layered_shot(small / 2, count)))
    batches = run.pick((1, 8), (1, 4, 16, 64, 256), (1, 2, 4, 8, 16, 32, 64, 128, 256))
    grow(run, record, "patches of a batch", "sensor", batches, batch)
    _threads(run, record, run.pick(0.1, 3.0, 12.0))
    _judge(run, record, small)
    return record


def _large(run: Run, record: Record, megapixels: float) -> None:
    """Add a frame that is too large for memory's comfort: in strips on disk, by a process of its own."""
    from photograph import run_simulate

    side = 16 * round(1e3 * megapixels**0.5 / 16)
    try:
        ended = run_simulate(run.folder, "color_checker", [f"camera.width={side}", f"camera.height={side}"])
    except (RuntimeError, OSError) as problem:
        return record.note(f"{megapixels:g} Mpixel: {str(problem).splitlines()[-1]}")
    timing = {"best_s": ended.time_s, "median_s": ended.time_s, "cpu_s": ended.cpu_s, "runs": 1}
    record.add("megapixels", f"Photosite, process, {megapixels:g}", timing, x=1e-6 * side**2, family="process with files")


def _threads(run: Run, record: Record, megapixels: float) -> None:
    """Add a blurred shot on 1, 2, 4 ... processors, each in a process of its own."""
    if not hasattr(os, "sched_setaffinity"):
        return record.note("threads: this system cannot keep a process to some processors")
    there = len(os.sched_getaffinity(0))
    counts = sorted({count for count in (1, 2, 4, 8, 16, 32, 64, 128) if count < there} | {there})
    for count in counts:
        numbers = (str(count), str(megapixels), str(run.rounds))
        told = subprocess.run([sys.executable, __file__, *numbers], capture_output=True, text=True, check=True).stdout
        timing = json.loads(told.splitlines()[-1])
        name = f"Photosite, {count} threads"
        record.add("threads", name, timing, x=float(count), family="radius 6", is_wall=True)


def _judge(run: Run, record: Record, megapixels: float) -> None:
    """Slopes, and what was asked of the blur of one radius."""
    for case, rows in record.cases().items():
        for family in dict.fromkeys(row["family"] for row in rows):
            own = [row for row in rows if row["family"] == family and is_ours(row) and row["x"] > 0]
            if len(own) < 2:
                continue
            key = "best_s" if case == "threads" else "cpu_s"
            found, most = slope((row["x"] for row in own), (row[key] for row in own)), MOST_SLOPE.get(case)
            asked = "to be shown" if most is None else f"at most {most:g}"
            record.judge(f"slope over {case}, {family}", f"{found:.2f}", asked, most is None or found <= most)
    shot, device = focused_shot(megapixels, 0.0), open_device()
    planned = plan(shot)
    light = expose(planned, device)
    sensor = run.turns("sensor", {"sensor kernel": lambda: read_out(device, planned.sensor, light, shot.seeds)})
    own = {row["x"]: row["cpu_s"] for row in record.rows if row["case"].startswith("radius")}
    more = (own[16.0] - own[0.0]) / sensor["sensor kernel"]["cpu_s"]
    what = "a radius of 16 px, beyond a sharp shot, over the sensor kernel"
    record.judge(what, f"{more:.1f} x", f"at most {ASKED_SENSOR:g} x", more <= ASKED_SENSOR)
    growth = own[32.0] / own[16.0]
    record.judge("time at 32 px over that at 16 px", f"{growth:.2f}", f"at most {ASKED_GROWTH:g}", growth <= ASKED_GROWTH)


def main() -> None:
    """Take a blurred shot on some processors and print its times as JSON."""
    processors, megapixels, rounds = sys.argv[1:]
    os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[: int(processors)]))
    found = turns({"Photosite": taking(focused_shot(float(megapixels), BLURRED_PX))}, int(rounds))
    print(json.dumps(found["Photosite"]))


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).parent))
    main()
