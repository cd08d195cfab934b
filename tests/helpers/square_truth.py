"""Scenes of even squares behind a transfer function in float64: sums over frequencies, without samples of light or kernels."""

import math
from collections.abc import Callable

import numpy as np


def light_of_squares(
    planes: np.ndarray,
    shape: tuple[int, int],
    transfer: Callable[[np.ndarray, np.ndarray], np.ndarray],
    margin_px: int,
    finest: float,
) -> np.ndarray:
    """Light of photosites (rows, columns) that a scene of even squares covers, float64.

    transfer: of lens, filter and the aperture of photosites, at frequencies right and down [cycles per photosite].
    margin_px: photosites, whole pixels, over which the border of the scene goes on beyond it. finest: frequency up to which
        anything passes, the same unit.
    """
    pixels_px = planes.shape[0] / shape[0]
    planes = np.pad(planes, round(margin_px * pixels_px), mode="edge")
    sides = []
    for pixels, inner in zip(planes.shape, shape, strict=True):
        photosites = inner + 2 * margin_px
        cycles = np.arange(-math.ceil(finest * photosites), math.ceil(finest * photosites) + 1) / photosites
        width = photosites / pixels
        into = np.exp(-2j * math.pi * np.outer(cycles, (np.arange(pixels) + 0.5) * width)) * np.sinc(cycles * width)[:, None]
        out = np.exp(2j * math.pi * np.outer(np.arange(margin_px, margin_px + inner) + 0.5, cycles))
        sides.append((cycles, into * width / photosites, out))
    (down, into_down, out_down), (across, into_across, out_across) = sides
    spectrum = (into_down @ planes @ into_across.T) * transfer(across[None, :], down[:, None])
    return np.asarray((out_down @ spectrum @ out_across.T).real)


def transfer_of_cells(cells: np.ndarray, per_photosite: int) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
    """Transfer function of light in cells around a point, integrals of a function that is band-limited to them."""
    places = (np.arange(len(cells)) - len(cells) // 2) / per_photosite

    def transfer(right: np.ndarray, down: np.ndarray) -> np.ndarray:
        y, x = (np.exp(-2j * math.pi * np.outer(one.ravel(), places)) for one in (down, right))
        passed = np.maximum(np.abs(down), np.abs(right)) <= 0.5 * per_photosite
        return passed * (y @ cells @ x.T) / np.sinc(down / per_photosite) / np.sinc(right / per_photosite)

    return transfer
