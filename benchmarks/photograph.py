"""Whole photographs: run time against error beside SciPy and NumPy, the price of a real lens, of a start and of a large frame.

The scene is that of `make demo`, the Middlebury motorcycle with measured depth. Times are of the second call in a process, in
turns in the same run, unless a row is a process of its own.
"""

import os
import resource
import shutil
import statistics
import tempfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from defocus import mosaic_of
from measuring.light import light_of
from measuring.processes import Ended, time_process
from measuring.record import ERROR_COLUMNS, OURS, Z_ERROR, Record, slope, z_errors
from measuring.run import Run
from motion import BLUR_PX, frame_size, moving_shot, photographs, surfaces
from peers.slab_fft import slab_blur
from scipy.ndimage import map_coordinates

from data_gen.sources.motorcycle import motorcycle_scene
from simulator import load_shot, simulate
from simulator.device import Device
from simulator.optics.defocus.scene_light import BRIGHT
from simulator.pipeline.passes import PROGRAM_BYTES
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Window

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
TOLERANCES, DEFAULT = (1.0, 0.3, 0.1, 0.03), 0.1
STEPS_PX = (4.0, 2.0, 1.0)  # between SciPy's slabs
ELECTRONS = 2000.0  # of the brightest light, for the unit of the error
TRUTH_SIGMA = 0.05  # standard error of each photosite by rays, a tenth of the p99 that is found [σ]
UNSEEN = 0.03  # difference that the background behind edges may make to photosites that are compared [σ]
ASKED_LENS, ASKED_ALL = 3.0, 6.0  # times the ideal lens
ASKED_FLAT_S, ASKED_SHOT_S = 0.8, 3.0  # as processes
ASKED_LARGE_S = 1.2  # of 12 megapixels, second call
ASKED_PEAK, ASKED_SLOPE = 0.2, 1.1  # of the stated peak; of the logarithms of time over photosites
CALLS, ASKED_GROWTH = 200, 0.02  # growth of the memory over these calls
PHOTOSITE = "from data_gen.command_line import main; main()"  # the command, of this Python
DATA_SET = """\
count: 64
seed: 5
crop: [256, 256]
pictures: {drawings: {procedural: [dead_leaves, gradients, text], width: 320, height: 320}}
noise: {cameras: {sony_a7s2: {iso: {measured: [800, 25600]}}}}
crops_per_picture: 8
writer: {format: npz, samples_per_shard: 32}
"""
TEXT = """\
The scene of `make demo`, the Middlebury motorcycle with its measured depth, on {size} photosites, from the scene in memory to
codes in memory. The error is that of the light on the sensor in a window of {compared} against rays through the lens
(`tolerance: 0`) of the same scene, in units of the noise of 2,000 e⁻ of the brightest light, over the photosites that see no
background which the picture does not show. SciPy and NumPy interpolate the
picture on photosites, blur slabs of constant blur circle by FFT, and draw Poisson and normal numbers.
"""
LENSES_TEXT = """\
The same scene on {size} photosites through real lenses, beside the ideal one.
"""
STARTS_TEXT = """\
Processes of their own with warm caches, files and all; and the memory of {calls} shots in one process.
"""
LARGE_TEXT = """\
A colour chart on large frames as processes, files and all, beside the peak of memory that `explain` states.
"""


@cache
def scene_file() -> Path:
    """The scene's picture, written once for all sections; removed when the process ends."""
    folder = tempfile.TemporaryDirectory(prefix="photosite-")
    _FOLDERS.append(folder)
    return motorcycle_scene(Path(folder.name) / "motorcycle.exr")


_FOLDERS: list[tempfile.TemporaryDirectory] = []


def shot_of(name: str, *settings: str, megapixels: float | None = None) -> Shot:
    """A shot of the scene; of so many megapixels, on a sensor of the same size, which has larger photosites."""
    shot = load_shot(SHOTS / f"{name}.yaml", [f"scene.image={scene_file()}", *settings])
    if megapixels is None:
        return shot
    camera = shot.camera
    share = (1e6 * megapixels / (camera.width_px * camera.height_px)) ** 0.5
    width, height = (16 * round(share * side / 16) for side in (camera.width_px, camera.height_px))
    pitch_um = camera.pixel_pitch_um * camera.width_px / width
    return replace(shot, camera=replace(camera, width_px=width, height_px=height, pixel_pitch_um=pitch_um))


def size_of(shot: Shot) -> str:
    """Width and height of a shot's frame."""
    return f"{shot.camera.width_px} x {shot.camera.height_px}"


def most_mixed(shot: Shot, planned: Plan, width: int, height: int) -> Window:
    """The window of this size over which blur radii differ most, of those in the middle nine tenths of the frame."""
    camera, scale = shot.camera, planned.optics.projection.scale
    depth_m = np.asarray(shot.scene.load().depth_m)
    radius_px = np.asarray(shot.lens.blur_radius_um(depth_m) / camera.pixel_pitch_um)
    found = []
    for y in range(camera.height_px // 20, camera.height_px * 19 // 20 - height, height):
        for x in range(camera.width_px // 20, camera.width_px * 19 // 20 - width, width):
            left, top = (
                int((place - 0.5 * side) * scale + 0.5 * extent)
                for place, side, extent in zip((x, y), (camera.width_px, camera.height_px), depth_m.shape[::-1], strict=True)
            )
            part = radius_px[max(top, 0) : top + int(height * scale) + 1, max(left, 0) : left + int(width * scale) + 1]
            found.append((float(part.std()) if part.size else 0.0, x, y))
    _, x, y = max(found)
    return Window(x // 2 * 2, y // 2 * 2, width, height)


def by_few_rays(planned: Plan) -> Plan:
    """Return a plan by rays whose photosites are left at a standard error of TRUTH_SIGMA."""
    optics = planned.optics
    return replace(planned, optics=replace(optics, accuracy=replace(optics.accuracy, ray_error=TRUTH_SIGMA)))


def shows_all(shot: Shot, device: Device) -> np.ndarray:
    """Photosites of a shot, (height, width) bool, that see no background which the picture does not show.

    It makes no difference to them whether the background is continued behind edges.
    """
    with_it, without = (
        light_of(device, plan(replace(shot, scene=replace(shot.scene.load(), hidden=hidden), tolerance=0.03)))
        for hidden in ("extend", "none")
    )
    scale = ELECTRONS / float(np.quantile(with_it, BRIGHT))
    return np.abs(with_it - without) * scale < UNSEEN * np.sqrt(scale * with_it + 4.0)


def through_slabs(planned: Plan, shot: Shot, step_px: float, how: Literal["add", "over"]) -> tuple[np.ndarray, np.ndarray]:
    """Light on the sensor and codes, as users of SciPy and NumPy make them of the picture and its depth."""
    scene, camera, projection = shot.scene.load(), shot.camera, planned.optics.projection
    height, width = camera.height_px, camera.width_px
    rows = (np.arange(height) + 0.5 - 0.5 * height) * projection.scale + 0.5 * scene.planes.shape[0] - 0.5
    columns = (np.arange(width) + 0.5 - 0.5 * width) * projection.scale + 0.5 * scene.planes.shape[1] - 0.5
    places = np.meshgrid(rows, columns, indexing="ij")
    light = np.tensordot(planned.optics.weights.T.astype(np.float32), scene.planes.transpose(2, 0, 1), axes=1)
    planes = np.stack([map_coordinates(plane, places, order=1, mode="nearest", output=np.float32) for plane in light])
    depth_m = map_coordinates(np.broadcast_to(scene.depth_m, scene.planes.shape[:2]), places, order=0, mode="nearest")
    radius_px = np.asarray(shot.lens.blur_radius_um(depth_m) / camera.pixel_pitch_um)
    mosaic = mosaic_of(slab_blur(planes, radius_px, step_px, how), planned.optics.cfa.planes)
    rng, mean_e = np.random.default_rng(1), np.maximum(mosaic, 0.0) * planned.optics.accuracy.electrons_per_radiance
    signal = rng.poisson(mean_e).astype(np.float32)
    signal += np.float32(2.0) * rng.standard_normal(signal.shape, dtype=np.float32)
    return mosaic, np.clip(np.rint(signal * np.float32(0.1) + np.float32(512.0)), 0, 16383).astype(np.uint16)


def measure_photograph(run: Run) -> Record:
    """Run time and error of the whole chain, stopped down and wide open."""
    columns = ERROR_COLUMNS | {"error": [Z_ERROR, ".2f"], "p99": ["p99", ".2f"], "rms": ["rms", ".3f"]}
    record, device = Record("photograph", "Whole photographs", TEXT, Z_ERROR, columns, "error"), run.device()
    megapixels = run.pick(0.8, 2.0, 12.0)
    for name in (STOPPED_DOWN, WIDE_OPEN):
        base = shot_of(name, megapixels=megapixels)
        compared = run.pick((32, 24), (48, 32), (192, 128))
        record.facts |= {"size": size_of(base), "compared": "{} x {}".format(*compared)}
        window = most_mixed(base, plan(base), *compared)
        here = np.s_[window.y : window.y + window.height, window.x : window.x + window.width]
        part = replace(base, camera=replace(base.camera, window=window))
        truth, known = light_of(device, by_few_rays(plan(replace(part, tolerance=0.0)))), shows_all(part, device)
        shots = {f"Photosite, {tolerance:g} σ": replace(base, tolerance=tolerance) for tolerance in TOLERANCES}
        runs: dict[str, Callable[[], object]] = {key: lambda shot=shot: simulate(shot) for key, shot in shots.items()}
        planned, made = plan(base), {}

        def slabs(key: str, step: float, base: Shot = base, planned: Plan = planned, made: dict = made) -> None:
            made[key] = through_slabs(planned, base, step, "over")[0]

        steps = {f"SciPy, slabs of {step:g} px": step for step in STEPS_PX}
        runs |= {key: lambda key=key, step=step, slabs=slabs: slabs(key, step) for key, step in steps.items()}
        scale = ELECTRONS / float(np.quantile(truth, BRIGHT))
        case = f"f/{base.lens.f_number:g}"
        for key, timing in run.turns(case, runs).items():
            found = (light_of(device, plan(shots[key])) if key in shots else made[key])[here]
            more = {"is_default": True} if key.endswith(f" {DEFAULT:g} σ") else {}
            record.add(case, key, timing, **z_errors(found[known], truth[known], scale), **more)
        record.facts[f"known, {case}"] = float(known.mean())
    record.mark_dominated()
    judge_large(run, record)
    return record


def judge_large(run: Run, record: Record) -> None:
    """Add verdicts on large frames out of focus, second call: one picture with depth, and two photographs as layers at rest."""
    megapixels, rest = run.pick(0.2, 12.0, 12.0), (0.0, 0.0)
    layers = surfaces(photographs(*frame_size(megapixels), 2), BLUR_PX, (rest, rest))
    shots = {
        "wide open": shot_of(WIDE_OPEN, megapixels=megapixels),
        "two layers": replace(moving_shot(layers, 3, DEFAULT), motion=None),
    }
    for what, shot in shots.items():
        name = f"{what}, {megapixels:g} Mpixel"
        timing = run.turns(name, {OURS: lambda shot=shot: simulate(shot)})[OURS]
        told = f"{timing['best_s']:.2f} s, of processors {timing['cpu_s']:.2f} s"
        record.judge(name, told, f"{ASKED_LARGE_S:g} s", timing["best_s"] <= ASKED_LARGE_S)


def measure_lenses(run: Run) -> Record:
    """Real lenses beside the ideal one."""
    columns = {"case": ["stop", ""], "name": ["lens", ""], "best_s": ["time [s]", ".3g"]}
    columns |= {"cpu_s": ["processor time [s]", ".3g"], "cpu_ratio": ["over the ideal lens", ".1f"]}
    record = Record("lenses", "The price of a real lens", LENSES_TEXT, columns=columns)
    everything = [setting for settings in LENSES.values() for setting in settings]
    for name in (STOPPED_DOWN, WIDE_OPEN):
        options: dict[str, list[str]] = {"ideal": [], **LENSES}
        if run.size == "full" or name == STOPPED_DOWN:  # wide open it takes minutes
            options["all together"] = everything
        shots = {key: shot_of(name, *more, megapixels=run.pick(0.1, 12.0, 12.0)) for key, more in options.items()}
        case = f"f/{shots['ideal'].lens.f_number:g}"
        record.facts["size"] = size_of(shots["ideal"])
        found: dict[str, dict[str, float]] = {}
        for key, shot in shots.items():  # one after the other: tables of so many lenses do not stay in memory together
            ours = f"{OURS}, {key}"  # whose first run, which computes kernels, does not count
            found[key] = run.turns(f"{case}, {key}", {ours: lambda shot=shot: simulate(shot)})[ours]
        ratios = {key: timing["cpu_s"] / found["ideal"]["cpu_s"] for key, timing in found.items()}
        for key, timing in found.items():
            record.add(case, key, timing, cpu_ratio=ratios[key])
        worst = max(LENSES, key=lambda key: ratios[key])
        what = f"{case}: dearest part, {worst}"
        record.judge(what, f"{ratios[worst]:.1f} x", f"{ASKED_LENS:g} x", ratios[worst] <= ASKED_LENS)
        if "all together" in ratios:
            ratio = ratios["all together"]
            record.judge(f"{case}: all together", f"{ratio:.1f} x", f"{ASKED_ALL:g} x", ratio <= ASKED_ALL)
    return record


def run_simulate(folder: Path, name: str, settings: list[str]) -> Ended:
    """Run `photosite simulate` on a shot, files and all."""
    options = [word for setting in settings for word in ("--set", setting)]
    ended = time_process("-c", PHOTOSITE, "simulate", name, *options, "--out", str(folder / "out"))
    shutil.rmtree(folder / "out")
    return ended


def measure_starts(run: Run) -> Record:
    """Processes with warm caches, and memory over many calls."""
    columns = {"name": ["process", ""], "best_s": ["time [s]", ".2f"], "cpu_s": ["processor time [s]", ".2f"]}
    record = Record("starts", "Starts, data sets and memory", STARTS_TEXT, columns=columns, facts={"calls": CALLS})
    window, scene = "camera.window={x: 0, y: 0, width: 512, height: 512}", f"scene.image={scene_file()}"
    data_set = run.folder / "pairs.yaml"
    data_set.write_text(DATA_SET, encoding="utf-8")

    def write_pairs() -> Ended:
        ended = time_process("-c", PHOTOSITE, "dataset", str(data_set), "--out", str(run.folder / "pairs"))
        shutil.rmtree(run.folder / "pairs")
        return ended

    processes: dict[str, tuple[Callable[[], Ended], float | None]] = {
        "simulate: flat field, 512 x 512": (lambda: run_simulate(run.folder, "flat_field", [window]), ASKED_FLAT_S),
        "simulate: wide open, 12 Mpixel": (lambda: run_simulate(run.folder, WIDE_OPEN, [scene]), ASKED_SHOT_S),
        "dataset: 64 pairs of 256 x 256": (write_pairs, None),
    }
    for name, (start, most_s) in processes.items():
        took = [start() for _ in range(run.rounds + 1)][1:]
        times = [one.time_s for one in took]
        timing = {"best_s": min(times), "median_s": statistics.median(times), "runs": len(times)}
        timing["cpu_s"] = statistics.median(one.cpu_s for one in took)
        record.add("processes", f"Photosite, {name}", timing)
        if most_s is not None:
            record.judge(f"photosite {name}", f"{min(times):.2f} s", f"{most_s:g} s", min(times) <= most_s)
    shot = shot_of(WIDE_OPEN)
    shot, held = replace(shot, camera=replace(shot.camera, window=Window(1700, 1200, 256, 256))), []
    for _ in range(CALLS):
        simulate(shot)
        held.append(resident_bytes())
    early, late = statistics.median(held[CALLS // 10 : CALLS // 5]), statistics.median(held[-CALLS // 10 :])
    growth = late / early - 1.0
    record.facts |= {"early_bytes": early, "late_bytes": late}
    record.judge(f"memory over {CALLS} calls", f"{growth:+.1%}", f"{ASKED_GROWTH:.0%}", growth <= ASKED_GROWTH)
    return record


def resident_bytes() -> int:
    """Memory of this process that is in use."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * resource.getpagesize()


def measure_large(run: Run) -> Record:
    """Large frames as processes: time, peak and stated peak of memory."""
    columns = {"case": ["size", ""], "best_s": ["time [s]", ".1f"], "cpu_s": ["processor time [s]", ".1f"]}
    columns |= {"peak_gb": ["peak of memory [GB]", ".2f"], "stated_gb": ["stated by `explain` [GB]", ".2f"]}
    record = Record("large", "Large frames", LARGE_TEXT, columns=columns)
    for megapixels in run.pick((1.0, 4.0), (12.0, 48.0, 100.0), (12.0, 48.0, 100.0, 400.0)):
        if 12 * 1e6 * megapixels > shutil.disk_usage(run.folder).free:
            record.note(f"{megapixels:g} Mpixel, for which the disk has no room")
            continue
        side = 16 * round(1e3 * megapixels**0.5 / 16)
        settings = [f"camera.width={side}", f"camera.height={side}"]
        stated = plan(load_shot(SHOTS / "color_checker.yaml", settings)).memory_bytes() + PROGRAM_BYTES
        if stated > os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"):
            record.note(f"{megapixels:g} Mpixel, for which the memory has no room")
            continue
        ended = run_simulate(run.folder, "color_checker", settings)
        timing = {"best_s": ended.time_s, "median_s": ended.time_s, "cpu_s": ended.cpu_s, "runs": 1}
        more = {"x": 1e-6 * side**2, "peak_gb": 1e-9 * ended.peak_bytes, "stated_gb": 1e-9 * stated}
        record.add(f"{1e-6 * side**2:.0f} Mpixel", "Photosite", timing, **more)
        off, asked = ended.peak_bytes / stated - 1.0, f"{1e-9 * stated:.2f} GB stated, 20 %"
        figure = f"{1e-9 * ended.peak_bytes:.2f} GB, {off:+.0%}"
        record.judge(f"peak at {megapixels:g} Mpixel", figure, asked, abs(off) <= ASKED_PEAK)
    found = slope((row["x"] for row in record.rows), (row["best_s"] for row in record.rows))
    record.judge("time over photosites, slope of the logarithms", f"{found:.2f}", f"{ASKED_SLOPE:g}", found <= ASKED_SLOPE)
    return record
