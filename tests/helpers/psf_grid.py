"""Whole planes through kernels at nodes, tile by tile with the functions that a frame's light goes through."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.psf.tiled_convolution import (
    MOST_SPECTRA,
    TILE_PX,
    KernelSpectra,
    convolve_tile,
    split_into_tiles,
    transform_light,
)


@dataclass(frozen=True)
class PsfGrid:
    """Kernels at nodes on the planes.

    kernels: (channels, node rows, node columns, size, size), size odd, as light of a point in the middle.
    x_px, y_px: ascending positions of the nodes [px], 0 at the centre of the first pixel; constant beyond the outer ones.
    """

    kernels: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray


def convolve(planes: np.ndarray, grid: PsfGrid, tile_px: int = TILE_PX, most_spectra: int = MOST_SPECTRA) -> np.ndarray:
    """Planes (channels, rows, columns) through the kernels of their places, same shape and type; their edge goes on.

    tile_px: side of the largest tile. most_spectra: transforms of kernels that are kept at once.
    """
    result, reach = np.empty_like(planes), grid.kernels.shape[-1] // 2
    padded = np.pad(planes, ((0, 0), (reach, reach), (reach, reach)), mode="edge")
    tiles = list(split_into_tiles(grid.x_px, grid.y_px, planes.shape[1:], tile_px))
    spectra = KernelSpectra(lambda *place: grid.kernels[place][None], reach, tiles, most_spectra)
    for channel in range(len(planes)):
        for tile in tiles:
            rows, columns = (slice(part.start, part.stop + 2 * reach) for part in (tile.rows, tile.columns))
            source = transform_light(padded[channel, rows, columns][None], spectra)
            result[channel][tile.rows, tile.columns] = convolve_tile(source, tile, spectra, channel)
    return result
