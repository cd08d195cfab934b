"""Geometry of a blurred frame: its tiles, the margin around them, and the row bands that are computed one after the other."""

import math
from dataclasses import dataclass, replace

from simulator.optics.defocus.defocus import PATCH_COLUMNS, PATCH_ROWS, TILE_COLUMNS, TILE_ROWS
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.sensor.camera.camera_sections import Window

BAND_ROWS = 128  # rows that share prefix sums [photosites]
HALF_TILE = TILE_COLUMNS // 2
MARGIN_COLUMNS = 32  # the margin is a multiple of it: a cell of highlights, and four patches [photosites]


@dataclass(frozen=True)
class BandRows:
    """Rows of samples of a band with its margins.

    first: row of the sensor. count: of photosites. tiles: range of the tile rows that are computed.
    """

    first: int
    count: int
    tiles: slice


def band_sizes(layout: InterleavedColumns, layers: int, planes: int, maps: int) -> tuple[int, int, int]:
    """Return the number of samples of a band's planes, of its running sums, and of its blur radii.

    layout: of a plane of the band. layers: of the scene. planes: of a layer, its colours and perhaps its coverage. maps: layers
    whose blur radius varies. Sums are of one layer at a time; they have a row more, the sum of all rows.
    """
    sums = replace(layout, rows=layout.rows + 1).shape(planes)
    return math.prod(layout.shape(layers * planes)), math.prod(sums), math.prod(layout.shape(max(maps, 1)))


class TileGrid:
    """Tiles and bands of a frame, aligned with those of the whole sensor, and the area around the tiles that their blur reads.

    frame: photosites to compute. reach: how far a blur circle reaches [photosites].
    tile_x, tile_y: first photosite of the first tile on the sensor. grid: number of tile rows and columns.
    margin_columns, margin_rows: of the area around the tiles, on each side: the reach, and the patch into which it extends.
    x, y: the area's first photosite on the sensor. rows: rows of the area.
    set_columns: columns of each column set (`InterleavedColumns`), whatever the samples per photosite.
    """

    def __init__(self, frame: Window, reach: int):
        self.frame, self.reach = frame, reach
        right, bottom = frame.x + frame.width, frame.y + frame.height
        self.tile_x, self.tile_y = frame.x // TILE_COLUMNS * TILE_COLUMNS, frame.y // TILE_ROWS * TILE_ROWS
        self.grid = -(-(bottom - self.tile_y) // TILE_ROWS), -(-(right - self.tile_x) // TILE_COLUMNS)
        self.first_band = frame.y // BAND_ROWS * BAND_ROWS
        self.bands = -(-(bottom - self.first_band) // BAND_ROWS)
        self.margin_columns = -(-(reach + PATCH_COLUMNS) // MARGIN_COLUMNS) * MARGIN_COLUMNS
        self.margin_rows = -(-(reach + PATCH_ROWS) // PATCH_ROWS) * PATCH_ROWS
        self.x, self.y = self.tile_x - self.margin_columns, self.tile_y - self.margin_rows
        self.set_columns = self.grid[1] * HALF_TILE + self.margin_columns
        self.rows = self.grid[0] * TILE_ROWS + 2 * self.margin_rows

    @property
    def layout(self) -> InterleavedColumns:
        """Layout of maps of the area with one sample per photosite."""
        return InterleavedColumns(1, self.rows, self.set_columns)

    @property
    def patches(self) -> tuple[int, int]:
        """Number of patch rows and columns of the area."""
        return self.rows // PATCH_ROWS, 2 * self.set_columns // PATCH_COLUMNS

    @property
    def margin_patches(self) -> tuple[int, int]:
        """Patch rows and columns of the area before the first tile, and after the last."""
        return self.margin_rows // PATCH_ROWS, self.margin_columns // PATCH_COLUMNS

    def band_rows(self, band: int, *, whole: bool) -> BandRows:
        """Return the rows of a band with its margins.

        whole: all of them, as running sums need them; else those around its tiles, from a patch of the whole band on and to the
        end of the patches that blur circles touch.
        """
        first = self.first_band + band * BAND_ROWS
        begin, end = ((row - self.tile_y) // TILE_ROWS for row in (first, first + BAND_ROWS))
        tiles = slice(max(begin, 0), min(end, self.grid[0]))
        if whole:
            return BandRows(first - self.reach, BAND_ROWS + 2 * self.reach, tiles)
        above, below = (self.tile_y + TILE_ROWS * row for row in (tiles.start, tiles.stop))
        needed = -(-(below - above + 2 * self.reach + PATCH_ROWS) // PATCH_ROWS) * PATCH_ROWS
        return BandRows(above - self.reach, min(needed, first + BAND_ROWS + 2 * self.reach - above), tiles)

    def band_layout(self, samples_per_axis: int, *, whole: bool) -> InterleavedColumns:
        """Layout of the band of most rows with its margins, at so many samples per photosite and axis."""
        rows = max(self.band_rows(band, whole=whole).count for band in range(self.bands))
        return InterleavedColumns(samples_per_axis, samples_per_axis * rows, self.set_columns)

    def read_area(self) -> Window:
        """Return all photosites of the sensor whose light or depth is read for the frame."""
        top = min(self.y, self.first_band - self.reach)
        bottom = max(self.y + self.rows, self.first_band + self.bands * BAND_ROWS + self.reach)
        return Window(self.x, top, 2 * self.set_columns, bottom - top)
