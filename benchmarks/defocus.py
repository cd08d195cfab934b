"""The lens blur: time against the sensor kernel, and run time against error beside slabs in SciPy and rays in Mitsuba.

    python benchmarks/defocus.py [--out build/benchmarks]

The scene is a wall that tilts away from the plane in focus to a blur radius of 16 photosites, with disks out of focus the other
way before it. The error is against rays through the lens (`simulator/optics/ray_reference/layered_rays.py`) in a window with
edges, in units
of the noise when the brightest light gives 2000 e-. SciPy's slabs see one picture with its depth, as they do for their users,
and hidden surfaces are unknown to them; the row "one picture with depth" gives Photosite no more than that. Mitsuba renders
both surfaces in the window with its scalar thin lens; its time is scaled to the frame by the number of photosites, the scene's
loading left out.
"""

import argparse
import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring.blur_report import chart, verdicts
from measuring.report import Report
from peers.mitsuba_lens import MitsubaLens
from peers.slab_fft import slab_blur
from rich.console import Console

from simulator import load_shot
from simulator.device import Buffer, Device, open_device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.accuracy import BRIGHT
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Window
from simulator.sensor.readout import read_out

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "grey_ramp.yaml"
RADII_PX = (2.0, 4.0, 8.0, 16.0, 32.0)
LENS = ThinLens(50.0, 1.4, focus_distance_m=2.0, cos4=False)
STEPS_PX = (4.0, 2.0, 1.0)
WINDOW = Window(1700, 1200, 192, 192)  # photosites compared with rays: the rim of a disk before the wall
RAYS = 8192
TOLERANCES = (1.0, 0.3, 0.1)
ELECTRONS, PROBE_S = 2000.0, 1e-3  # of the brightest light; exposure at which it is looked at
MARGIN = 20  # around it
MITSUBA_RAYS = (16, 64, 256, 1024)  # per photosite


def timed(run: Callable[[], object], rounds: int, warm: bool = False) -> dict[str, float]:
    """Least wall and processor time [s]; a first run is not counted, unless all is warm."""
    if not warm:
        run()
    wall, cpu = [], []
    for _ in range(rounds):
        started, used = time.perf_counter(), time.process_time()
        run()
        wall.append(time.perf_counter() - started)
        cpu.append(time.process_time() - used)
    return {"best_s": min(wall), "cpu_s": min(cpu)}


class FixedScene:
    """A scene in memory."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def load(self) -> Scene:
        """The scene itself."""
        return self.scene


def one_radius(device: Device, rounds: int) -> list[dict]:
    """Time of the blur of one distance over the time of the sensor kernel, in turns."""
    shot = load_shot(SHOT, {"camera": "sony_a7s2"})
    sharp = plan(shot)
    mosaic = expose(measure(sharp, device), device)
    rows = []
    for radius in RADII_PX:
        defocus = Defocus((radius,), True, sharp.optics.projection.scale)
        blurred = replace(sharp, optics=replace(sharp.optics, defocus=defocus))

        def blur(blurred: Plan = blurred) -> None:
            expose(measure(blurred, device), device)
            device.finish()

        sensor, found = timed(lambda: read_out(device, sharp.sensor, mosaic, shot.seeds), rounds), timed(blur, rounds)
        rows.append({"radius_px": radius, **found, "sensor_s": sensor["best_s"], "sensor_cpu_s": sensor["cpu_s"]})
    return rows


def wall_with_disks(width: int, height: int) -> tuple[np.ndarray, ...]:
    """Colours (2, height, width, 3), coverage and signed radius (2, height, width) of disks before a tilted wall."""
    rng = np.random.default_rng(11)
    y, x = np.mgrid[:height, :width].astype(np.float32)
    colours = []
    for _ in range(2):
        coarse = rng.random((3, height // 6 + 2, width // 6 + 2), dtype=np.float32)
        fine = np.kron(coarse, np.ones((1, 6, 6), np.float32))[:, :height, :width]
        colours.append(0.25 + 0.5 * fine + 0.2 * np.sin(0.11 * x + 0.05 * y))
    inside = np.zeros((height, width), bool)
    for row in range(160, height, 420):
        for column in range(200, width, 520):
            inside |= (x - column) ** 2 + (y - row) ** 2 < 110.0**2
    coverage = np.stack([inside, np.ones_like(inside)]).astype(np.float32)
    radius = np.stack([np.full_like(x, -6.0), 16.0 * x / width])
    return np.ascontiguousarray(np.stack(colours).transpose(0, 2, 3, 1)), coverage, radius


def depth_of(radius_px: np.ndarray, pitch_um: float) -> float | np.ndarray:
    """Distance at which LENS blurs by this signed radius [m]."""
    per_dioptre = float(LENS.blur_radius_um(np.inf) - LENS.blur_radius_um(1.0)) / pitch_um
    depth = 1.0 / (0.5 - radius_px / per_dioptre)
    return float(depth.flat[0]) if np.ptp(depth) == 0.0 else depth


def scene_plans(camera_shot: Shot) -> tuple[dict[str, Plan], tuple[np.ndarray, ...]]:
    """Plans of the scene as layers and as one picture with depth, and what it is made of."""
    camera = camera_shot.camera
    colours, coverage, radius = wall_with_disks(camera.width_px, camera.height_px)
    wavelengths = np.arange(400.0, 701.0, 10.0)
    spectra = 1e-3 * np.stack([(wavelengths >= low) & (wavelengths < low + 100.1) for low in (600.0, 500.0, 400.0)])
    near, far = (depth_of(px, camera.pixel_pitch_um) for px in radius)
    flat = coverage[0][..., None] * colours[0] + (1.0 - coverage[0][..., None]) * colours[1]
    layered = Scene(
        (colours[0] * coverage[0][..., None]).astype(np.float32),
        spectra,
        wavelengths,
        np.ones(31),
        near,
        coverage=coverage[0],
        behind=(Layer(colours[1].astype(np.float32), far),),
    )
    single = replace(
        layered, planes=flat.astype(np.float32), depth_m=np.where(coverage[0] > 0, near, far), coverage=None, behind=()
    )
    pictures = {"one picture with depth": single, "the same, background continued": replace(single, hidden="extend")}
    shots = {f"layers, {tolerance:g} σ": (layered, tolerance) for tolerance in TOLERANCES}
    shots |= {name: (one, TOLERANCES[-1]) for name, one in pictures.items()}

    def planned(one: Scene, tolerance: float, time_s: float) -> Plan:
        shot = replace(camera_shot, scene=FixedScene(one), lens=LENS, exposure=Exposure(time_s), tolerance=tolerance)
        return plan(shot)

    probe = planned(layered, TOLERANCES[0], PROBE_S).optics.accuracy.electrons
    time_s = PROBE_S * ELECTRONS / probe
    return {name: planned(*what, time_s) for name, what in shots.items()}, (colours, coverage, radius)


def window_surfaces(planned: Plan, scene: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """Light in the camera's colours (2, rows, columns, 3), coverage, radius (2, rows, columns) of the window and its margin."""
    rows, columns = (
        slice(WINDOW.y - MARGIN, WINDOW.y + WINDOW.height + MARGIN),
        slice(WINDOW.x - MARGIN, WINDOW.x + WINDOW.width + MARGIN),
    )
    colours, coverage, radius = (plane[:, rows, columns] for plane in scene)
    return (colours * coverage[..., None]) @ planned.optics.weights.astype(np.float32), coverage, radius


def rays(device: Device, planned: Plan, scene: tuple[np.ndarray, ...]) -> np.ndarray:
    """Mean over the lens of the scene's own surfaces in the window, (height, width) in each photosite's colour."""
    light, coverage, radius = window_surfaces(planned, scene)
    surfaces = upload_surfaces(device, light.transpose(0, 3, 1, 2), coverage, radius, MARGIN)
    points = ray_samples(RAYS)
    points[..., :2] = 0.5  # the surfaces hold one value per photosite, and so do all contestants
    block = planned.optics.cfa.planes
    found = sample_lens(device, surfaces, points, Window(0, 0, WINDOW.width, WINDOW.height), cfa=block, cells=False)
    return device.download(found, (WINDOW.height, WINDOW.width), np.float32)


def error(found: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """Deviation in units of the noise, when the brightest light gives ELECTRONS."""
    electrons = ELECTRONS / np.quantile(truth, BRIGHT)
    z = np.abs(electrons * (found - truth) / np.sqrt(electrons * truth + 4.0))
    return {"rms": float(np.sqrt((z**2).mean())), "p99": float(np.quantile(z, 0.99)), "above_1": float((z > 1).mean())}


def time_and_error(device: Device, rounds: int) -> list[dict]:
    """Run time for 12 megapixels and error in the window, of every method."""
    shot = load_shot(SHOT, {"camera": "sony_a7s2"})
    plans, scene = scene_plans(shot)
    first = next(iter(plans.values()))
    truth = rays(device, first, scene)
    here = slice(WINDOW.y, WINDOW.y + WINDOW.height), slice(WINDOW.x, WINDOW.x + WINDOW.width)
    rows = []
    for name, planned in plans.items():
        mosaic: list[Buffer] = []

        def blur(planned: Plan = planned, mosaic: list[Buffer] = mosaic) -> None:
            mosaic[:] = [expose(measure(planned, device), device)]
            device.finish()

        took, frame = timed(blur, rounds), planned.optics.window
        found = device.download(mosaic[0], (frame.height, frame.width), np.float32)[here]
        rows.append({"name": f"Photosite, {name}", **took, **error(found, truth)})
    colours, coverage, radius = scene
    flat = (coverage[0][..., None] * colours[0] + (1.0 - coverage[0][..., None]) * colours[1]).transpose(2, 0, 1)
    depth = np.where(coverage[0] > 0, radius[0], radius[1])
    planes = np.tensordot(first.optics.weights.T.astype(np.float32), flat, axes=1)
    (a, b), (c, d) = first.optics.cfa.planes
    for how in ("add", "over"):
        for step in STEPS_PX:
            started, used = time.perf_counter(), time.process_time()
            blurred = slab_blur(planes, depth, step, how)
            took = {"best_s": time.perf_counter() - started, "cpu_s": time.process_time() - used}
            own = np.empty(depth.shape, np.float32)
            for plane, (row, column) in zip((a, b, c, d), ((0, 0), (0, 1), (1, 0), (1, 1)), strict=True):
                own[row::2, column::2] = blurred[plane][row::2, column::2]
            rows.append({"name": f"SciPy, slabs of {step:g} px, {how}", **took, **error(own[here], truth)})
    return rows + by_mitsuba(first, scene, truth)


def by_mitsuba(planned: Plan, scene: tuple[np.ndarray, ...], truth: np.ndarray) -> list[dict]:
    """Time, scaled to the frame, and error of Mitsuba's renders of the window; none where Mitsuba is missing."""
    light, coverage, radius = window_surfaces(planned, scene)
    camera, frame = planned.sensor.camera, planned.optics.window
    lens = MitsubaLens(
        0.5e-3 * LENS.pupil_diameter_mm, LENS.focus_distance_m, 1e3 * LENS.image_distance_mm / camera.pixel_pitch_um
    )
    try:
        render = lens.renderer(light, coverage[0], radius, MARGIN)
    except ImportError:
        return []
    own = np.tile(planned.optics.cfa.planes, (WINDOW.height // 2, WINDOW.width // 2))[..., None]
    scale, rows = frame.width * frame.height / (WINDOW.width * WINDOW.height), []
    render(1)
    for number in MITSUBA_RAYS:
        found: list[np.ndarray] = []
        took = timed(lambda number=number, found=found: found.append(render(number)), 1, warm=True)
        took = {name: scale * seconds for name, seconds in took.items()}
        rows.append({"name": f"Mitsuba, {number} rays", **took, **error(np.take_along_axis(found[-1], own, 2)[..., 0], truth)})
    return rows


def main() -> None:
    """Measure, print, and write defocus.json and defocus.png."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--rounds", type=int, default=3, help="counted runs of each fast method")
    parser.add_argument("--out", type=Path, default=Path("build/benchmarks"), help="folder for defocus.json and defocus.png")
    settings = parser.parse_args()
    device = open_device()
    radii, rows = one_radius(device, settings.rounds), time_and_error(device, settings.rounds)
    camera = load_shot(SHOT, {"camera": "sony_a7s2"}).camera
    report = Report(camera.width_px, camera.height_px, verdicts=verdicts(radii, rows))
    if len(report.verdicts) < 4:
        report.notes.append("Mitsuba, which is not installed: pip install mitsuba")
    record = report.as_json() | {"device": device.info.label, "radii": radii, "rows": rows}
    for row in record["radii"]:
        ratio, cpu = row["best_s"] / row["sensor_s"], row["cpu_s"] / row["sensor_cpu_s"]
        print(f"radius {row['radius_px']:4g} px: {row['best_s']:.3f} s, {ratio:.1f} x the sensor (processor time {cpu:.1f} x)")
    for row in record["rows"]:
        took, off = f"{row['best_s']:7.2f} s, processor {row['cpu_s']:7.2f} s", f"p99 {row['p99']:.2f}, rms {row['rms']:.2f}"
        print(f"{row['name']:45s} {took}, {off}")
    report.show(Console())
    settings.out.mkdir(parents=True, exist_ok=True)
    (settings.out / "defocus.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    chart(record["rows"], settings.out / "defocus.png")


if __name__ == "__main__":
    main()
