"""Planes seen through a lens whose point spread function changes over the field, by FFT.

A photosite gathers what the kernel of its own place brings: T(x) = sum over nodes of weight(x) (kernel * S)(x), the kernels of
the four nodes around it mixed bilinearly. The weights add up to 1, so that a flat field stays flat and patches have no seams.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from simulator.sensor.camera.camera_sections import Window

TILE_PX = 512
WORKERS = -1  # all cores
MOST_SPECTRA = 64  # transforms of kernels that are kept, about 3 MB each
# Rounding of a float32 transform is a share of the tile's largest value; above this many means it takes float64.
HIGH_CONTRAST = 30.0


@dataclass(frozen=True)
class Tile:
    """A part of the planes between node lines. across, down: node and weight (pixels,) of its columns and of its rows."""

    rows: slice
    columns: slice
    down: list[tuple[int, np.ndarray]]
    across: list[tuple[int, np.ndarray]]


def tiles_of(x_px, y_px, shape: tuple[int, int], tile_px: int = TILE_PX) -> Iterator[Tile]:
    """Tiles of planes (rows, columns) with nodes at these ascending places, at most `tile_px` wide and high."""
    columns = list(_pieces(np.asarray(x_px), shape[1], tile_px))
    for rows, down in _pieces(np.asarray(y_px), shape[0], tile_px):
        for part, across in columns:
            yield Tile(rows, part, down, across)


def is_seen(tile: Tile, window: Window) -> bool:
    """Whether a tile of the sensor holds photosites of a window."""
    down, across = tile.rows, tile.columns
    inside = down.start < window.y + window.height and down.stop > window.y
    return inside and across.start < window.x + window.width and across.stop > window.x


def around(tile: Tile, reach_px: int) -> Window:
    """A tile of the sensor and so many photosites on either side."""
    rows, columns = tile.rows, tile.columns
    width, height = columns.stop - columns.start + 2 * reach_px, rows.stop - rows.start + 2 * reach_px
    return Window(columns.start - reach_px, rows.start - reach_px, width, height)


def area_around(tiles: Iterable[Tile], reach_px: int, window: Window) -> Window:
    """Photosites that the tiles of a window need, with so many on either side."""
    parts = [around(tile, reach_px) for tile in tiles if is_seen(tile, window)]
    left, top = min(one.x for one in parts), min(one.y for one in parts)
    right, bottom = max(one.x + one.width for one in parts), max(one.y + one.height for one in parts)
    return Window(left, top, right - left, bottom - top)


def _pieces(nodes: np.ndarray, count: int, tile_px: int) -> Iterator[tuple[slice, list[tuple[int, np.ndarray]]]]:
    """Runs of at most `tile_px` pixels that cross no node, each with its one or two nodes and their weights."""
    cuts = sorted({0, count, *(int(cut) for cut in np.ceil(nodes) if 0 < cut < count)})
    for start, end in zip(cuts[:-1], cuts[1:], strict=True):
        parts = -(-(end - start) // tile_px)
        edges = [start + (end - start) * part // parts for part in range(parts + 1)]
        for first, last in zip(edges[:-1], edges[1:], strict=True):
            place = np.interp(np.arange(first, last), nodes, np.arange(len(nodes)))
            low = int(place.mean())
            weights = [(low, 1.0 - (place - low)), (low + 1, place - low)]
            yield slice(first, last), [(node, weight) for node, weight in weights if weight.any()]


class Spectra:
    """Transforms of kernels, made when first wanted, for tiles of one size.

    kernel: from a name and the row and column of a node to a kernel, (phases, size, size) with size odd: one for each of the
        sets of pixels that the light is given on. reach: half the size of the largest kernel.
    most: transforms that are kept at once.
    """

    def __init__(self, kernel: Callable[..., np.ndarray], reach: int, tiles: Sequence[Tile], most: int = MOST_SPECTRA):
        self.kernel, self.reach, self.most = kernel, reach, most
        sides = [
            max(part.stop - part.start for part in parts) for parts in zip(*((t.rows, t.columns) for t in tiles), strict=True)
        ]
        self.shape = tuple(fft.next_fast_len(side + 2 * reach, real=True) for side in sides)
        self._made: dict[tuple, tuple[np.ndarray, float]] = {}

    def of(self, name: tuple, dtype: np.dtype) -> tuple[np.ndarray, float]:
        """Transform of a kernel and its light; name ends with row and column of the node."""
        key = (*name, dtype)
        if key not in self._made:
            kernel = np.asarray(self.kernel(*name))
            while len(self._made) * len(kernel) >= self.most and self._made:
                del self._made[next(iter(self._made))]
            spare = self.reach - kernel.shape[-1] // 2  # a kernel's middle stands at [reach, reach]
            placed = np.zeros((len(kernel), *(2 * (2 * self.reach + 1,))), dtype)
            placed[:, spare : spare + kernel.shape[-1], spare : spare + kernel.shape[-1]] = kernel
            self._made[key] = fft.rfft2(placed, self.shape, workers=WORKERS), float(kernel.sum(dtype=np.float64))
        return self._made[key]


@dataclass(frozen=True)
class Source:
    """Transformed light of a tile and its margins: (phases, ...) less its mean."""

    spectrum: np.ndarray
    mean: float
    dtype: np.dtype


def source_of(parts: np.ndarray, spectra: Spectra) -> Source:
    """Transform light (phases, rows + 2 reach, columns + 2 reach); float32 where no point stands out of float32 light."""
    mean = float(parts.mean(dtype=np.float64))
    even = parts.dtype == np.float32 and float(parts.max()) <= HIGH_CONTRAST * mean
    dtype = np.dtype(np.float32 if even else np.float64)
    difference = (parts - parts.dtype.type(mean)).astype(dtype, copy=False)
    return Source(fft.rfft2(difference, spectra.shape, workers=WORKERS), mean, dtype)


def gathered(source: Source, tile: Tile, spectra: Spectra, *name) -> np.ndarray:
    """Light of one tile, (rows, columns) float64: the kernels of its nodes, weighted where it arrives."""
    reach = spectra.reach
    height, width = tile.rows.stop - tile.rows.start, tile.columns.stop - tile.columns.start
    total = np.zeros((height, width))
    for row, down in tile.down:
        for column, across in tile.across:
            transform, light = spectra.of((*name, row, column), source.dtype)
            product = source.spectrum[0] * transform[0]
            for part, kernel in zip(source.spectrum[1:], transform[1:], strict=True):
                product += part * kernel
            brought = fft.irfft2(product, spectra.shape, workers=WORKERS)
            brought = brought[2 * reach : 2 * reach + height, 2 * reach : 2 * reach + width]
            total += (down[:, None] * across[None, :]) * (brought + source.mean * light)
    return total
