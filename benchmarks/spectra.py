"""Spectra: run time against error of the light on the sensor from spectral cubes, beside NumPy and PyTorch.

Each pixel is a mixture of a few surfaces in one light. A cube samples the spectrum at evenly spaced wavelengths, linear between
them; Photosite also takes the scene as it is, factored into the surfaces' spectra and their shares. The truth is the integral
with the camera's response over wavelengths 0.25 nm apart in float64.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from measuring.light import exposing
from measuring.record import ERROR_COLUMNS, Z_ERROR, Record, z_errors
from measuring.run import Run
from motion import frame_size
from photograph import SHOTS

from simulator import load_shot
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera

ELECTRONS = 2000.0  # of the brightest light
FINE_NM = np.linspace(400.0, 700.0, 1201)
COUNTS = (4, 7, 13, 31, 61)  # wavelengths of a cube
PUBLISHED = (31, 61)  # of 10 and 5 nm, as cubes are published
LINES_NM = {436.0: 1.0, 487.0: 0.4, 546.0: 1.6, 587.0: 0.7, 611.0: 1.5}  # of a fluorescent lamp, 4 nm wide
TEXT = """\
{size} photosites, RGGB; pixels that mix four surfaces in even light (`smooth light`) and in that of a fluorescent lamp (`light
of lines`). A cube has 4 to 61 wavelengths from 400 to 700 nm, linear between them; "factored" is the scene as it is, four
spectra and their shares. The error is against the integral over wavelengths 0.25 nm apart in float64, in units of the noise of
2,000 e⁻ of the brightest light. NumPy and PyTorch sum a cube in float32 with the camera's response and pick each photosite's
colour.
"""


def surfaces_of() -> np.ndarray:
    """Reflectances at FINE_NM, (4, wavelengths): blue, green, red, grey."""
    steps = [1.0 / (1.0 + np.exp((FINE_NM - place) / width)) for place, width in ((490.0, 15.0), (600.0, -12.0))]
    return 0.05 + 0.9 * np.stack(
        [steps[0], np.exp(-0.5 * ((FINE_NM - 545.0) / 28.0) ** 2), steps[1], np.full_like(FINE_NM, 0.5)]
    )


def lights() -> dict[str, np.ndarray]:
    """Light at FINE_NM, by name."""
    lines = sum(power * np.exp(-0.5 * ((FINE_NM - place) / 4.0) ** 2) for place, power in LINES_NM.items())
    return {"smooth light": 1.0 + 0.3 * np.sin(FINE_NM / 60.0), "light of lines": 0.1 + np.asarray(lines)}


def shares_of(width: int, height: int) -> np.ndarray:
    """Share of each surface in each pixel, (height, width, 4) float32, sum 1."""
    shares = np.random.default_rng(5).random((height // 4 + 1, width // 4 + 1, 4), dtype=np.float32) ** 3
    shares /= shares.sum(axis=2, keepdims=True)
    return np.ascontiguousarray(np.kron(shares, np.ones((4, 4, 1), np.float32))[:height, :width])


def scene_of(planes: np.ndarray, spectra: np.ndarray, wavelengths_nm: np.ndarray) -> Scene:
    """A flat scene of planes (height, width, bands), which cannot be written to."""
    planes.setflags(write=False)
    return Scene(planes, 1e-3 * spectra, wavelengths_nm, np.ones(len(wavelengths_nm)), 2.0, interpolation="nearest")


def truth_of(shares: np.ndarray, radiance: np.ndarray, camera: Camera) -> np.ndarray:
    """Electron radiance of each photosite in its own colour, float64; radiance: (4, FINE_NM) [W m^-2 sr^-1 nm^-1]."""
    photons = FINE_NM * 1e-9 / (6.62607015e-34 * 299792458.0) * 1e-12  # of a joule, and of a um^2 in a m^2
    curves = np.stack(
        [np.interp(FINE_NM, camera.response.wavelengths_nm, one, 0.0, 0.0) for one in camera.response.quantum_efficiency.T]
    )
    each = np.trapezoid(radiance[:, None] * curves * photons, FINE_NM, axis=2)
    return picked((shares.astype(np.float64) @ each).transpose(2, 0, 1), camera)


def picked(colours: np.ndarray, camera: Camera) -> np.ndarray:
    """Each photosite's own colour of planes (3, height, width)."""
    own = np.empty_like(colours[0])
    for row, column in np.ndindex(2, 2):
        own[row::2, column::2] = colours[camera.filter.planes[row][column], row::2, column::2]
    return own


def measure_spectra(run: Run) -> Record:
    """Run time and error of cubes of several wavelengths, and of the factored scene."""
    columns = ERROR_COLUMNS | {"error": [Z_ERROR, ".3g"], "rms": ["rms", ".3g"]}
    record, device = Record("spectra", "Spectra", TEXT, Z_ERROR, columns, "error"), run.device()
    width, height = frame_size(run.pick(0.05, 0.5, 4.0))
    record.facts["size"] = f"{width} x {height}"
    shot = load_shot(SHOTS / "grey_ramp.yaml", {"camera": "sony_a7s2"})
    camera, shares = replace(shot.camera, width_px=width, height_px=height), shares_of(width, height)
    lens = ThinLens(50.0, 4.0, focus_distance_m=2.0, cos4=False)
    for case, light in lights().items():
        radiance, made = surfaces_of() * light, {}
        runs: dict[str, Callable[[], object]] = {}

        def add(name: str, scene: Scene, made: dict = made, runs: dict = runs) -> Plan:
            planned = plan(Shot(scene, lens, Exposure(1e-3), camera))
            runs[name] = exposing(device, planned, made, name)
            return planned

        add("Photosite, factored", scene_of(shares.copy(), radiance, FINE_NM))
        for count in COUNTS:
            grid = np.linspace(400.0, 700.0, count)
            sampled = np.stack([np.interp(grid, FINE_NM, one) for one in radiance])
            cube = shares @ sampled.astype(np.float32)
            weights = add(f"Photosite, {count} wavelengths", scene_of(cube, np.eye(count), grid)).optics.weights
            runs |= peers_of(cube, weights, camera, count, made, record)
        truth = truth_of(shares, 1e-3 * radiance, camera)
        for name, timing in run.turns(case, runs).items():
            more = {"is_default": True} if name == "Photosite, factored" else {}
            found = made[name]()
            record.add(case, name, timing, **z_errors(found, truth, ELECTRONS / float(truth.max())), **more)
        judge_cubes(record, case)
    record.mark_dominated()
    return record


def judge_cubes(record: Record, case: str) -> None:
    """A cube is what a user has, not a setting: each against NumPy on the same cube, whose error is the same."""
    times = {row["name"]: row for row in record.rows if row["case"] == case}

    def least(key: str) -> float:
        pairs = ((times[f"{program}, {count} wavelengths"][key] for program in ("NumPy", "Photosite")) for count in PUBLISHED)
        return min(peer / ours for peer, ours in pairs)

    figure = f"{least('best_s'):.2f} x in time, {least('cpu_s'):.2f} x in CPU time"
    counts = " and ".join(map(str, PUBLISHED))
    record.judge(f"{case}: cubes of {counts} bands, against NumPy", figure, "1 x in time", least("best_s") >= 1.0)


def peers_of(
    cube: np.ndarray,
    weights: np.ndarray,
    camera: Camera,
    count: int,
    made: dict[str, Callable[[], np.ndarray]],
    record: Record,
) -> dict[str, Callable[[], object]]:
    """Runs of peers on a cube; a note for packages that are missing. weights: of each wavelength (count, 3) float32."""

    def keep(name: str, make: Callable[[], np.ndarray]) -> None:
        mosaic = make()
        made[name] = lambda: mosaic

    def by_numpy() -> np.ndarray:
        return picked(np.ascontiguousarray((cube @ weights).transpose(2, 0, 1)), camera)

    runs: dict[str, Callable[[], object]] = {
        f"NumPy, {count} wavelengths": lambda: keep(f"NumPy, {count} wavelengths", by_numpy)
    }
    try:
        import torch
    except ImportError:
        record.note("PyTorch, which is not installed: pip install torch")
        return runs
    planes, response = torch.from_numpy(cube.copy()), torch.from_numpy(np.ascontiguousarray(weights))

    def by_torch() -> np.ndarray:
        with torch.inference_mode():
            colours = (planes @ response).permute(2, 0, 1)
            return picked(colours.numpy(), camera)

    return runs | {f"PyTorch, {count} wavelengths": lambda: keep(f"PyTorch, {count} wavelengths", by_torch)}
