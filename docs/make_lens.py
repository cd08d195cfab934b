"""Draws docs/images/lens.png from the lens object: depth of field, cat's eyes, light towards the corner.

python docs/make_lens.py
"""

import math
from dataclasses import replace
from pathlib import Path

import matplotlib
import numpy as np
from PIL import Image

from simulator.lens import Aperture, Irradiance, RoundStop, ThinLens, Vignetting
from simulator.raw.files import atomic_write

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

PICTURE = Path(__file__).resolve().parent / "images" / "lens.png"
INK, SECOND, GRID = "#1f3b57", "#c0392b", "#d9dee3"
FULL_FRAME_MM = (36.0, 24.0)
RIMS = Vignetting(RoundStop(30.0, 44.0), RoundStop(20.0, 26.0))  # of a made-up 50 mm f/1.4
STOPS = (1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0)


def main() -> None:
    """Write the picture."""
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained", dpi=90)
    _depth_of_field(axes[0])
    _cats_eyes(axes[1])
    _fall_off(axes[2])
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
    figure.canvas.draw()
    with atomic_write(PICTURE) as part:
        Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]).save(part, "PNG", optimize=True)


def _depth_of_field(axis) -> None:
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


def _cats_eyes(axis) -> None:
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


def _fall_off(axis) -> None:
    heights_mm = np.linspace(0.0, 0.5 * math.hypot(*FULL_FRAME_MM), 200)
    wide = ThinLens(50.0, 1.4, vignetting=RIMS)
    lenses = {"cos⁴ alone": replace(wide, vignetting=None), "f/2.8": replace(wide, f_number=2.8), "f/1.4": wide}
    for (name, lens), color in zip(lenses.items(), ("#888888", SECOND, INK), strict=True):
        stage = Irradiance.behind(lens, 10.0, 3600, 2400)
        axis.plot(heights_mm, [100 * stage.fall_off(100.0 * height) for height in heights_mm], color=color, label=name)
    axis.set(ylim=(0, 102), xlim=(0, heights_mm[-1]), xlabel="distance from the axis [mm]", ylabel="irradiance [%]")
    axis.grid(color=GRID, linewidth=0.6)
    axis.legend(frameon=False, fontsize=8, loc="lower left")
    axis.set_title("light towards the corner", fontsize=10)


if __name__ == "__main__":
    main()
