"""The lens blur: run time against error beside slabs in SciPy and rays in Mitsuba.

The scene is a wall that tilts away from the plane in focus to a blur radius of 16 photosites, with disks out of focus the other
way before it. The error is against rays through the lens (`simulator/optics/ray_reference/layered_rays.py`) in a window with
edges, in units of the noise when the brightest light gives 2000 e-. SciPy's slabs see one picture with its depth, as they do
for their users, and hidden surfaces are unknown to them; the row "one picture with depth" gives Photosite no more than that.
Mitsuba renders both surfaces in the window with its scalar thin lens; its time is scaled to the frame by the number of
photosites, the scene's loading left out.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from measuring.contest import turns
from measuring.light import exposing
from measuring.record import ERROR_COLUMNS, Z_ERROR, Record, Row, z_errors
from measuring.run import Run
from peers.mitsuba_lens import MitsubaLens
from peers.slab_fft import slab_blur

from simulator import load_shot
from simulator.device import Device
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.scene_light import BRIGHT
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Window

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "grey_ramp.yaml"
LENS = ThinLens(50.0, 1.4, focus_distance_m=2.0, cos4=False)
STEPS_PX = (4.0, 2.0, 1.0)
WINDOW_PX = 192  # side of the window that is compared with rays
TOLERANCES = (1.0, 0.3, 0.1, 0.03)
DEFAULT = 0.1
ELECTRONS, PROBE_S = 2000.0, 1e-3  # of the brightest light; exposure at which it is looked at
MARGIN = 20  # photosites around the window
DISK_PX, FIRST_PX, STEP_PX = 110.0, (200, 160), (520, 420)  # radius; column and row of the first disk, and from one to the next
ASKED_P99 = 0.3
ASKED_SCIPY, ASKED_MITSUBA = 30.0, 100.0  # times faster at equal error
CASE = "wall and disks"
TEXT = """\
{size} photosites, RGGB. A wall that tilts from focus to a radius of 16 photosites behind disks of radius 6 on the other side;
error against rays through the lens in a window with edges, in units of the noise of 2,000 e⁻. SciPy sees one picture with its
depth, as its users do; so does Photosite in the rows "one picture with depth" and "background continued". Mitsuba
(`scalar_rgb`, `thinlens`) renders both surfaces in the window; its times are scaled to the frame by the number of photosites,
and the time at equal error comes from the power law through its two longest renders.
"""


class FixedScene:
    """A scene in memory."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene

    def load(self) -> Scene:
        """The scene itself."""
        return self.scene


def window_of(width: int, height: int) -> Window:
    """The window that is compared with rays: the rim of a disk before the wall."""
    across = max(round((0.415 * width - FIRST_PX[0]) / STEP_PX[0]), 0)
    down = max(round((0.5 * height - FIRST_PX[1]) / STEP_PX[1]), 1)
    x, y = FIRST_PX[0] + across * STEP_PX[0] - 60, FIRST_PX[1] + down * STEP_PX[1] - 220
    return Window(x, y, WINDOW_PX, WINDOW_PX)


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
    for row in range(FIRST_PX[1], height, STEP_PX[1]):
        for column in range(FIRST_PX[0], width, STEP_PX[0]):
            inside |= (x - column) ** 2 + (y - row) ** 2 < DISK_PX**2
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
    pictures = {"one picture with depth": single, "background continued": replace(single, hidden="extend")}
    shots = {f"layers, {tolerance:g} σ": (layered, tolerance) for tolerance in TOLERANCES}
    shots |= {name: (one, DEFAULT) for name, one in pictures.items()}

    def planned(one: Scene, tolerance: float, time_s: float) -> Plan:
        shot = replace(camera_shot, scene=FixedScene(one), lens=LENS, exposure=Exposure(time_s), tolerance=tolerance)
        return plan(shot)

    probe = planned(layered, TOLERANCES[0], PROBE_S).optics.accuracy.electrons
    time_s = PROBE_S * ELECTRONS / probe
    return {name: planned(*what, time_s) for name, what in shots.items()}, (colours, coverage, radius)


def window_surfaces(planned: Plan, scene: tuple[np.ndarray, ...]) -> tuple[np.ndarray, ...]:
    """Light in the camera's colours (2, rows, columns, 3), coverage, radius (2, rows, columns) of the window and its margin."""
    window = window_of(*planned.optics.sensor_px)
    rows = slice(window.y - MARGIN, window.y + window.height + MARGIN)
    columns = slice(window.x - MARGIN, window.x + window.width + MARGIN)
    colours, coverage, radius = (plane[:, rows, columns] for plane in scene)
    return (colours * coverage[..., None]) @ planned.optics.weights.astype(np.float32), coverage, radius


def rays(device: Device, planned: Plan, scene: tuple[np.ndarray, ...], rays_each: int) -> np.ndarray:
    """Mean over the lens of the scene's own surfaces in the window, (height, width) in each photosite's colour."""
    light, coverage, radius = window_surfaces(planned, scene)
    surfaces = upload_surfaces(device, light.transpose(0, 3, 1, 2), coverage, radius, MARGIN)
    points = ray_samples(rays_each)
    points[..., :2] = 0.5  # the surfaces hold one value per photosite, and so do all contestants
    block = planned.optics.cfa.planes
    found = sample_lens(device, surfaces, points, Window(0, 0, WINDOW_PX, WINDOW_PX), cfa=block, cells=False)
    return device.download(found, (WINDOW_PX, WINDOW_PX), np.float32)


def error(found: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """`z_errors`, when the brightest light gives ELECTRONS."""
    return z_errors(found, truth, ELECTRONS / float(np.quantile(truth, BRIGHT)))


def measure_defocus(run: Run) -> Record:
    """Run time for the frame and error in the window, of every method."""
    columns = ERROR_COLUMNS | {"error": [Z_ERROR, ".2f"], "p99": ["p99", ".2f"], "rms": ["rms", ".2f"]}
    record = Record("defocus", "The lens blur", TEXT, Z_ERROR, columns, "error")
    device, shot = run.device(), load_shot(SHOT, {"camera": "sony_a7s2"})
    width, height = run.pick((640, 640), (2128, 1424), (4240, 2832))
    camera = replace(shot.camera, width_px=width, height_px=height)
    record.facts["size"] = f"{width} x {height}"
    plans, scene = scene_plans(replace(shot, camera=camera))
    first, window = next(iter(plans.values())), window_of(width, height)
    truth = rays(device, first, scene, run.pick(1024, 4096, 8192))  # 4096 leave 0.006 σ
    here = np.s_[window.y : window.y + window.height, window.x : window.x + window.width]
    made: dict[str, Callable[[], np.ndarray]] = {}
    runs = {f"Photosite, {name}": exposing(device, planned, made, f"Photosite, {name}") for name, planned in plans.items()}
    runs |= slabs(first, scene, made)
    for name, timing in run.turns("lens blur", runs).items():
        more = {"is_default": True} if name.endswith((f" {DEFAULT:g} σ", "with depth")) else {}
        more |= {"family": name.replace(" of", ",").split(", ")[0] + name[name.rindex(",") :]} if "slabs" in name else {}
        record.add(CASE, name, timing, **error(made[name]()[here], truth), **more)
    by_mitsuba(record, first, scene, truth, run.pick((16, 64), (16, 64, 256), (16, 64, 256, 1024)))
    record.mark_dominated()
    judge(record)
    return record


def slabs(
    planned: Plan, scene: tuple[np.ndarray, ...], made: dict[str, Callable[[], np.ndarray]]
) -> dict[str, Callable[[], object]]:
    """Runs of SciPy's slabs of one picture with its depth."""
    colours, coverage, radius = scene
    flat = (coverage[0][..., None] * colours[0] + (1.0 - coverage[0][..., None]) * colours[1]).transpose(2, 0, 1)
    depth = np.where(coverage[0] > 0, radius[0], radius[1])
    planes = np.tensordot(planned.optics.weights.T.astype(np.float32), flat, axes=1)

    def blur(name: str, step: float, how: Literal["add", "over"]) -> None:
        blurred = slab_blur(planes, depth, step, how)
        made[name] = lambda: mosaic_of(blurred, planned.optics.cfa.planes)

    runs: dict[str, Callable[[], object]] = {}
    ways: dict[Literal["add", "over"], tuple[float, ...]] = {"add": STEPS_PX[-1:], "over": STEPS_PX}
    for how, steps in ways.items():  # those that are added take as long and are farther off
        for step in steps:
            name = f"SciPy, slabs of {step:g} px, {how}"
            runs[name] = lambda name=name, step=step, how=how: blur(name, step, how)
    return runs


def mosaic_of(planes: np.ndarray, block: np.ndarray) -> np.ndarray:
    """Each photosite's own colour, (height, width), of planes (channels, height, width); block: plane of 2 x 2 places."""
    own = np.empty(planes.shape[1:], np.float32)
    for row, column in np.ndindex(2, 2):
        own[row::2, column::2] = planes[int(block[row][column])][row::2, column::2]
    return own


def by_mitsuba(
    record: Record, planned: Plan, scene: tuple[np.ndarray, ...], truth: np.ndarray, rays_each: tuple[int, ...]
) -> None:
    """Add time, scaled to the frame, and error of Mitsuba's renders of the window; a note where Mitsuba is missing."""
    light, coverage, radius = window_surfaces(planned, scene)
    width, height = planned.optics.sensor_px
    distance_px = 1e3 * LENS.image_distance_mm / planned.sensor.camera.pixel_pitch_um
    lens = MitsubaLens(0.5e-3 * LENS.pupil_diameter_mm, LENS.focus_distance_m, distance_px)
    try:
        render = lens.renderer(light, coverage[0], radius, MARGIN)
    except ImportError:
        return record.note("Mitsuba, which is not installed: pip install mitsuba")
    scale = width * height / WINDOW_PX**2
    render(1)
    for number in rays_each:
        found: list[np.ndarray] = []
        took = turns({"": lambda number=number, found=found: found.append(render(number))}, 1, long_s=0.0)[""]
        took = {key: scale * value if key.endswith("_s") else value for key, value in took.items()}
        own = mosaic_of(found[-1].transpose(2, 0, 1), planned.optics.cfa.planes)
        record.add(CASE, f"Mitsuba, {number} rays", took, **error(own, truth))


def judge(record: Record) -> None:
    """What was asked, in processor time, which other programs hardly change."""
    layers = [row for row in record.rows if row["name"].startswith("Photosite, layers")]
    ours = min((row for row in layers if row["p99"] <= ASKED_P99), key=lambda row: row["cpu_s"], default=layers[-1])
    slab = min((row for row in record.rows if row["name"].startswith("SciPy")), key=lambda row: row["p99"])
    faster = slab["cpu_s"] / ours["cpu_s"]
    figure = f"{faster:.1f} x faster, p99 {slab['p99']:.2f} to {ours['p99']:.2f}"
    record.judge("layers, against SciPy's most exact slabs", figure, f"{ASKED_SCIPY:g} x", faster >= ASKED_SCIPY)
    if any(row["name"].startswith("Mitsuba") for row in record.rows):
        faster = at_equal_error(record.rows, ours["p99"]) / ours["cpu_s"]
        what, figure = "layers, against Mitsuba at equal error", f"{round(faster, -2):,.0f} x faster"
        record.judge(what, figure, f"{ASKED_MITSUBA:g} x", faster >= ASKED_MITSUBA)


def at_equal_error(rows: list[Row], p99: float) -> float:
    """Processor time that Mitsuba needs for this p99 [s], by the power law through its two longest renders."""
    first, last = [row for row in rows if row["name"].startswith("Mitsuba")][-2:]
    slope = np.log(last["cpu_s"] / first["cpu_s"]) / np.log(last["p99"] / first["p99"])
    return float(last["cpu_s"] * (p99 / last["p99"]) ** slope)
