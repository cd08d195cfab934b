"""Geometry of a blurred frame: its margin, the row bands that are computed one after the other, and their tiles."""

from functools import cached_property

import numpy as np

from simulator.optics.defocus.defocus import PATCH_COLUMNS, PATCH_ROWS, TILE_COLUMNS, TILE_ROWS
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.sensor.camera.camera_sections import Window

BAND_ROWS = 128  # rows that share prefix sums [photosites]
HALF_TILE = TILE_COLUMNS // 2


class TileGrid:
    """Bands and tiles of a frame with its margin (the area), aligned with those of the whole sensor.

    frame: photosites to compute. reach: margin that the blur needs on each side [photosites].
    x, y: the area's first photosite on the sensor. rows: rows of the area.
    set_columns: columns of each column set (`InterleavedColumns`), whatever the samples per photosite.
    """

    def __init__(self, frame: Window, reach: int):
        self.frame, self.reach = frame, reach
        first_band, first_tile = frame.y // BAND_ROWS * BAND_ROWS, frame.x // TILE_COLUMNS * TILE_COLUMNS
        self.first_band = first_band
        self.bands = -(-(frame.y + frame.height - first_band) // BAND_ROWS)
        self.x = (first_tile - self.reach) // TILE_COLUMNS * TILE_COLUMNS
        self.y = (first_band - self.reach) // TILE_ROWS * TILE_ROWS
        right = -(-(frame.x + frame.width) // TILE_COLUMNS) * TILE_COLUMNS + self.reach
        bottom = first_band + self.bands * BAND_ROWS + self.reach
        self.set_columns = -(-(right - self.x) // TILE_COLUMNS) * HALF_TILE
        self.rows = -(-(bottom - self.y) // TILE_ROWS) * TILE_ROWS
        self.margin_x, self.margin_y = frame.x - self.x, frame.y - self.y

    @property
    def layout(self) -> InterleavedColumns:
        """Layout of maps of the area with one sample per photosite."""
        return InterleavedColumns(1, self.rows, self.set_columns)

    def band_layout(self, samples_per_axis: int) -> InterleavedColumns:
        """Layout of a band with its margins, at so many samples per photosite and axis."""
        return InterleavedColumns(samples_per_axis, samples_per_axis * self.rows_with_margins, self.set_columns)

    @property
    def rows_with_margins(self) -> int:
        """Rows of photosites of a band with its margins."""
        return BAND_ROWS + 2 * self.reach

    def band_start(self, band: int) -> int:
        """First row of a band with its margin, in the area."""
        return self.first_band + band * BAND_ROWS - self.reach - self.y

    def band_tiles(self, band: int) -> slice:
        """Range of the tile rows of a band."""
        first = (self.band_start(band) + self.reach) // TILE_ROWS
        return slice(first, first + BAND_ROWS // TILE_ROWS)

    @cached_property
    def grid(self) -> tuple[int, int]:
        """Number of tile rows and columns."""
        return self.rows // TILE_ROWS, self.set_columns // HALF_TILE

    @property
    def patches(self) -> tuple[int, int]:
        """Number of patch rows and columns."""
        return self.rows // PATCH_ROWS, 2 * self.set_columns // PATCH_COLUMNS

    def tiles_in_frame(self) -> np.ndarray:
        """Tiles that hold photosites of the frame: (tile rows, tile columns) bool."""
        first_rows = np.arange(self.grid[0]) * TILE_ROWS - self.margin_y
        first_columns = np.arange(self.grid[1]) * TILE_COLUMNS - self.margin_x
        rows = (first_rows + TILE_ROWS > 0) & (first_rows < self.frame.height)
        columns = (first_columns + TILE_COLUMNS > 0) & (first_columns < self.frame.width)
        return rows[:, None] & columns[None, :]
