"""The pictures of docs/lens_aberrations.md: kernels, transfer functions and their truth, a distorted lattice, a single lens."""

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from scipy.ndimage import map_coordinates
from scipy.signal import fftconvolve

from simulator.atomic_files import atomic_write
from simulator.config import load_camera, load_sweep
from simulator.exposure.settings import Exposure
from simulator.measurement.statistics.slanted_edge import edge_transfer
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.scene.image import ImageScene

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

ROOT = Path(__file__).parent.parent
IMAGES = ROOT / "docs" / "images"
COLORS = ((640.0, 610.0, 590.0), (560.0, 535.0, 510.0), (480.0, 460.0, 440.0))
LENSES = {
    "spherical 0.8 µm": Aberrations(spherical_um=0.8),
    "coma 1.2 µm": Aberrations(coma_um=1.2),
    "astigmatism 0.8 µm": Aberrations(astigmatism_um=0.8),
    "longitudinal colour ±60 µm": Aberrations(
        chromatic=(ChromaticShift(450.0, 60.0), ChromaticShift(550.0), ChromaticShift(650.0, -60.0))
    ),
    "lateral colour ±8 µm": Aberrations(
        chromatic=(ChromaticShift(450.0, 0.0, 8.0), ChromaticShift(550.0), ChromaticShift(650.0, 0.0, -8.0))
    ),
}


def kernel_picture(path: Path) -> None:
    """Kernels of f/4 lenses at field 0.9 to the upper right, in cells of 1 um, over the blur radius of defocus."""
    radii_um = (-16.0, -8.0, 0.0, 8.0, 16.0)
    figure, axes = plt.subplots(len(LENSES), len(radii_um), figsize=(8.4, 9.0), layout="constrained", dpi=90)
    for row, (name, aberrations) in enumerate(LENSES.items()):
        lens = WavefrontPsf(aberrations, 4.0, 1.0, COLORS, 61, cells=1)
        for column, radius in enumerate(radii_um):
            rgb = np.stack([lens.kernel(channel, radius, (0.72, -0.54)) for channel in range(3)], axis=-1)
            axis = axes[row, column]
            axis.imshow((rgb / rgb.max()) ** (1 / 2.2), extent=(-30.5, 30.5, 30.5, -30.5))
            axis.set(xticks=(), yticks=())
            if row == 0:
                axis.set_title(f"blur radius {radius:+g} µm", fontsize=9)
        axes[row, 0].set_ylabel(name, fontsize=9)
    _save(figure, path)


def transfer_picture(path: Path) -> None:
    """Transfer of a lens at f/8, of a 4 um photosite and of a low-pass filter: measured by slanted edge, and closed forms."""
    frequency = np.linspace(0.0, 0.5, 101)
    u = 0.25 * frequency * 0.55 * 8.0
    pupil = 2.0 / math.pi * (np.arccos(u) - u * np.sqrt(1.0 - u**2))
    truths = {
        "f/8, all of the photosite": (Sampling(), pupil * np.sinc(frequency)),
        "f/8, fill factor 0.25": (Sampling(0.25), pupil * np.sinc(0.5 * frequency)),
        "f/8, low-pass filter of 3 µm": (Sampling(1.0, 3.0), pupil * np.sinc(frequency) * np.cos(0.75 * math.pi * frequency)),
    }
    figure, axis = plt.subplots(figsize=(7.0, 4.2), layout="constrained", dpi=90)
    for color, (name, (sampling, expected)) in zip(("#1f3b57", "#c0392b", "#2e8b57"), truths.items(), strict=True):
        found = edge_transfer(_edge_seen(sampling))
        shown = (found.frequency_per_px > 0.01) & (found.frequency_per_px <= 0.5)
        axis.plot(frequency, expected, color=color, linewidth=1.2, label=f"{name}: closed form")
        axis.plot(
            found.frequency_per_px[shown][::10],
            found.transfer[shown][::10],
            "o",
            color=color,
            markersize=4,
            label="slanted edge",
        )
    axis.set(xlabel="cycles per photosite", ylabel="modulation transfer", xlim=(0, 0.5), ylim=(0, 1.02))
    axis.grid(color="#d9dee3", linewidth=0.6)
    axis.spines[["top", "right"]].set_visible(False)
    axis.legend(fontsize=8, frameon=False)
    _save(figure, path)


def distortion_picture(path: Path) -> None:
    """A lattice through a barrel with strong lateral colour, as the sensor has it, and after the DNG's own correction."""
    width, height = 480, 360
    camera = replace(load_camera("sony_a7s2"), width_px=width, height_px=height, window=None)
    lens = ThinLens(
        50.0, 8.0, cos4=False, distortion=Distortion(k1=-0.16, k2=0.03, unit="half_diagonal", lateral=(1.01, 1.0, 0.99))
    )
    with TemporaryDirectory() as folder:
        lattice = np.full((3 * height, 3 * width), 0.05, np.float32)
        for middle in range(45, 3 * width, 90):
            lattice[:, middle - 3 : middle + 3] = lattice[middle - 3 : middle + 3] = 1.0
        np.save(Path(folder) / "lattice.npy", lattice)
        scene = ImageScene(Path(folder) / "lattice.npy", luminance_cd_m2=300.0)
        raw = simulate(Shot(scene, lens, Exposure(1 / 100), camera, truth=("rgb",)))
    seen = raw.truth["rgb"] / np.array(raw.as_shot_neutral)
    planes, centre = raw.warp_rectilinear
    undone = np.stack([_undone(seen[..., channel], planes[channel], centre) for channel in range(3)], axis=-1)
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.1), layout="constrained", dpi=100)
    for axis, picture, title in zip(axes, (seen, undone), ("on the sensor", "after WarpRectilinear of the DNG"), strict=True):
        axis.imshow(np.clip(picture / seen.max(), 0.0, 1.0) ** (1 / 2.2))
        axis.set(xticks=(), yticks=(), title=title)
    _save(figure, path)


def singlet_picture(path: Path) -> None:
    """A star of 24 rays through the single lens of configs/shots/singlet.yaml, at four f-numbers."""
    side, fine = 160, 4
    y, x = (np.mgrid[: side * fine, : side * fine] + 0.5) / fine - 0.5 * side
    star = np.where((np.cos(24.0 * np.arctan2(y, x)) > 0) & (np.hypot(x, y) < 72.0), 0.95, 0.05)
    shots = [point.shot() for point in load_sweep(ROOT / "configs" / "shots" / "singlet.yaml")]
    figure, axes = plt.subplots(1, len(shots), figsize=(10.0, 2.9), layout="constrained", dpi=100)
    with TemporaryDirectory() as folder:
        np.save(Path(folder) / "star.npy", star.astype(np.float32))
        scene = ImageScene(Path(folder) / "star.npy", luminance_cd_m2=120.0, depth_m=2.0)
        for axis, shot in zip(axes, shots, strict=True):
            camera = replace(shot.camera, width_px=side, height_px=side, window=None)
            axis.imshow(develop(simulate(replace(shot, scene=scene, camera=camera)), bits=8))
            axis.set(xticks=(), yticks=(), title=f"f/{shot.lens.f_number:g}")
    _save(figure, path)


def _undone(plane: np.ndarray, numbers: tuple[float, ...], centre: tuple[float, float]) -> np.ndarray:
    """WarpRectilinear (DNG 1.4, chapter 7)."""
    height, width = plane.shape
    cx, cy = centre[0] * (width - 1), centre[1] * (height - 1)
    unit = math.hypot(max(cx, width - 1 - cx), max(cy, height - 1 - cy))
    y, x = np.mgrid[:height, :width]
    dx, dy = (x - cx) / unit, (y - cy) / unit
    r2 = dx**2 + dy**2
    radial = numbers[0] + r2 * (numbers[1] + r2 * (numbers[2] + r2 * numbers[3]))
    there_x = radial * dx + 2 * numbers[4] * dx * dy + numbers[5] * (r2 + 2 * dx**2)
    there_y = radial * dy + 2 * numbers[5] * dx * dy + numbers[4] * (r2 + 2 * dy**2)
    return map_coordinates(plane, (cy + unit * there_y, cx + unit * there_x), order=1, mode="nearest")


def _edge_seen(sampling: Sampling) -> np.ndarray:
    """A sharp edge at 5.7 degrees through a lens at f/8 on photosites of 4 um, (128, 96)."""
    fine, cell_um = 4, 1.0
    y, x = np.mgrid[: 128 * fine, : 96 * fine]
    edge = np.clip((x - 48.3 * fine) * math.cos(0.0995) + (y - 64 * fine) * math.sin(0.0995) + 0.5, 0.0, 1.0)
    lens = WavefrontPsf(Aberrations(), 8.0, cell_um, ((550.0,),), 255, cells=1)
    kernel = lens.kernel(0, 0.0, (0.0, 0.0))
    light = fftconvolve(np.pad(edge, len(kernel) // 2, mode="edge"), kernel, mode="valid")
    frequency_y, frequency_x = np.fft.fftfreq(len(light), cell_um), np.fft.fftfreq(light.shape[1], cell_um)
    transfer = sampling.transfer(frequency_y, 4.0)[:, None] * sampling.transfer(frequency_x, 4.0)[None, :]
    # The kernel has the width of its cells, and the edge, across, that of a cell once more.
    cells = np.sinc(frequency_y * cell_um)[:, None] * np.sinc(frequency_x * cell_um)[None, :] ** 2
    seen = np.fft.ifft2(np.fft.fft2(light) * transfer / cells).real
    return seen[fine // 2 :: fine, fine // 2 :: fine][16:-16, 16:-16]


def _save(figure: Figure, path: Path) -> None:
    with atomic_write(path) as temporary:
        figure.savefig(temporary)
    plt.close(figure)


if __name__ == "__main__":
    kernel_picture(IMAGES / "lens_kernels.png")
    transfer_picture(IMAGES / "lens_transfer.png")
    distortion_picture(IMAGES / "lens_distortion.png")
    singlet_picture(IMAGES / "lens_singlet.png")
