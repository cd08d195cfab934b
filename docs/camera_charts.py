"""The chart of one camera: read noise in electrons and in DN, dynamic range, and quantum efficiency."""

from collections.abc import Callable
from pathlib import Path

import matplotlib
import numpy as np
from make_cameras import dynamic_range_stops
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from PIL import Image

from simulator.atomic_files import atomic_write
from simulator.sensor.camera.camera import Camera

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.ticker import LogLocator  # noqa: E402

INK, GRID = "#1f3b57", "#d9dee3"
CURVES = {1: ("#444444",), 3: ("#c0392b", "#2e8b57", "#2c5fa8")}


def write_chart(camera: Camera, path: Path) -> None:
    """Write a PNG of four panels; points are the ISO settings of the file, lines what the camera is between them."""
    figure, axes = plt.subplots(1, 4, figsize=(12, 3), layout="constrained", dpi=90)
    _against_iso(axes[0], camera, lambda setting: setting.read_noise_dn / setting.gain_dn_per_e, logarithmic=True)
    _against_iso(axes[1], camera, lambda setting: setting.read_noise_dn, logarithmic=True)
    _against_iso(axes[2], camera, lambda setting: dynamic_range_stops(camera, setting))
    response = camera.response
    for curve, color in zip(response.quantum_efficiency.T, CURVES[camera.channels], strict=True):
        axes[3].plot(response.wavelengths_nm, curve, color=color, linewidth=1.5)
    axes[3].set(xlabel="wavelength [nm]", ylim=(0, None))
    titles = ("read noise [e⁻]", "read noise [DN]", "dynamic range [stops]", "quantum efficiency [e⁻/photon]")
    for axis, title in zip(axes, titles, strict=True):
        axis.set_title(title, fontsize=10)
        axis.grid(color=GRID, linewidth=0.6)
        axis.set_axisbelow(True)
        axis.spines[["top", "right"]].set_visible(False)
    _save(figure, path)


def _against_iso(axis: Axes, camera: Camera, quantity: Callable[[int], float], logarithmic: bool = False) -> None:
    isos = np.array(camera.isos)
    switch = camera.conversion_gain.iso if camera.conversion_gain is not None else np.inf
    for side, end in ((isos[isos < switch], switch), (isos[isos >= switch], np.inf)):
        if not len(side):
            continue
        # A model goes on to the switch, a table ends at its last line before it.
        last = min(end * 0.9999, isos[-1]) if camera.read_noise_model is not None else side[-1]
        first = min(switch, side[0]) if camera.read_noise_model is not None and side[0] > switch else side[0]
        grid = np.geomspace(first, last, 200)
        axis.plot(grid, [quantity(camera.iso_setting(iso)) for iso in np.clip(grid, first, last)], color=INK, linewidth=1.2)
        axis.plot(side, [quantity(camera.iso_setting(int(iso))) for iso in side], "o", color=INK, markersize=3.5)
    axis.set_xscale("log", base=2)
    if logarithmic and all(quantity(camera.iso_setting(int(iso))) > 0 for iso in isos):
        axis.set_yscale("log")
        axis.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.yaxis.set_major_formatter("{x:g}")
    elif logarithmic:
        axis.set_ylim(0, 1)
    stops = [iso for iso in isos if np.log2(iso / 100) % 2 == 0] or [isos[0]]
    axis.set_xticks(stops, [f"{iso}" for iso in stops], fontsize=8)
    axis.minorticks_off()
    axis.set_xlabel("ISO")


def _save(figure: Figure, path: Path) -> None:
    """Write with a palette of 64 colours: half the size, and no difference to be seen."""
    figure.canvas.draw()
    picture = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB").quantize(64)
    plt.close(figure)
    with atomic_write(path) as temporary:
        picture.save(temporary, format="PNG", optimize=True)
