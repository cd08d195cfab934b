"""Planes seen through a lens whose point spread function changes over the field, by FFT.

A photosite gathers what the kernel of its own place brings: T(x) = sum over nodes of weight(x) (kernel * S)(x), the kernels of
the four nodes around it mixed bilinearly. The weights add up to 1, so that a flat field stays flat and patches have no seams.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import fft

from simulator.errors import require

TILE_PX = 512
WORKERS = -1  # all cores
MOST_SPECTRA = 64  # transforms of kernels that are kept, about 3 MB each
# Rounding of a float32 transform is a share of the tile's largest value; above this many means it takes float64.
HIGH_CONTRAST = 30.0


@dataclass(frozen=True)
class PsfGrid:
    """Kernels at nodes on the planes.

    kernels: (channels, node rows, node columns, size, size), size odd, as light of a point in the middle.
    x_px, y_px: ascending positions of the nodes [px], 0 at the centre of the first pixel; constant beyond the outer ones.
    """

    kernels: np.ndarray
    x_px: np.ndarray
    y_px: np.ndarray

    def __post_init__(self):
        shape = np.shape(self.kernels)
        good = len(shape) == 5 and shape[1:3] == (len(self.y_px), len(self.x_px)) and shape[3] == shape[4] and shape[3] % 2 == 1
        require(good, "shape of the kernels", shape, "give (channels, node rows, node columns, size, size), size odd")


def convolve(planes: np.ndarray, grid: PsfGrid, tile_px: int = TILE_PX, most_spectra: int = MOST_SPECTRA) -> np.ndarray:
    """Planes (channels, rows, columns) through the kernels of their places, same shape and type.

    float32 planes are transformed in float32, less each tile's mean, where no point stands out; float64 ones in float64.
    Outside the planes their edge goes on; a caller who knows better gives a margin of half a kernel and cuts it off.
    tile_px: side of the largest tile. most_spectra: transforms of kernels that are kept at once.
    Raises PhotositeError unless the grid has kernels for every channel, or for one that stands for all.
    """
    known = len(grid.kernels)
    require(known in (1, len(planes)), "channels of the kernels", known, f"give 1 or {len(planes)}, one for each plane")
    result = np.empty_like(planes)
    tiles, reach = list(tiles_of(grid.x_px, grid.y_px, planes.shape[1:], tile_px)), grid.kernels.shape[-1] // 2
    spectra = Spectra(lambda *place: grid.kernels[place][None], reach, tiles, most_spectra)
    for channel, plane in enumerate(planes):
        for tile in tiles:
            source = source_of(_with_margin(plane, tile, reach)[None], spectra)
            result[channel][tile.rows, tile.columns] = gathered(source, tile, spectra, channel % known)
    return result


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


def _with_margin(plane: np.ndarray, tile: Tile, reach: int) -> np.ndarray:
    """Part of a plane with `reach` pixels around the tile; beyond the plane its edge goes on."""
    sides = list(zip((tile.rows, tile.columns), plane.shape, strict=True))
    inside = [slice(max(0, s.start - reach), min(size, s.stop + reach)) for s, size in sides]
    margins = [(reach - (s.start - i.start), reach - (i.stop - s.stop)) for (s, _), i in zip(sides, inside, strict=True)]
    return np.pad(plane[tuple(inside)], margins, mode="edge")
