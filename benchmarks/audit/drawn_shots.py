"""Random shots: scene, lens, motion, exposure and camera are drawn from a seed and a number, as a shot file holds them."""

import math
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from audit.drawn_scenes import LIGHTS, SURFACES, Surface, draw_surfaces
from simulator import load_shot
from simulator.errors import PhotositeError
from simulator.optics.defocus.scene_light import peak_electrons
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan

Data = dict[str, Any]

CAMERAS = {  # each with an ISO that it has
    "canon_550d": 100,
    "canon_5d_mark_iv": 100,
    "imx385": 1600,
    "nikon_d3": 200,
    "nikon_d850": 100,
    "raspberry_pi_hq": 100,
    "sony_a7_iii": 100,
    "sony_a7s2": 100,
}
ABERRATIONS = ("spherical", "coma", "astigmatism", "lateral")
PHASES = "RGGB", "GBRG"  # few, as of widths
TOLERANCES = 0.03, 0.1, 0.3, 1.0
WEIGHED = "one", *(one for one in SURFACES if one != "photograph"), "layers"
SCALES = 0.5, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.7, 3.0, 4.0, 4.0, 8.0  # scene pixels per photosite
WIDTHS = 32, 33  # of a frame [photosites]; few, since a device compiles kernels for each
LEAST_E, MOST_E = 5.0, 50_000.0  # of the bright parts of the scene
NEAREST_M = 0.12
SHADED_FROM, SHADED_SHARE = 6200, 0.4  # first seed of which surfaces may be dark, so that shots of others stay what they are
REFUSED = 60  # drawings that the simulator may refuse before one that it takes


@dataclass(frozen=True)
class DrawnShot:
    """A shot that was drawn.

    document: its shot file. files: arrays of the files that it names. kinds: what was drawn, word by word.
    seed, number: which draw it is. refused: messages of what was drawn before and cannot be simulated.
    """

    seed: int
    number: int
    document: Data
    files: dict[str, np.ndarray]
    kinds: tuple[str, ...]
    refused: tuple[str, ...] = field(default=())

    @property
    def name(self) -> str:
        """Name of the shot and of its file."""
        return f"audit_{self.seed}_{self.number:03d}"

    def write(self, folder: Path, **settings: object) -> Path:
        """Write the shot file and its arrays into a folder, and return its path. settings: replace keys of the shot file."""
        folder.mkdir(parents=True, exist_ok=True)
        for name, array in self.files.items():
            np.save(folder / name, array)
        path = folder / f"{self.name}.yaml"
        told = f"# Drawn by benchmarks/audit: seed {self.seed}, number {self.number}: {', '.join(self.kinds)}\n"
        path.write_text(told + yaml.safe_dump({**self.document, **settings}, sort_keys=False), encoding="utf-8")
        return path


def draw_shot(seed: int, number: int) -> DrawnShot:
    """Draw a shot that the simulator takes; the same for the same seed and number."""
    rng = np.random.default_rng([seed, number])
    refused: list[str] = []
    while True:
        drawn = _draw(rng, seed, number)
        try:
            return _expose(rng, drawn, tuple(refused))
        except PhotositeError as error:
            refused.append(str(error))
            if len(refused) > REFUSED:
                raise


def _draw(rng: np.random.Generator, seed: int, number: int) -> DrawnShot:
    """Draw everything but the amount of light."""
    side_px = [int(rng.choice(WIDTHS)), int(rng.integers(32, 49))]
    camera, pitch_um = _draw_camera(rng, *side_px)
    lens, kinds = _draw_lens(rng, pitch_um, side_px[0])
    scale, light = float(rng.choice(SCALES)), str(rng.choice(LIGHTS))
    surface = "photograph" if light == "photograph" else str(rng.choice(WEIGHED))
    if "pinhole" in lens:
        surface = "one"
    if "fill factor" in kinds or rng.random() < 0.12:
        camera["fill_factor"] = float(rng.choice([0.5, 0.8]))
        kinds.append("fill factor")
    if rng.random() < 0.08:
        camera["low_pass"] = f"{pitch_um * rng.uniform(0.5, 1.0):.4g} um"
        kinds.append("low-pass")
    shape = round(side_px[1] * scale), round(side_px[0] * scale)
    surfaces = draw_surfaces(rng, surface, light, shape, scale)
    if seed >= SHADED_FROM and len(surfaces) > 1:
        surfaces = _shaded(np.random.default_rng([seed, number, 2]), surfaces, kinds)
    scene, files = _scene_of(rng, surfaces, lens, pitch_um, kinds)
    document: Data = {"name": f"audit_{seed}_{number:03d}", "scene": scene, "lens": lens, "camera": camera}
    time_s = 1.0 / round(10.0 ** rng.uniform(0.5, 3.0))
    document["exposure"] = {"time": f"1/{round(1.0 / time_s)} s"}
    if rng.random() < 0.3 and "pinhole" not in lens:
        _draw_motion(rng, document, len(surfaces), scale, pitch_um, side_px, time_s, kinds)
    document["tolerance"] = float(rng.choice(TOLERANCES))
    document["seeds"] = {"frame": number, "body": 1}
    return DrawnShot(seed, number, document, files, (surface, light, f"{scale:g} px", *kinds))


def _shaded(rng: np.random.Generator, surfaces: list[Surface], kinds: list[str]) -> list[Surface]:
    """Surfaces of which one that covers others is dark or black in some draws, as things before a bright sky are."""
    if rng.random() >= SHADED_SHARE:
        return surfaces
    dark = int(rng.integers(0, len(surfaces) - 1))
    share = 0.0 if rng.random() < 0.3 else float(10.0 ** rng.uniform(-4.0, -1.0))
    kinds.append("silhouette")
    light = np.float32(share) * np.minimum(surfaces[dark].light, 1.0)
    return [replace(one, light=light) if number == dark else one for number, one in enumerate(surfaces)]


def _draw_camera(rng: np.random.Generator, width_px: int, height_px: int) -> tuple[Data, float]:
    """A camera of the library or an ideal one, with so many photosites; and its pixel pitch [um]."""
    size = {"width": int(width_px), "height": int(height_px)}
    if rng.random() < 0.35:
        pitch_um = round(float(rng.uniform(1.5, 9.0)), 2)
        noise = {"before_gain": f"{rng.choice([0.0, 1.0, 4.0]):g} e-"}
        return {"base": "ideal", **size, "pixel_pitch": f"{pitch_um:g} um", "read_noise_model": noise}, pitch_um
    base = str(rng.choice(list(CAMERAS)))
    whole = load_shot("grey_ramp", {"camera": base, "exposure.iso": CAMERAS[base]}).camera
    return {"base": base, **size, "cfa": str(rng.choice(PHASES))}, whole.pixel_pitch_um


def _draw_lens(rng: np.random.Generator, pitch_um: float, width_px: int) -> tuple[Data, list[str]]:
    """A lens, and words for what it has beside focal length and f-number."""
    if rng.random() < 0.06:
        return {"pinhole": {"diameter": "0.1 mm", "distance": "20 mm", "diffraction": False}}, ["pinhole"]
    focal_mm, f_number = np.exp(rng.uniform(np.log([14.0, 1.2]), np.log([135.0, 22.0])))
    far = rng.random() < 0.15
    focus_m = math.inf if far else float(np.exp(rng.uniform(math.log(max(0.5, 0.012 * focal_mm)), math.log(10.0))))
    lens: Data = {
        "focal_length": f"{focal_mm:.4g} mm",
        "f_number": f"f/{f_number:.3g}",
        "focus_distance": "infinity" if far else f"{focus_m:.4g} m",
    }
    kinds: list[str] = []
    if rng.random() < 0.15:
        lens["aperture"] = {"blades": int(rng.integers(5, 10)), "rotation": f"{rng.uniform(0, 60):.3g} deg"}
        kinds.append("blades")
    if rng.random() < 0.10:
        radius_mm = 0.5 * focal_mm / f_number
        tangent = 0.5e-3 * pitch_um * width_px / focal_mm  # of the field angle at the frame's side
        distance_mm = float(min(10.0 ** rng.uniform(-1.7, -0.4) * radius_mm / tangent, 200.0))
        lens["vignetting"] = {"front": {"distance": f"{distance_mm:.4g} mm", "diameter": f"{2.02 * radius_mm:.4g} mm"}}
        kinds.append("rim")
    if rng.random() < 0.10:
        lens["distortion"] = {"k1": round(float(rng.uniform(-0.08, 0.08)), 4), "unit": "half_diagonal"}
        kinds.append("distortion")
    if rng.random() < 0.08:
        lens["veiling_glare"] = round(float(rng.uniform(0.005, 0.05)), 4)
        kinds.append("glare")
    chance = rng.random()
    if chance < 0.12:
        lens["diffraction"] = True
        kinds.append("diffraction")
    elif chance < 0.15:
        waves_um, kind = float(rng.uniform(0.1, 0.6)), str(rng.spawn(1)[0].choice(ABERRATIONS))
        lateral = [{"wavelength": "450 nm", "lateral": f"{20.0 * waves_um:.3g} um"}, {"wavelength": "550 nm"}]
        wave: Data = {"chromatic": lateral} if kind == "lateral" else {kind: f"{waves_um:.3g} um"}
        lens["aberrations"] = {**wave, "at_f_number": lens["f_number"]}
        kinds.append(f"aberrations: {kind}")
    elif chance < 0.19:
        lens["psf"] = "psf.npy"
        kinds.append("psf")
    return lens, kinds


def _scene_of(
    rng: np.random.Generator, surfaces: list[Surface], lens: Data, pitch_um: float, kinds: list[str]
) -> tuple[Data, dict[str, np.ndarray]]:
    """Section `scene` of a shot file without its luminance, and the arrays that it and the lens name."""
    files: dict[str, np.ndarray] = {}
    if lens.get("psf"):
        across = np.arange(-4, 5)
        kernel = np.exp(-0.5 * (across[:, None] ** 2 / rng.uniform(0.3, 2.0) ** 2 + across**2 / rng.uniform(0.3, 2.0) ** 2))
        files["psf.npy"] = kernel / kernel.sum()

    def depth_of(number: int, radius_px: float | np.ndarray) -> str | Data:
        depth_m = distances(lens, pitch_um, radius_px)
        if depth_m.ndim == 0:
            return "infinity" if np.isinf(depth_m) else f"{depth_m:.9g} m"
        files[f"depth_{number}.npy"] = depth_m.astype(np.float32)
        return {"image": f"depth_{number}.npy", "unit": "m"}

    if len(surfaces) > 1:
        layers = []
        for number, surface in enumerate(surfaces):
            files[f"light_{number}.npy"] = surface.light
            layer: Data = {"image": f"light_{number}.npy", "depth": depth_of(number, surface.radius_px)}
            if surface.coverage is not None:
                files[f"alpha_{number}.npy"] = surface.coverage
                layer["alpha_image"] = f"alpha_{number}.npy"
            layers.append(layer)
        return {"layers": layers}, files
    only = surfaces[0]
    depth = {} if "pinhole" in lens else {"depth": depth_of(0, only.radius_px)}
    if depth and np.ndim(only.radius_px) and rng.random() < 0.3:
        depth["hidden"] = "extend"
        kinds.append("extend")
    if rng.random() < 0.12:
        wavelengths_nm = np.arange(400.0, 701.0, 20.0)
        bumps = np.exp(-0.5 * ((wavelengths_nm - np.array([[610.0], [540.0], [450.0]])) / 45.0) ** 2)
        files["cube.npy"] = (only.light @ bumps).astype(np.float32)
        files["wavelengths.npy"] = wavelengths_nm
        kinds.append("cube")
        return {"spectral_cube": "cube.npy", "wavelengths": "wavelengths.npy", "quantity": "radiance", **depth}, files
    files["light_0.npy"] = only.light
    return {"image": "light_0.npy", **depth}, files


def distances(lens: Data, pitch_um: float, radius_px: float | np.ndarray) -> np.ndarray:
    """Distances at which a lens blurs by these signed radii [m], from NEAREST_M to 10 km where it cannot reach them."""
    ideal = _thin(lens)
    per_dioptre = float(ideal.blur_radius_um(np.inf) - ideal.blur_radius_um(1.0)) / pitch_um
    inverse = 1.0 / ideal.focus_distance_m - np.asarray(radius_px, np.float64) / per_dioptre
    return 1.0 / np.clip(inverse, 1e-4, 1.0 / max(NEAREST_M, 2e-3 * ideal.focal_length_mm))


def _thin(lens: Data) -> ThinLens:
    """The ideal lens of a section `lens`."""
    focus = lens["focus_distance"]
    focal_mm, f_number = float(lens["focal_length"].split()[0]), float(lens["f_number"][2:])
    return ThinLens(focal_mm, f_number, focus_distance_m=math.inf if focus == "infinity" else float(focus.split()[0]))


def _draw_motion(
    rng: np.random.Generator,
    document: Data,
    layers: int,
    scale: float,
    pitch_um: float,
    side_px: list[int],
    time_s: float,
    kinds: list[str],
) -> None:
    """Add a path of the camera, of a layer or of both to a document, and sometimes a rolling shutter."""
    lens, way_px = document["lens"], float(np.exp(rng.uniform(math.log(0.05), math.log(20.0))))
    image_px = 1e3 * _thin(lens).image_distance_mm / pitch_um
    moves = ["pan", "roll", "layer", "spin", "right", "clip"]
    kind = str(rng.choice(moves))
    angle = rng.uniform(0.0, 2.0 * math.pi)
    across, down = way_px * math.cos(angle), way_px * math.sin(angle)
    motion: Data = {}
    if kind == "pan":
        pan, tilt = (math.degrees(math.atan(part / image_px)) / time_s for part in (across, down))
        motion["camera"] = {"pan": f"{pan:.5g} deg/s", "tilt": f"{tilt:.5g} deg/s"}
    elif kind == "roll":
        motion["camera"] = {"roll": f"{math.degrees(way_px / (0.5 * math.hypot(*side_px))) / time_s:.5g} deg/s"}
    elif kind == "right":
        nearest_m = float(rng.uniform(0.5, 3.0))
        motion["camera"] = {"right": f"{across * nearest_m / image_px / time_s:.5g} m/s"}
    elif kind == "clip":
        rms = math.degrees(math.atan(way_px / image_px)) / time_s
        motion["camera"] = {"clip": "investigation", "seed": int(rng.integers(0, 50)), "rms": f"{rms:.5g} deg/s"}
    else:
        chosen = int(rng.integers(0, layers))
        speed = [f"{scale * part / time_s:.6g} px/s" for part in (across, down)]
        spin = math.degrees(way_px / (0.3 * min(side_px))) / time_s
        motion["layers"] = {chosen: {"velocity": speed} if kind == "layer" else {"spin": f"{spin:.5g} deg/s"}}
    document["motion"] = motion
    kinds.append(f"moves: {kind}")
    if rng.random() < 0.3:
        document["exposure"]["shutter"] = {"readout_time": f"{time_s * rng.uniform(0.2, 4.0):.4g} s"}
        kinds.append("rolling")
    lamps = rng.spawn(1)[0]  # a stream of its own, so that what else a seed draws stays
    if lamps.random() < 0.15:
        frequency = f"{np.exp(lamps.uniform(math.log(0.5), math.log(50.0))) / time_s:.4g} Hz"
        pulsed = {"duty": round(float(lamps.uniform(0.1, 0.9)), 2)}
        waves = {"modulation": round(float(lamps.uniform(0.1, 1.0)), 2)}
        document["exposure"]["flicker"] = {"frequency": frequency, **(pulsed if lamps.random() < 0.5 else waves)}
        kinds.append("flicker")


def _expose(rng: np.random.Generator, drawn: DrawnShot, refused: tuple[str, ...]) -> DrawnShot:
    """Return the shot with an ISO and a luminance. Raises PhotositeError for what the simulator refuses."""
    bright_e, level = math.exp(rng.uniform(math.log(LEAST_E), math.log(MOST_E))), rng.random()
    has_flash = rng.random() < 0.05
    document = drawn.document
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        document["scene"]["luminance"] = "1 cd/m^2"
        some_iso = CAMERAS.get(document["camera"]["base"], 100)
        isos = load_shot("grey_ramp", {"camera": document["camera"], "exposure.iso": some_iso}).camera.isos
        document["exposure"]["iso"] = int(isos[min(int(level**2 * len(isos)), len(isos) - 1)])
        probe = load_shot(drawn.write(Path(folder)), {"tolerance": 1})
        planned = plan(probe)
    optics, accuracy = planned.optics, planned.optics.accuracy
    full_e = saturation_electrons(planned.sensor)
    planes = [layer.planes.reshape(-1, layer.planes.shape[-1]) @ optics.weights for layer in optics.scene.layers]
    per_cd_m2 = accuracy.electrons_per_radiance * max(float(np.quantile(light, 0.98)) for light in planes)
    if per_cd_m2 == 0.0:  # nothing but lamps
        per_cd_m2 = peak_electrons(optics.scene, optics.weights, accuracy.electrons_per_radiance) / 1e4
    luminance = min(bright_e, 0.9 * full_e) / per_cd_m2
    document["scene"]["luminance"] = f"{luminance:.6g} cd/m^2"
    kinds = drawn.kinds
    if has_flash and "depth" in document["scene"] and "cube" not in kinds:
        guide = math.sqrt(luminance * math.pi * probe.exposure.time_s * 100.0 / 250.0)
        document["exposure"]["flash"] = {"guide_number": f"{guide:.4g} m", "length": "1/5000 s"}
        kinds = (*kinds, "flash")
    final = DrawnShot(drawn.seed, drawn.number, document, drawn.files, kinds, refused)
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        for tolerance in (document["tolerance"], 0):
            plan(load_shot(final.write(Path(folder)), {"tolerance": tolerance}))
    return final


def saturation_electrons(sensor: Any) -> float:
    """Photoelectrons of a photosite whose mean code is the white level [e-]."""
    dark = sensor.moments(0.0).mean
    return float((sensor.white_level_dn() - dark) / sensor.gain_dn_per_e())
