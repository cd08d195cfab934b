"""Draws docs/images/time.png: frames under a lamp and a flash by three shutters, and what rows measure beside the closed forms.

python docs/make_time.py
"""

from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from PIL import Image

from simulator.atomic_files import atomic_write
from simulator.config import load_camera
from simulator.exposure.flash import Flash
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import CurtainShutter, LeafShutter, RollingShutter
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.scene.charts import ChartScene

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

IMAGE = Path(__file__).resolve().parent / "images" / "time.png"
INK, SECOND, GRID = "#1f3b57", "#c0392b", "#d9dee3"
SMALL = ["camera.width=1500", "camera.height=1000"]  # of the sensor's photosites, so that a picture has few
CAMERA, LENS = load_camera("sony_a7_iii", SMALL), ThinLens(20.0, 4.0, 2.0, cos4=False)
FRAMES = {
    "rolling shutter of 20 ms, 1/1000 s,\nlamp of 240 Hz that is on for 40 %": (
        5000.0,
        Exposure(1 / 1000, shutter=RollingShutter(0.02), flicker=PwmLamp(240.0, 0.4)),
    ),
    "the same shutter, 1/250 s,\nflash of 2 ms in the middle": (
        250.0,
        Exposure(1 / 250, shutter=RollingShutter(0.02), flash=Flash(0.002, guide_number_m=7.0, delay_s=-0.01)),
    ),
    "curtains of 4 ms, 1/500 s:\nthe slit is half of the frame when the flash fires": (
        500.0,
        Exposure(1 / 500, shutter=CurtainShutter(0.004, distance_mm=2.0), flash=Flash(1e-4, guide_number_m=7.0)),
    ),
}


def main() -> None:
    """Write the picture."""
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.2), layout="constrained", dpi=90, height_ratios=(1.0, 1.0))
    for axis, (title, (luminance, exposure)) in zip(axes[0], FRAMES.items(), strict=True):
        raw = simulate(Shot(ChartScene("color_checker", luminance), LENS, exposure, CAMERA))
        axis.imshow(develop(raw, half_size=True, bits=8))
        axis.set_title(title, fontsize=9)
        axis.axis("off")
    _draw_modulation(axes[1, 0])
    _draw_band(axes[1, 1])
    _draw_efficiency(axes[1, 2])
    for axis in axes[1]:
        axis.spines[["top", "right"]].set_visible(False)
        axis.grid(color=GRID)
    figure.canvas.draw()
    with atomic_write(IMAGE) as part:
        Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3]).quantize(200).save(part, "PNG", optimize=True)


def _rows(exposure: Exposure, luminance: float = 500.0) -> np.ndarray:
    """Mean electrons of the rows of a white wall 2 m away."""
    camera = load_camera("sony_a7_iii", [*SMALL, "camera.window={x: 0, y: 0, width: 32, height: 1000}"])
    raw = simulate(Shot(ChartScene("flat_field", luminance), LENS, exposure, camera))
    return raw.mean_electrons[0::2, 0::2].mean(axis=1, dtype=np.float64)


def _draw_modulation(axis: Axes) -> None:
    """Modulation of the rows under a lamp of 100 Hz, over the exposure time."""
    times_s = np.linspace(0.0005, 0.03, 16)
    measured = []
    for time_s in times_s:
        rows = _rows(Exposure(float(time_s), shutter=RollingShutter(0.02), flicker=MainsFlicker(100.0, 0.4)))
        measured.append((rows.max() - rows.min()) / (rows.max() + rows.min()))
    fine_s = np.linspace(1e-4, 0.03, 400)
    axis.plot(1e3 * fine_s, 0.4 * np.abs(np.sinc(100.0 * fine_s)), color=INK, label="m |sinc(f T)|")
    axis.plot(1e3 * times_s, measured, "o", color=SECOND, label="rows of frames")
    axis.set(xlabel="exposure time [ms]", ylabel="modulation of the rows", title="mains flicker, 100 Hz, m = 0.4")
    axis.legend(frameon=False)


def _draw_band(axis: Axes) -> None:
    """Light of the flash over the rows, for two lengths of the pulse."""
    for length_s, color in ((0.002, INK), (0.008, SECOND)):
        flash = Flash(length_s, guide_number_m=20.0, delay_s=-0.01 - 0.5 * length_s)
        rows = _rows(Exposure(0.004, shutter=RollingShutter(0.02), flash=flash), 1e-3)
        axis.plot(np.arange(len(rows)) * 2, rows / rows.max(), color=color, label=f"{1e3 * length_s:g} ms")
        height = 1000 * (0.004 + length_s) / 0.02
        edge = np.flatnonzero(rows > 1e-3 * rows.max())[0] * 2
        level = 0.06 if length_s < 0.004 else 0.13
        axis.annotate("", (edge, level), (edge + height, level), arrowprops={"arrowstyle": "<->", "color": color})
    axis.set(xlabel="row", ylabel="light of the flash", title="4 ms under 20 ms: a band of (Te + Tf) / Tread")
    axis.legend(title="pulse", frameon=False)


def _draw_efficiency(axis: Axes) -> None:
    """Efficiency of a slit and of a leaf over the f-number."""
    stops = np.array([1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.0, 16.0, 22.0])
    slit, leaf = [], []
    for stop in stops:
        curtains = CurtainShutter(0.004, distance_mm=2.0).line_times(CAMERA, 1 / 1000, stop, stop)[0]
        slit.append((curtains.effective_s / (curtains.closed_s - curtains.opens_s))[500])
        blades = LeafShutter(0.001, 0.001, 1.4).line_times(CAMERA, 1 / 500, stop, stop)[0]
        leaf.append(blades.effective_s[0] * 500)
    axis.semilogx(stops, slit, "o-", color=INK, label="slit of 1.5 mm, 2 mm before the sensor")
    axis.semilogx(stops, leaf, "s-", color=SECOND, label="leaf, 1 ms to open, 1 ms to close, 1/500 s")
    axis.set_xticks(stops, [f"{stop:g}" for stop in stops])
    axis.minorticks_off()
    axis.set(xlabel="f-number", ylabel="efficiency", ylim=(0.0, 1.05), title="efficiency by f-number")
    axis.legend(frameon=False, fontsize=8)


if __name__ == "__main__":
    main()
