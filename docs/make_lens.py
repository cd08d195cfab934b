"""Draws docs/images/lens.png from the lens object: depth of field, cat's eyes, light towards the corner; cats_eyes.png from
frames of small lights taken with the same lens; and lens_numbers.png as `photosite lens --plot` does.

python docs/make_lens.py
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from simulator.atomic_files import atomic_write
from simulator.command_line.lens_figure import draw_lens
from simulator.exposure.settings import Exposure
from simulator.optics.lens.relative_illumination import plan_irradiance
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Aperture
from simulator.optics.pupil.vignetting import RoundStop, Vignetting
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera, IsoSetting, SpectralResponse

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

IMAGES = Path(__file__).resolve().parent / "images"
INK, SECOND, GRID = "#1f3b57", "#c0392b", "#d9dee3"
FULL_FRAME_MM = (36.0, 24.0)
RIMS = Vignetting(RoundStop(30.0, 44.0), RoundStop(20.0, 26.0))  # of a made-up 50 mm f/1.4
STOPS = (1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)


def main() -> None:
    """Write the picture."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained", dpi=90)
    _draw_depth_of_field(axes[0])
    _draw_cats_eyes(axes[1])
    _draw_relative_illumination(axes[2])
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    _write(figure, "lens.png")
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.4), layout="constrained", dpi=90)
    wide = ThinLens(50.0, 1.4, 0.5, vignetting=RIMS)
    _draw_highlights(axes[0], wide, 4.0, "f/1.4, lights behind the plane in focus")
    _draw_highlights(axes[1], wide, 0.3, "f/1.4, lights before it")
    _draw_highlights(
        axes[2], replace(wide, f_number=1.8, aperture=Aperture(6, 10.0)), 4.0, "f/1.8 with six blades, lights behind"
    )
    _write(figure, "cats_eyes.png")
    title = "50 mm f/1.8 focused at 2 m on 36 mm x 24 mm"
    figure = draw_lens(ThinLens(50.0, 1.8, 2.0), FULL_FRAME_MM, [1.0, 4.0, math.inf], title)
    figure.set_dpi(80)
    FigureCanvasAgg(figure)  # the canvas that `_write` draws on
    _write(figure, "lens_numbers.png")


def _write(figure: Figure, name: str) -> None:
    figure.canvas.draw()
    with atomic_write(IMAGES / name) as part:
        Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]).save(part, "PNG", optimize=True)


def _draw_highlights(axis: Axes, lens: ThinLens, depth_m: float, title: str) -> None:
    """Mean electrons of a sensor of 36 mm x 24 mm in front of which hangs a lattice of small lights."""
    width, height, wavelengths = 720, 480, np.arange(400.0, 701.0, 10.0)
    planes = np.full((height, width, 1), 0.02, np.float32)
    planes[40::80, 40::80] = 60.0
    lights = Scene(planes, 1e-3 * np.ones((1, 31)), wavelengths, np.ones(31), depth_m)
    response = SpectralResponse(wavelengths, np.ones((31, 1)))
    sensor = {"width_px": width, "height_px": height, "pixel_pitch_um": 50.0, "cfa": "MONO", "bit_depth": 16}
    camera = Camera(
        "Photosite", "sketch", **sensor, black_level_dn=0.0, response=response, iso_table={100: IsoSetting(1.0, 0.0)}
    )
    light = simulate(Shot(InMemory(lights), lens, Exposure(1e-6), camera)).mean_electrons
    axis.imshow((light / light.max()) ** (1 / 2.2), cmap="gray", extent=(-18, 18, 12, -12), interpolation="bilinear")
    axis.set_title(title, fontsize=10)
    axis.set_xlabel("place on the sensor [mm]")


@dataclass(frozen=True)
class InMemory:
    """A scene that is already there."""

    scene: Scene

    def load(self) -> Scene:
        """The scene itself."""
        return self.scene


def _draw_depth_of_field(axis: Axes) -> None:
    circle_um = ThinLens(50.0, 8.0).circle_um(math.hypot(*FULL_FRAME_MM))
    for distance_m, color in ((2.0, SECOND), (5.0, INK)):
        numbers = np.geomspace(STOPS[0], STOPS[-1], 400)
        limits = [ThinLens(50.0, number, distance_m).depth_of_field_m(circle_um) for number in numbers]
        near, far = np.minimum(np.transpose(limits), 1e3)
        axis.fill_between(numbers, near, far, color=color, alpha=0.35, linewidth=0, label=f"focused at {distance_m:g} m")
        axis.plot(STOPS, np.full(len(STOPS), distance_m), color=color, linewidth=1.0)
    axis.set(xscale="log", yscale="log", ylim=(1, 100), xlabel="f-number", ylabel="distance [m]")
    axis.set_xticks(STOPS, [f"{stop:g}" for stop in STOPS], fontsize=8)
    axis.set_xticks([], minor=True)
    axis.set_yticks([1, 2, 5, 10, 20, 50, 100], ["1", "2", "5", "10", "20", "50", "100"], fontsize=8)
    axis.grid(color=GRID, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.legend(frameon=False, fontsize=8, loc="upper left")
    axis.set_title(f"depth of field, 50 mm, C = {circle_um:.0f} µm", fontsize=10)


def _draw_cats_eyes(axis: Axes) -> None:
    """Spots of far lights at even places of the picture, drawn 1.5 mm large."""
    wide = ThinLens(50.0, 1.4, vignetting=RIMS)
    stopped = replace(wide, f_number=2.8, aperture=Aperture(7, 10.0))
    for lens, color, fill in ((wide, INK, 0.25), (stopped, SECOND, 0.6)):
        size_mm = 2.2 * lens.pupil_diameter_mm / wide.pupil_diameter_mm
        for x in np.linspace(-15.0, 15.0, 7):
            for y in np.linspace(-9.0, 9.0, 4):
                spot = np.array([x, y]) - size_mm * lens.pupil.outline((x / lens.image_distance_mm, y / lens.image_distance_mm))
                axis.fill(*spot.T, color=color, alpha=fill, linewidth=0)
    axis.set(xlim=(-18, 18), ylim=(12, -12), aspect="equal", xlabel="place on the sensor [mm]")
    axis.set_title("spots of far lights, f/1.4 and f/2.8", fontsize=10)


def _draw_relative_illumination(axis: Axes) -> None:
    heights_mm = np.linspace(0.0, 0.5 * math.hypot(*FULL_FRAME_MM), 200)
    wide = ThinLens(50.0, 1.4, vignetting=RIMS)
    lenses = {"cos⁴ alone": replace(wide, vignetting=None), "f/2.8": replace(wide, f_number=2.8), "f/1.4": wide}
    for (name, lens), color in zip(lenses.items(), ("#888888", SECOND, INK), strict=True):
        stage = plan_irradiance(lens, 10.0, 3600, 2400)
        axis.plot(
            heights_mm, [100 * stage.relative_illumination(100.0 * height) for height in heights_mm], color=color, label=name
        )
    axis.set(ylim=(0, 102), xlim=(0, heights_mm[-1]), xlabel="distance from the axis [mm]", ylabel="irradiance [%]")
    axis.grid(color=GRID, linewidth=0.6)
    axis.legend(frameon=False, fontsize=8, loc="lower left")
    axis.set_title("light towards the corner", fontsize=10)


if __name__ == "__main__":
    main()
