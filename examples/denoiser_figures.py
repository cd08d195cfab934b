"""Figures of examples/denoiser.py: PSNR while training, and pictures side by side."""

from pathlib import Path

import numpy as np
from denoiser_pairs import GAUSSIAN, GREY, OURS, PUBLISHED, Pairs

from simulator.atomic_files import atomic_write
from simulator.measurement.report.figures import new_figure
from simulator.raw.development import srgb_encoded, write_image

COLORS = {OURS: "#0b5fa5", PUBLISHED: "#333333", GAUSSIAN: "#d35400", GREY: "#b8860b"}
SHOWN, LIGHTER = 4, 2.0  # pictures, and how much lighter they are shown than exposed
GAP_PX = 4


def write_curve(path: Path, found: dict) -> None:
    """PSNR on the pairs that watch the training against steps: a thin line for each seed, a thick one for their mean."""
    figure, (axes,) = new_figure(1, 1, 7.5, 4.5)
    for name, color in COLORS.items():
        curves = np.array([one["curve"] for one in found["runs"] if one["noise"] == name])
        dashes = "--" if name == PUBLISHED else "-"
        for curve in curves:
            axes.plot(*curve.T, dashes, color=color, linewidth=0.6, alpha=0.5)
        axes.plot(*curves.mean(axis=0).T, dashes, color=color, linewidth=2.0, label=f"learned from {name}")
    axes.set(
        xlabel="step",
        ylabel=f"PSNR on {found['watched']} of {len(found['noisy'])} pairs held out [dB]",
        title="Denoising the published noise of the Sony A7S II",
    )
    axes.legend()
    with atomic_write(path) as beside:
        figure.savefig(beside, dpi=110)


def write_pictures(path: Path, test: Pairs, denoised: dict[str, np.ndarray]) -> None:
    """A row for each of some pictures held out: noisy, learned from Gaussian noise, from the model, from ours, clean."""
    rows = []
    for place in range(SHOWN):
        planes = (test.noisy[PUBLISHED], denoised[GAUSSIAN], denoised[PUBLISHED], denoised[OURS], test.clean)
        cells = [shown(each[place], test.white_balance[place]) for each in planes]
        rows.append(np.concatenate([_framed(cell) for cell in cells], axis=1))
    write_image(path, np.concatenate(rows))


def shown(planes: np.ndarray, white_balance: np.ndarray) -> np.ndarray:
    """Return sRGB float32 (height, width, 3), 0 to 1, of planes R, Gr, Gb, B: white-balanced and lighter, no colour matrix."""
    colors = np.stack([planes[0], 0.5 * (planes[1] + planes[2]), planes[3]], axis=-1)
    return srgb_encoded(np.clip(LIGHTER * colors * white_balance, 0.0, 1.0)).astype(np.float32)


def _framed(cell: np.ndarray) -> np.ndarray:
    return np.pad(cell, ((0, GAP_PX), (0, GAP_PX), (0, 0)), constant_values=1.0)
