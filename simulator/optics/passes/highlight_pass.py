"""Removes highlights from a row band's sampled planes, and adds their blur spots to the blocks that they reach."""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, Defocus
from simulator.optics.defocus.highlights import (
    BRIGHT,
    LAMP,
    STEPS_PER_PX,
    Highlights,
    find_reaching,
    lamp_steps,
    no_highlights,
    radius_slopes,
    select_brightest,
    shows_dots,
    spot_weights,
)
from simulator.optics.geometry.interleaved_columns import InterleavedColumns, column_of
from simulator.optics.passes.radius_statistics import RadiusMaps
from simulator.optics.passes.tile_grid import MARGIN_COLUMNS, TileGrid
from simulator.optics.pupil.pupil import Pupil


class Band(Protocol):
    """What the pass reads of a row band, `simulator.optics.passes.row_band.RowBand`."""

    device: Device
    defocus: Defocus
    area: TileGrid
    maps: RadiusMaps
    planes: list[Buffer]
    layout: InterleavedColumns
    samples_per_axis: int
    channels: int
    layer_planes: int
    sampled: Buffer
    radius: Buffer
    defines: dict[str, object]


class HighlightPass:
    """Highlights of a row band and the blocks that they reach.

    first_row: row of the sensor at the band's first row. places: (blocks, 4) uint32 as in kernels/highlights.cl.
    limit: (channels,) electron radiance above which a sample is a highlight [e- s^-1 um^-2 sr^-1].
    lamps: whether the limit is that of lamps, LAMP times the mean: all of them are highlights, whatever their radius.
    """

    def __init__(self, band: Band, first_row: int, places: np.ndarray, limit: np.ndarray, *, lamps: bool) -> None:
        self.band, self.places = band, places
        self.origin_px = band.area.x, first_row
        self.kept = limit / (LAMP if lamps else BRIGHT)
        self.highlights = self._find_highlights(limit)
        self.steps_per_px: float | np.ndarray = STEPS_PER_PX
        if lamps:
            self.steps_per_px = lamp_steps(self.highlights, band.samples_per_axis, band.defocus.accuracy)
        else:
            visible = self.highlights.select(shows_dots(self.highlights, band.defocus.accuracy))
            self.highlights = select_brightest(visible, band.samples_per_axis, first_row)
        self.reaching, self.counts = find_reaching(
            self.highlights, self._pupil, band.samples_per_axis, places[:, 1].astype(int), 2 * places[:, 0].astype(int)
        )

    @property
    def any(self) -> bool:
        """Whether there is any highlight."""
        return len(self.highlights.rows) > 0

    @property
    def _pupil(self) -> Pupil:
        return self.band.defocus.pupil

    def _find_highlights(self, limit: np.ndarray) -> Highlights:
        """Samples above the limit."""
        band, layout, limit = self.band, self.band.layout, limit.astype(np.float32)
        marks, parts_by_layer, maps = self._mark(limit), [], 0
        if not marks.any():
            return no_highlights(band.channels)
        with band.device.view(band.sampled, layout.shape(len(band.planes) * band.layer_planes), np.float32) as sampled:
            for layer, px in enumerate(band.defocus.radii_px):
                light = sampled[layer * band.layer_planes :][: band.channels]
                column_set, row, column = _bright_samples(light, limit, marks[layer])
                excess = np.maximum(light[:, column_set, row, column] - self.kept[:, None], 0.0)
                columns, layers = np.asarray(column_of(column_set, column, layout.over)), np.full(len(row), layer)
                own, slopes = np.full(len(row), 0.0 if np.ndim(px) else px, np.float32), np.zeros((2, len(row)))
                if isinstance(px, np.ndarray):
                    if len(row):
                        with band.device.view(band.radius, layout.shape(maps + 1), np.float32) as radius:
                            own = radius[maps, column_set, row, column]
                            slopes = radius_slopes(layout.decode(radius[maps]), row, columns, layout.over)
                    maps += 1
                exact = np.full(len(row), np.ndim(px) == 0)
                parts_by_layer.append((row, columns, layers, own, slopes, exact, excess))
        return Highlights(*(np.concatenate(parts, axis=-1) for parts in zip(*parts_by_layer, strict=True)))

    def _mark(self, limit: np.ndarray) -> np.ndarray:
        """Parts of MARGIN_COLUMNS samples that hold any above the limit, (layers, column sets, rows, parts) bool."""
        band, layout = self.band, self.band.layout
        shape = len(band.planes), layout.column_sets, layout.rows, layout.set_columns // MARGIN_COLUMNS
        marks, limits = band.device.empty(shape, np.uint8), band.device.upload(limit)
        size = shape[3], shape[2], shape[0] * shape[1]
        self._run("highlights_mark", size, marks=marks, limits=limits, channels=band.channels)
        return band.device.download(marks, shape, np.uint8).astype(bool)

    def take(self) -> None:
        """Remove the highlights' excess radiance from the band's sampled planes, in place."""
        band, highlights = self.band, self.highlights
        plane = highlights.layers * band.layer_planes + np.arange(band.channels)[:, None]
        element = np.ravel(band.layout.element(plane, highlights.rows, highlights.columns))
        most = np.repeat(self.kept.astype(np.float32), len(highlights.rows))
        self._run("highlights_take", (len(element),), **self._upload({"places": element.astype(np.uint32), "most": most}))

    def spread(self, slabs: Buffer, light: Buffer, bands: Sequence[dict[str, int]]) -> None:
        """Add the highlights' spots to mosaics in the blocks that they reach.

        light: (mosaics, height, width) float32. bands: of each mosaic, fields of `struct row_band` of kernels/row_band.h.
        """
        highlights, counts = self.highlights, self.counts[self.counts > 0]
        if not len(counts):
            return
        weights, first, side = spot_weights(
            highlights,
            self._pupil,
            self.band.samples_per_axis,
            self.band.defocus.eyes,
            self.origin_px,
            self.band.defocus.area,
            self.steps_per_px,
        )
        spots = [highlights.columns, highlights.rows, highlights.layers, first, side]
        arrays = {
            "blocks": self.places[self.counts > 0],
            "ranges": np.stack([np.cumsum(counts) - counts, counts], axis=-1).astype(np.uint32),
            "reaching": self.reaching.astype(np.uint32),
            "highlights": np.stack(spots, axis=-1).astype(np.int32),
            "excess": np.vstack([highlights.radii_px, highlights.slopes, highlights.excess]).T.astype(np.float32),
            "weights": weights,
        }
        size = (BLOCK_COLUMNS // 2, 2 * BLOCK_ROWS, len(counts))
        buffers = self._upload(arrays)
        buffers |= {"radius": self.band.radius, "slabs": slabs, "light": light}
        for band in bands:
            self._run("highlights_spread", size, **buffers, band=band)

    def _upload(self, arrays: dict[str, np.ndarray]) -> dict[str, Buffer]:
        return {key: self.band.device.upload(np.ascontiguousarray(array)) for key, array in arrays.items()}

    def _run(self, name: str, size: tuple[int, ...], **arguments: object) -> None:
        device = self.band.device
        kernel = device.kernel(name, {**self.band.defines, "CHUNK": MARGIN_COLUMNS}, file="highlights.cl")
        device.run(kernel, size, None, sampled=self.band.sampled, **arguments)


def _bright_samples(light: np.ndarray, limit: np.ndarray, marks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Column sets, rows and columns of the samples that are above the limit in any channel, in the order of memory.

    light: (channels, column sets, rows, set columns). marks: (column sets, rows, parts) where there may be any.
    """
    column_set, row, part = np.nonzero(marks)
    parts = light.reshape(*light.shape[:-1], marks.shape[-1], MARGIN_COLUMNS)[:, column_set, row, part]
    number, column = np.nonzero((parts > limit[:, None, None]).any(axis=0))
    return column_set[number], row[number], part[number] * MARGIN_COLUMNS + column
