"""Geometry of a blurred frame: its margin, the bands of rows that are computed one after the other, and their tiles."""

from functools import cached_property

import numpy as np

from simulator.optics.defocus.defocus import PATCH_COLUMNS, PATCH_ROWS, TILE_COLUMNS, TILE_ROWS
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.sensor.camera.camera_sections import Window

BAND_ROWS = 128  # rows that share running sums
HALF_TILE = TILE_COLUMNS // 2


class BlurFrame:
    """Geometry of the frame with its margin, cut along bands and tiles of the whole sensor.

    frame: photosites to compute. reach: margin that the blur needs on either side [photosites].
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
        """Of maps with one sample per photosite."""
        return InterleavedColumns(1, self.rows, self.set_columns)

    def strip_layout(self, over: int) -> InterleavedColumns:
        """Of a band with its margins at `over` x `over` samples per photosite."""
        return InterleavedColumns(over, over * self.strip_rows, self.set_columns)

    @property
    def strip_rows(self) -> int:
        """Rows of photosites of a band with its margins."""
        return BAND_ROWS + 2 * self.reach

    def strip_row(self, band: int) -> int:
        """Row of the area at which a band's strip begins."""
        return self.first_band + band * BAND_ROWS - self.reach - self.y

    def band_tiles(self, band: int) -> slice:
        """Tile rows of a band."""
        first = (self.strip_row(band) + self.reach) // TILE_ROWS
        return slice(first, first + BAND_ROWS // TILE_ROWS)

    @cached_property
    def grid(self) -> tuple[int, int]:
        """Tile rows and columns."""
        return self.rows // TILE_ROWS, self.set_columns // HALF_TILE

    @property
    def patches(self) -> tuple[int, int]:
        """Patch rows and columns."""
        return self.rows // PATCH_ROWS, 2 * self.set_columns // PATCH_COLUMNS

    def inside(self) -> np.ndarray:
        """Tiles that hold photosites of the frame: (tile rows, tile columns) bool."""
        first_rows = np.arange(self.grid[0]) * TILE_ROWS - self.margin_y
        first_columns = np.arange(self.grid[1]) * TILE_COLUMNS - self.margin_x
        rows = (first_rows + TILE_ROWS > 0) & (first_rows < self.frame.height)
        columns = (first_columns + TILE_COLUMNS > 0) & (first_columns < self.frame.width)
        return rows[:, None] & columns[None, :]
