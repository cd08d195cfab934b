"""Cat's eyes: error of the zones in units of the noise, and time with rims beside that without.

The lens is the 50 mm f/1.4 of docs/lens.md with its two rims, before a full-frame sensor of 4240 x 2832 photosites. Truth: each
photosite's mean over its own pupil in float64, in the middle and at the border of a zone near a corner. Edges run in 24
directions and nine distances through the spot, from 0.02 to 1; a texture is independent from photosite to photosite.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring.record import Record
from measuring.run import Run

from simulator import load_shot
from simulator.device import open_device
from simulator.optics.defocus.clipped_kernel import shape_weights
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.field_pupil import CatsEyes, plan_cats_eyes
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "grey_ramp.yaml"
LENS = ThinLens(50.0, 1.4, 2.0, vignetting=Vignetting(RoundStop(30.0, 44.0), RoundStop(20.0, 26.0)), cos4=False)
SENSOR_PX, PITCH_UM = (4240, 2832), 8.4
CORNER_PX = (3800, 2500)
READ_NOISE_E = 2.0


def scenes(radius_px: float, side: int) -> dict[str, np.ndarray]:
    """What lies around a photosite: edges and textures, (n, side, side) each."""
    y, x = np.mgrid[:side, :side] - side // 2
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    edges = [
        np.where(x * np.cos(angle) + y * np.sin(angle) > place * radius_px, 1.0, 0.02)
        for angle in angles
        for place in np.linspace(-1.0, 1.0, 9)
    ]
    return {"edges": np.array(edges), "texture": np.random.default_rng(5).random((60, side, side))}


def zone_error(radius_px: float, zone_px: int) -> list[dict]:
    """Deviation [sigma] of the mean of four corners, and of one pupil for the whole zone, from each photosite's own."""
    eyes = replace(CatsEyes(LENS.pupil, 1e-3 * PITCH_UM / LENS.image_distance_mm, *SENSOR_PX), zone_px=zone_px)
    first = np.array([zone_px * (place // zone_px) for place in CORNER_PX])
    steps = np.arange(0, zone_px, max(zone_px // 16, 1))
    x, y = (part.ravel() for part in np.meshgrid(steps, [0, zone_px // 2]))

    def weights(places: np.ndarray) -> np.ndarray:
        return shape_weights(LENS.pupil, eyes.fields(*(first[:, None] + places)), np.full(places.shape[1], radius_px))

    own = weights(np.stack([x, y]) + 0.5)
    corners = weights(zone_px * np.array([[0, 1, 0, 1], [0, 0, 1, 1]]))
    right, down = (x + 0.5) / zone_px, (y + 0.5) / zone_px
    shares = np.stack([(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right], axis=1)
    found = {"four corners": np.einsum("nk,kij->nij", shares, corners), "one pupil": weights(np.full((2, 1), 0.5 * zone_px))}
    rows = []
    for scene, around in scenes(radius_px, own.shape[1]).items():
        truth = np.einsum("nij,sij->ns", own, around)
        for method, images in found.items():
            error = np.einsum("nij,sij->ns", images, around) - truth
            z = {e: np.abs(e * error / np.sqrt(e * truth + READ_NOISE_E**2)) for e in (2000, 20000)}
            numbers = {f"{name}_{e}": cut(z[e]) for e in z for name, cut in (("p99", _p99), ("max", np.max))}
            rows.append({"radius_px": radius_px, "zone_px": zone_px, "scene": scene, "method": method} | numbers)
    return rows


def _p99(values: np.ndarray) -> float:
    return float(np.quantile(values, 0.99))


def runs_of(radius_px: float) -> tuple[dict[str, Callable[[], object]], int]:
    """The blur of one distance without rims and with them, by name, and the side of a zone [photosites]."""
    device, sharp = open_device(), plan(load_shot(SHOT, {"camera": "sony_a7s2"}))
    eyes = plan_cats_eyes(LENS, PITCH_UM, SENSOR_PX, radius_px)
    assert eyes is not None  # the rims hide something

    def blur(own: CatsEyes | None) -> None:
        defocus = Defocus((radius_px,), True, sharp.optics.projection.scale, eyes=own)
        expose(measure(replace(sharp, optics=replace(sharp.optics, defocus=defocus)), device), device)
        device.finish()

    return {"without rims": lambda: blur(None), "with rims": lambda: blur(eyes)}, eyes.zone_px


TEXT = """\
Deviation from each photosite's own pupil, 50 mm f/1.4 with two rims on 4240 x 2832 photosites, near a corner, in units of the
noise; and the processor time of the blur of one distance, without rims and with them.
"""


def measure_cats_eyes(run: Run) -> Record:
    """Errors of zones, and times."""
    columns = {"case": ["blur", ""], "name": ["method", ""], "p99_2000": ["p99, 2,000 e⁻", ".2f"]}
    columns |= {"max_2000": ["worst", ".2f"], "p99_20000": ["p99, 20,000 e⁻", ".2f"], "max_20000": ["worst", ".2f"]}
    columns["cpu_s"] = ["processor time [s]", ".2f"]
    record = Record("cats_eyes", "Cat's eyes", TEXT, columns=columns)
    for radius in run.pick((4.0,), (16.0,), (4.0, 16.0)):
        for zone in run.pick((64,), (128, 64, 32), (128, 64, 32)):
            for row in zone_error(radius, zone):
                name = f"zone of {zone} px, {row['scene']}, {row['method']}"
                numbers = {key: value for key, value in row.items() if key.startswith(("p99", "max"))}
                record.add(f"R = {radius:g} px", name, {}, **numbers)
    for radius in run.pick((4.0,), (16.0,), (4.0, 16.0, 32.0)):
        runs, zone = runs_of(radius)
        for name, timing in run.turns(f"R = {radius:g} px", runs).items():
            record.add(f"R = {radius:g} px", f"Photosite, {name}, zones of {zone} px", timing)
    return record
