"""Convolution by FFT with a point spread function that varies over the field.

T(x) = sum over nodes of weight(x) (kernel * S)(x): the kernels of the four nodes around a photosite, interpolated bilinearly at
the photosite. The weights add up to 1, so that a flat field stays flat and tiles have no seams.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from simulator.sensor.camera.camera_sections import Window

TILE_PX = 512
WORKERS = -1  # all cores
MOST_SPECTRA = 64  # transforms of kernels in the cache, about 3 MB each
# Largest over mean value of a tile above which transforms are float64: float32 errors are proportional to the largest value.
HIGH_CONTRAST = 30.0


@dataclass(frozen=True)
class Tile:
    """A part of the planes without a node line inside.

    down, across: number of each node line beside it, and the weight of that line for each row or column, (pixels,) float64.
    """

    rows: slice
    columns: slice
    down: list[tuple[int, np.ndarray]]
    across: list[tuple[int, np.ndarray]]


def split_into_tiles(x_px: np.ndarray, y_px: np.ndarray, shape: tuple[int, int], tile_px: int = TILE_PX) -> Iterator[Tile]:
    """Tiles of planes (rows, columns) with nodes at these ascending positions, at most `tile_px` wide and high."""
    columns = list(_split_axis(np.asarray(x_px), shape[1], tile_px))
    for rows, down in _split_axis(np.asarray(y_px), shape[0], tile_px):
        for part, across in columns:
            yield Tile(rows, part, down, across)


def is_in_window(tile: Tile, window: Window) -> bool:
    """Whether a tile of the sensor holds photosites of a window."""
    down, across = tile.rows, tile.columns
    inside = down.start < window.y + window.height and down.stop > window.y
    return inside and across.start < window.x + window.width and across.stop > window.x


def pad_tile(tile: Tile, reach_px: int) -> Window:
    """Window of a tile of the sensor with a margin of reach_px photosites on each side."""
    rows, columns = tile.rows, tile.columns
    width, height = columns.stop - columns.start + 2 * reach_px, rows.stop - rows.start + 2 * reach_px
    return Window(columns.start - reach_px, rows.start - reach_px, width, height)


def bound_tiles(tiles: Iterable[Tile], reach_px: int, window: Window) -> Window:
    """Smallest window around all tiles that overlap a window, with a margin of reach_px photosites on each side."""
    parts = [pad_tile(tile, reach_px) for tile in tiles if is_in_window(tile, window)]
    left, top = min(one.x for one in parts), min(one.y for one in parts)
    right, bottom = max(one.x + one.width for one in parts), max(one.y + one.height for one in parts)
    return Window(left, top, right - left, bottom - top)


def _split_axis(nodes: np.ndarray, count: int, tile_px: int) -> Iterator[tuple[slice, list[tuple[int, np.ndarray]]]]:
    """Intervals of at most `tile_px` pixels between nodes, each with its one or two nodes and their weights."""
    cuts = sorted({0, count, *(int(cut) for cut in np.ceil(nodes) if 0 < cut < count)})
    for start, end in zip(cuts[:-1], cuts[1:], strict=True):
        parts = -(-(end - start) // tile_px)
        edges = [start + (end - start) * part // parts for part in range(parts + 1)]
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            place = np.interp(np.arange(first, last), nodes, np.arange(len(nodes)))
            low = int(place.mean())
            weights = [(low, 1.0 - (place - low)), (low + 1, place - low)]
            yield slice(first, last), [(node, weight) for node, weight in weights if weight.any()]


class KernelSpectra:
    """Fourier transforms of kernels for tiles of one size, computed on demand and cached.

    kernel: from a name and the row and column of a node to a kernel, (phases, size, size) with size odd, one for each phase of
        the light samples (`Sampling.phases`). reach: half the size of the largest kernel.
    most: size of the cache, in transforms.
    """

    def __init__(self, kernel: Callable[..., np.ndarray], reach: int, tiles: Sequence[Tile], most: int = MOST_SPECTRA):
        self.kernel, self.reach, self.most = kernel, reach, most
        sides = [
            max(part.stop - part.start for part in parts) for parts in zip(*((t.rows, t.columns) for t in tiles), strict=True)
        ]
        self.shape = tuple(fft.next_fast_len(side + 2 * reach, real=True) for side in sides)
        self._made: dict[tuple[object, ...], tuple[np.ndarray, float]] = {}

    def transform(self, name: tuple[int | bool, ...], dtype: np.dtype) -> tuple[np.ndarray, float]:
        """Transform of a kernel and the sum of the kernel; name ends with row and column of the node."""
        key = (*name, dtype)
        if key not in self._made:
            kernel = np.asarray(self.kernel(*name))
            while len(self._made) * len(kernel) >= self.most and self._made:
                del self._made[next(iter(self._made))]
            spare = self.reach - kernel.shape[-1] // 2  # the centre of a kernel lies at [reach, reach]
            placed = np.zeros((len(kernel), *(2 * (2 * self.reach + 1,))), dtype)
            placed[:, spare : spare + kernel.shape[-1], spare : spare + kernel.shape[-1]] = kernel
            transformed = np.asarray(fft.rfft2(placed, self.shape, workers=WORKERS))
            self._made[key] = transformed, float(kernel.sum(dtype=np.float64))
        return self._made[key]


@dataclass(frozen=True)
class TileSpectrum:
    """Fourier transform of the light of a tile and its margins, (phases, ...), without the mean."""

    spectrum: np.ndarray
    mean: float
    dtype: np.dtype


def transform_light(parts: np.ndarray, spectra: KernelSpectra) -> TileSpectrum:
    """Transform light (phases, rows + 2 reach, columns + 2 reach); in float32 unless a point exceeds HIGH_CONTRAST means."""
    mean = float(parts.mean(dtype=np.float64))
    even = parts.dtype == np.float32 and float(parts.max()) <= HIGH_CONTRAST * mean
    dtype = np.dtype(np.float32 if even else np.float64)
    difference = (parts - parts.dtype.type(mean)).astype(dtype, copy=False)
    return TileSpectrum(np.asarray(fft.rfft2(difference, spectra.shape, workers=WORKERS)), mean, dtype)


def convolve_tile(source: TileSpectrum, tile: Tile, spectra: KernelSpectra, *name: int | bool) -> np.ndarray:
    """Convolve the light of one tile with the kernels of its nodes, interpolated at the output: (rows, columns) float64."""
    reach = spectra.reach
    height, width = tile.rows.stop - tile.rows.start, tile.columns.stop - tile.columns.start
    total = np.zeros((height, width))
    for row, down in tile.down:
        for column, across in tile.across:
            transform, light = spectra.transform((*name, row, column), source.dtype)
            product = source.spectrum[0] * transform[0]
            for part, kernel in zip(source.spectrum[1:], transform[1:], strict=True):
                product += part * kernel
            convolved = np.asarray(fft.irfft2(product, spectra.shape, workers=WORKERS))
            convolved = convolved[2 * reach : 2 * reach + height, 2 * reach : 2 * reach + width]
            total += (down[:, None] * across[None, :]) * (convolved + source.mean * light)
    return total
