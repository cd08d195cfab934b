"""Takes the pictures of docs/stages and docs/effects: each page's example beside the same shot without what the page is about.

python docs/make_effects.py [PAGE ...] [--out docs/images]   # PAGE such as stages/prnu

The first block of YAML on a page is the shot of its right picture; what it leaves out stands in SHOT below, or in PICTURES.
"""

import argparse
import re
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from data_gen.sources.gallery_scenes import write_topic
from simulator import PhotositeError
from simulator.atomic_files import atomic_write
from simulator.config import load_shot
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.raw.raw_image import Raw

DOCS = Path(__file__).resolve().parent
SHOT = {  # sections of a shot that a page does not state
    "scene": "scene: {chart: color_checker, luminance: 120 cd/m^2, illuminant: D55, depth: 2 m}",
    "lens": "lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}",
    "exposure": "exposure: {time: 1/2000 s, iso: 100}",
    "camera": "camera: sony_a7s2",
}
SCENES = {  # by name: the scene's section, and the topic of the gallery that draws it
    "portrait": ("{image: print.exr, luminance: 120 cd/m^2, illuminant: D55, depth: 2 m}", "spherical_aberration"),
    "lights": ("{image: lights.npy, encoding: linear, luminance: 120 cd/m^2, illuminant: D55, depth: 4 m}", ""),
    "grid": ("{image: grid.npy, encoding: linear, luminance: 120 cd/m^2, illuminant: D55, depth: 2 m}", ""),
    "star": ("{chart: siemens_star, width: 1280, luminance: 120 cd/m^2, illuminant: D55, depth: 2 m}", ""),
    "rings": ("{chart: zone_plate, frequency: 320, width: 1920, luminance: 120 cd/m^2, illuminant: D55, depth: 2 m}", ""),
    "yard": (
        "{luminance: 300 cd/m^2, illuminant: D65, layers: ["
        + ", ".join(
            f"{{image: yard_50_{name}.exr, depth: {{channel: Z, unit: m}}}}" for name in ("subject", "cat", "cup", "wall")
        )
        + "]}",
        "aperture_series",
    ),
    "room": (
        "{image: motorcycle.exr, depth: {channel: Z, unit: m}, hidden: extend, field_of_view: 40.85 deg, luminance: 6 cd/m^2}",
        "flash",
    ),
    "fan": (
        "{layers: [{image: fan_blades.exr, depth: 3 m}, {image: fan_wall.exr, depth: 3 m}], luminance: 4800 cd/m^2}",
        "fan",
    ),
    "ball": (
        "{layers: [{image: ball_ball.exr, depth: 5 m}, {image: ball_wall.exr, depth: 5 m}], luminance: 4800 cd/m^2}",
        "ball",
    ),
}
SMALL = {"camera.width": 240, "camera.height": 160}
FRAME = {  # a whole sensor of 35.6 mm x 23.7 mm with few, large photosites, whose noise is not seen
    "camera.width": 480,
    "camera.height": 320,
    "camera.pixel_pitch": "74.2 um",
}
FINE = {"camera.width": 480, "camera.height": 320}
FAST = {  # as many photosites as the scene has pixels
    "camera.width": 1200,
    "camera.height": 800,
    "exposure.time": "1/2000 s",
}
GREY = {"lens.nd_filter": {"factor": 64}}  # as much less light as the photosites of FRAME gather more
SHARP = {"focal_length": "50 mm", "f_number": "f/4", "focus_distance": "2 m"}
NIGHT = {"scene.luminance": "0.0025 cd/m^2"}
Settings = Mapping[str, object]


@dataclass(frozen=True)
class Picture:
    """What a page shows. scene: of SCENES. settings: of both pictures; off: of the left one besides, None takes a key away.

    white: signal that is shown white, left and right, as a share of what is brightest on the left; kind: `developed`, or
    `mosaic` of the single photosites in their colours. part: left, top, width and height that is shown [px].
    """

    scene: str
    off: Settings
    settings: Settings = field(default_factory=dict)
    kind: str = "developed"
    part: tuple[int, int, int, int] | None = None
    same_light: bool = False  # each picture is shown with its own brightest light white
    dodge: float = 1.0  # how much brighter than that both are shown


def _stage(stem: str, time: str, scene: str = "portrait", **more: object) -> Picture:
    off = {f"camera.stages.{stem}": None}
    return Picture(scene, off, {**SMALL, "exposure.time": time}, **more)  # type: ignore[arg-type]


PICTURES = {
    "stages/irradiance": Picture("portrait", {"lens.f_number": "f/2.8"}, {**SMALL, "exposure.time": "1/500 s"}),
    "stages/exposure": Picture("portrait", {"exposure.time": "1/8000 s"}, SMALL, dodge=0.25),
    "stages/prnu": _stage("prnu", "1/160 s"),
    "stages/photon_shot_noise": _stage("photon_shot_noise", "1/32000 s"),
    "stages/dead_pixels": _stage("dead_pixels", "1/160 s"),
    "stages/dark_current": Picture("portrait", {"camera.stages.dark_current": None}, {**SMALL, **NIGHT}),
    "stages/hot_pixels": Picture("portrait", {"camera.stages.hot_pixels": None}, {**SMALL, **NIGHT}),
    "stages/full_well": _stage("full_well", "1/50 s"),
    "stages/dsnu": _stage("dsnu", "1/25000 s"),
    "stages/conversion_gain": Picture("portrait", {"camera.conversion_gain": None}, SMALL),
    "stages/read_noise_before_gain": Picture(
        "portrait", {"camera.read_noise_model.before_gain": "0 e-"}, {**SMALL, "exposure.time": "1/25000 s"}
    ),
    "stages/random_telegraph_noise": _stage("random_telegraph_noise", "1/25000 s"),
    "stages/analog_gain": Picture("portrait", {"exposure.iso": 100}, SMALL, dodge=0.2),
    "stages/column_offset": _stage("column_offset", "1/25000 s"),
    "stages/row_noise": _stage("row_noise", "1/25000 s"),
    "stages/banding": _stage("banding", "1/25000 s"),
    "stages/read_noise_after_gain": Picture(
        "portrait",
        {"camera.iso_table": {100: {"gain": "1 DN/e-", "read_noise": "0 DN"}}},
        {**SMALL, "exposure.time": "1/25000 s"},
    ),
    "stages/color_bias": Picture(
        "portrait",
        {"camera.iso_table": {100: {"gain": "0.0956 DN/e-", "read_noise": "1 DN"}}},
        {**SMALL, "exposure.time": "1/600 s"},
    ),
    "stages/nonlinearity": _stage("nonlinearity", "1/40 s"),
    "stages/adc": Picture(
        "portrait",
        {"camera.bit_depth": 16, "camera.read_noise_model.gain_at_iso_100": "1 DN/e-"},
        {**SMALL, "exposure.time": "1/800 s"},
        same_light=True,
    ),
    "stages/digital_gain": _stage("digital_gain", "1/800 s", dodge=0.5),
    "stages/crosstalk": Picture("portrait", {"camera.crosstalk": None}, {**SMALL, "exposure.time": "1/15 s"}),
    "stages/blooming": Picture(
        "lights", {"camera.blooming": None}, {**SMALL, "exposure.time": "1/2 s", "lens.focus_distance": "4 m"}
    ),
    "stages/binning": Picture("portrait", {"camera.binning": None}, {**SMALL, "exposure.time": "1/32000 s"}, same_light=True),
    "stages/color_filter_patterns": Picture(
        "portrait", {"camera.cfa": "RGGB"}, {**SMALL, "exposure.time": "1/15 s"}, kind="mosaic", part=(130, 20, 36, 24)
    ),
    "stages/hdr_readout": Picture(
        "portrait", {"camera.hdr_readout": None}, {**SMALL, "exposure.time": "1/25 s"}, same_light=True
    ),
    "effects/defocus": Picture(
        "yard",
        {"lens.f_number": "f/22", "exposure.time": "1/80 s"},
        {**FRAME, "exposure.time": "1/20000 s"},
        part=(20, 30, 240, 160),
    ),
    "effects/occlusion": Picture(
        "yard",
        {"lens.f_number": "f/22", "exposure.time": "1/80 s"},
        {**FRAME, "exposure.time": "1/20000 s"},
        part=(150, 30, 240, 160),
    ),
    "effects/pupil_blades": Picture("lights", {"lens.aperture": None}, FRAME),
    "effects/mechanical_vignetting": Picture("lights", {"lens.vignetting": None}, FRAME),
    "effects/natural_vignetting": Picture("portrait", {"lens.cos4": False}, FRAME),
    "effects/pinhole": Picture(
        "portrait", {"lens": SHARP, "exposure.time": "1/1500 s"}, FRAME, same_light=True, part=(150, 20, 240, 160)
    ),
    "effects/bare_sensor": Picture("portrait", {"lens": SHARP, "exposure.time": "1/1500 s"}, FRAME, same_light=True),
    "effects/diffraction": Picture(
        "star", {"lens.diffraction": False}, {**FINE, "camera.pixel_pitch": "4 um", "exposure.time": "1/8 s"}
    ),
    "effects/spherical_aberration": Picture("portrait", {"lens.aberrations": None}, FRAME, part=(150, 20, 240, 160)),
    "effects/coma": Picture(
        "lights", {"lens.aberrations": None}, {**SMALL, "exposure.time": "1/15 s"}, part=(120, 80, 120, 80), same_light=True
    ),
    "effects/astigmatism": Picture(
        "lights", {"lens.aberrations": None}, {**SMALL, "exposure.time": "1/15 s"}, part=(120, 80, 120, 80), same_light=True
    ),
    "effects/chromatic_aberration": Picture(
        "grid", {"lens.aberrations": None}, {**FINE, "exposure.time": "1/15 s"}, part=(300, 200, 180, 120)
    ),
    "effects/distortion": Picture("grid", {"lens.distortion": None}, FRAME),
    "effects/veiling_glare": Picture("portrait", {"lens.veiling_glare": 0}, FRAME),
    "effects/low_pass_filter": Picture("rings", {"camera.low_pass": "0 um"}, {**FINE, "exposure.time": "1/15 s"}),
    "effects/fill_factor": Picture("rings", {"camera.fill_factor": 1}, {**FINE, "exposure.time": "1/15 s"}, same_light=True),
    "effects/psf_file": Picture("lights", {"lens.psf": None}, FRAME),
    "effects/rolling_shutter": Picture("fan", {"exposure.shutter.readout_time": "0 s"}, {**FAST, "lens.focus_distance": "3 m"}),
    "effects/curtain_shutter": Picture(
        "portrait", {"exposure.time": "1/125 s"}, {**FRAME, **GREY, "scene.luminance": "1 cd/m^2"}
    ),
    "effects/electronic_first_curtain": Picture(
        "portrait", {"exposure.shutter": {"travel_time": "3 ms", "acceleration": "800 m/s^2"}}, FRAME
    ),
    "effects/leaf_shutter": Picture("portrait", {"exposure.shutter": None}, {**FRAME, "scene.luminance": "40 cd/m^2"}),
    "effects/parasitic_light": Picture("portrait", {"exposure.shutter.parasitic_light": 0}, FRAME),
    "effects/flicker": Picture("portrait", {"exposure.flicker": None}, FRAME),
    "effects/flash": Picture("room", {"exposure.flash": None}, {**FRAME, **GREY}, dodge=0.006),
    "effects/camera_motion": Picture(
        "portrait", {"motion": None}, {**FRAME, "scene.luminance": "2.5 cd/m^2"}, part=(150, 20, 240, 160)
    ),
    "effects/object_motion": Picture(
        "ball", {"exposure.time": "1/2000 s", "lens.f_number": "f/2"}, {"camera.width": 1200, "camera.height": 800}
    ),
    "effects/motion_vectors": Picture("portrait", {"motion": None}, {**FRAME, "scene.luminance": "1.2 cd/m^2"}),
    "effects/metering": Picture(
        "room", {"exposure": {"time": "1/500 s", "iso": 100}}, {**FRAME, "scene.hidden": None}, dodge=0.2
    ),
}


def example(page: str) -> str:
    """Return the first block of YAML on a page, such as `stages/prnu`."""
    text = (DOCS / f"{page}.md").read_text(encoding="utf-8")
    found = re.search(r"^```yaml\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise PhotositeError("give the page an example in YAML", file=DOCS / f"{page}.md")
    return found[1]


def shot_text(block: str, **others: str) -> str:
    """Return the text of a whole shot file: a block of YAML, and each section that it leaves out, as in SHOT or `others`."""
    sections = {**SHOT, **others}
    return "\n".join([*(text for key, text in sections.items() if not re.search(rf"^{key}:", block, re.MULTILINE)), block])


def write_files(folder: Path) -> None:
    """Write what examples read besides scenes: a point spread function, and a velocity for each pixel of the portrait."""
    y, x = np.mgrid[-16:17, -16:17]
    spikes = np.exp(-0.25 * np.minimum(abs(x), abs(y)) ** 2) * np.exp(-0.15 * np.hypot(x, y))
    np.save(folder / "star.npy", (spikes / spikes.sum()).astype(np.float32))
    rows, columns = np.mgrid[:342, :512]
    np.save(folder / "swirl.npy", np.dstack([-(rows - 171.0), columns - 256.0]).astype(np.float32))


def write_scene(name: str, folder: Path) -> None:
    """Write the pictures that a scene of SCENES is made of."""
    if topic := SCENES[name][1]:
        write_topic(topic, folder)
    y, x = np.mgrid[:640, :960]
    is_lit = (x % 80 // 6 == 6) & (y % 80 // 6 == 6)
    lights = np.where(is_lit, 6.0, 1e-4).astype(np.float32)
    np.save(folder / "lights.npy", lights)
    np.save(folder / "grid.npy", np.where((x % 60 < 4) | (y % 60 < 4), 0.05, 0.8).astype(np.float32))


def take(page: str, folder: Path) -> tuple[Raw, Raw]:
    """Return the frames of a page without and with its example. folder: for the files of the scene."""
    picture = PICTURES[page]
    write_files(folder)
    write_scene(picture.scene, folder)
    file = folder / "shot.yaml"
    others = {"scene": f"scene: {SCENES[picture.scene][0]}"}
    if page.startswith("stages/"):
        others["camera"] = "camera: ideal"
    file.write_text(shot_text(example(page), **others), encoding="utf-8")
    shots = [_load(file, {**picture.settings, **more}) for more in (picture.off, {})]
    return simulate(shots[0]), simulate(shots[1])


def _load(file: Path, settings: Settings) -> Shot:
    return load_shot(file, dict(settings))


def draw(page: str, frames: tuple[Raw, Raw]) -> np.ndarray:
    """Return both frames side by side, (height, width, 3) uint8."""
    picture = PICTURES[page]
    light = [_linear(raw, picture) for raw in frames]
    brightest = [float(np.quantile(one, 0.995)) / picture.dodge for one in light]
    white = brightest if picture.same_light else [brightest[0]] * 2
    panels = [_encode(one / level) for one, level in zip(light, white, strict=True)]
    height = max(panel.shape[0] for panel in panels)
    panels = [_resize(panel, max(height, 320) // panel.shape[0]) for panel in panels]
    gap = np.full((panels[0].shape[0], 8, 3), 255, np.uint8)
    return np.concatenate([panels[0], gap, panels[1]], axis=1)


def _linear(raw: Raw, picture: Picture) -> np.ndarray:
    """Return a frame as linear sRGB, (height, width, 3), 0 where it is black."""
    left, top, width, height = picture.part or (0, 0, raw.dn.shape[1], raw.dn.shape[0])
    part = np.s_[top : top + height, left : left + width]
    if raw.cfa != "MONO" and picture.kind == "developed":
        return develop(raw, output="linear_srgb")[part].astype(float)
    signal = np.maximum(raw.dn[part] - np.asarray(raw.black_level_dn).mean(), 0.0)
    if raw.cfa == "MONO":
        return np.dstack([signal] * 3)
    rows = raw.cfa.split("/") if "/" in raw.cfa else [raw.cfa[:2], raw.cfa[2:]]
    y, x = np.mgrid[top : top + height, left : left + width]
    letters = np.array([list(row) for row in rows])[y % len(rows), x % len(rows[0])]
    return np.dstack([signal * (letters == letter) for letter in "RGB"])


def _encode(linear: np.ndarray) -> np.ndarray:
    """Return codes of sRGB (IEC 61966-2-1)."""
    light = np.clip(linear, 0.0, 1.0)
    return np.rint(255 * np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)).astype(np.uint8)


def _resize(panel: np.ndarray, times: int) -> np.ndarray:
    """Return a panel so many times as large, and one of more than 640 rows half as large."""
    if panel.shape[0] > 640:
        rows, columns = panel.shape[0] // 2, panel.shape[1] // 2
        halves = panel[: 2 * rows, : 2 * columns].reshape(rows, 2, columns, 2, 3)
        return np.rint(halves.mean(axis=(1, 3), dtype=float)).astype(np.uint8)
    return panel.repeat(times, axis=0).repeat(times, axis=1)


def write(picture: np.ndarray, path: Path) -> None:
    """Write a JPEG."""
    from PIL import Image  # noqa: PLC0415  # comes with matplotlib: tests read PICTURES without it

    with atomic_write(path) as part:
        Image.fromarray(picture).save(part, "JPEG", quality=70, optimize=True, progressive=True)


def write_sheet(folder: Path) -> None:
    """Write the pictures of a folder as one, small and with their names, beside the folder as a JPEG of its name."""
    from PIL import Image, ImageDraw  # noqa: PLC0415  # as above

    names = [name for name in PICTURES if name.startswith(f"{folder.name}/")]
    width, height, columns = 316, 106, 3
    sheet = Image.new("RGB", (columns * (width + 8) - 8, -(-len(names) // columns) * (height + 20)), "white")
    pen = ImageDraw.Draw(sheet)
    for number, name in enumerate(names):
        left, top = number % columns * (width + 8), number // columns * (height + 20)
        with Image.open(folder.parent / f"{name}.jpg") as picture:
            sheet.paste(picture.resize((width, height)), (left, top + 14))
        pen.text((left, top), name.partition("/")[2].replace("_", " "), fill="black")
    write(np.asarray(sheet), folder.with_suffix(".jpg"))


def main() -> int:
    """Write one picture for each page; returns the exit status."""
    parser = argparse.ArgumentParser(description="Take the pictures of docs/stages and docs/effects.")
    parser.add_argument("pages", nargs="*", metavar="PAGE", help="Such as stages/prnu; all when left out.")
    parser.add_argument("--out", type=Path, default=DOCS / "images", help="Folder of the folders stages and effects.")
    options = parser.parse_args()
    names = options.pages or list(PICTURES)
    if unknown := [name for name in names if name not in PICTURES]:
        parser.error(f"no page {', '.join(unknown)}; give some of {', '.join(PICTURES)}")
    start = time.monotonic()
    try:
        for number, name in enumerate(names):
            path = options.out / f"{name}.jpg"
            path.parent.mkdir(parents=True, exist_ok=True)
            with TemporaryDirectory() as folder:
                write(draw(name, take(name, Path(folder))), path)
            print(f"{number + 1}/{len(names)} {path}, {time.monotonic() - start:.0f} s", flush=True)
        if not options.pages:
            for folder in ("stages", "effects"):
                write_sheet(options.out / folder)
    except PhotositeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
