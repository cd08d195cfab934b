"""Bands of rows in which the light of a frame is gathered with point spread functions, with tables of the nodes around them."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

BAND_ROWS = 256  # photosites
TILE_ROWS, TILE_COLUMNS = 16, 128
HALF_TILE = TILE_COLUMNS // 2
TERM = np.dtype([("number", "u4"), ("node_column", "u4"), ("radius", "f4"), ("rise", "f4"), ("fall", "f4")])
NO_RADIUS = 1e30  # of a term without weight: no photosite is so far out of focus
EXTREME_ROWS = 4  # rows of photosites that share their least and greatest value; a divisor of TILE_ROWS
STEP_PARTS = 4  # side by side, of a tile whose kernels reach several surfaces


@dataclass(frozen=True)
class PsfBand:
    """A band of rows of a frame with its margins, aligned with the tiles of the whole sensor.

    frame: photosites that are wanted. row: first row of the band on the sensor. margin_rows: above and below [photosites].
    over: samples per photosite and axis.
    """

    frame: Window
    row: int
    margin_rows: int
    over: int

    @property
    def x(self) -> int:
        """First column of the band with its margin, on the sensor [photosites]."""
        return (self.frame.x // TILE_COLUMNS - 1) * TILE_COLUMNS

    @property
    def y(self) -> int:
        """First row of the band with its margin, on the sensor [photosites]."""
        return self.row - self.margin_rows

    @property
    def tile_columns(self) -> int:
        """Tiles side by side, without the margin of one on each side."""
        return -(-(self.frame.x + self.frame.width) // TILE_COLUMNS) - self.frame.x // TILE_COLUMNS

    @property
    def rows(self) -> int:
        """Rows with the margins [photosites]."""
        return BAND_ROWS + 2 * self.margin_rows

    @property
    def layout(self) -> InterleavedColumns:
        """Layout of the samples of the band with its margins."""
        return InterleavedColumns(self.over, self.over * self.rows, HALF_TILE * (self.tile_columns + 2))

    @cached_property
    def tiles(self) -> list[tuple[int, int]]:
        """Row and column of the tiles that hold photosites of the frame, from the first of the margin on."""
        rows = [
            self.margin_rows // TILE_ROWS + number
            for number in range(BAND_ROWS // TILE_ROWS)
            if 0 < self.row + TILE_ROWS * (number + 1) - self.frame.y < self.frame.height + TILE_ROWS
        ]
        return [(row, column) for row in rows for column in range(1, self.tile_columns + 1)]

    def fields(self, channels: int, cfa: Cfa) -> dict[str, int]:
        """Fields of `struct row_band` of kernels/row_band.h. channels: colour planes of a layer."""
        layout = self.layout
        return {
            "sample_rows": layout.rows,
            "set_columns": layout.set_columns,
            "frame_x": self.x - self.frame.x,
            "frame_y": self.y - self.frame.y,
            "width": self.frame.width,
            "height": self.frame.height,
            "light_row": 0,
            "channels": channels,
            "cfa": cfa.packed(self.frame.x, self.frame.y),
        }


def split_into_bands(frame: Window, margin_px: int, over: int) -> list[PsfBand]:
    """Bands of a frame whose margins hold margin_px rows at least."""
    margin_rows = -(-margin_px // TILE_ROWS) * TILE_ROWS
    first, last = frame.y // BAND_ROWS, -(-(frame.y + frame.height) // BAND_ROWS)
    return [PsfBand(frame, BAND_ROWS * number, margin_rows, over) for number in range(first, last)]


def read_by_bands(frame: Window, margin_px: int, over: int) -> Window:
    """Return the photosites that the bands of a frame hold with their margins; arguments of `split_into_bands`."""
    bands = split_into_bands(frame, margin_px, over)
    first, last = bands[0], bands[-1]
    return Window(first.x, first.y, 2 * first.layout.set_columns, last.y + last.rows - first.y)


def node_limits(band: PsfBand, limits: np.ndarray, x_px: np.ndarray, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Argument `limits` of kernels/psf_gather.cl, and the weights of the node columns in it (node columns, columns) float32.

    limits: by channel. x_px, y_px: columns and rows of the nodes on the sensor [photosites].
    """
    columns, rows = band.x + np.arange(2 * band.layout.set_columns), band.y + np.arange(band.rows)
    place = np.interp(rows, y_px, np.arange(len(y_px)))
    across = np.array([np.interp(columns, x_px, one) for one in np.eye(len(x_px))]).astype(np.float32)
    return np.concatenate([limits, place, across.ravel()]).astype(np.float32), across


def node_rows(band: PsfBand, y_px: np.ndarray) -> slice:
    """Node rows from that above a band's first row of photosites to that below its last, of a frame or a crop alike."""
    first, last = np.interp((band.row, band.row + BAND_ROWS - 1), y_px, np.arange(len(y_px)))
    return slice(int(first), max(math.ceil(last), int(first)) + 1)


def tile_nodes(band: PsfBand, across: np.ndarray, parts: int = 1) -> np.ndarray:
    """Whether a node column has weight in a part of a tile, (tiles, parts, node columns). across: of `node_limits`."""
    present = np.logical_or.reduce(across.reshape(len(across), -1, parts, TILE_COLUMNS // parts) > 0.0, axis=-1)
    return np.moveaxis(present[:, [column for _, column in band.tiles]], 0, -1)


def join_within(band: PsfBand, values: np.ndarray, join: np.ufunc, reach_px: int, parts: int = 1) -> np.ndarray:
    """Join the values that lie within reach_px photosites of each tile, (tiles, parts) in the order of `PsfBand.tiles`.

    values: (groups of EXTREME_ROWS rows, columns of a set) of a band, each for two photosites side by side.
    parts: of each tile, side by side.
    """
    beside, beyond, down, across = (
        -(-reach_px // 2),
        -(-reach_px // EXTREME_ROWS),
        TILE_ROWS // EXTREME_ROWS,
        HALF_TILE // parts,
    )
    rows = down * np.array(sorted({row for row, _ in band.tiles})) - beyond
    values = values[:, HALF_TILE - beside :]
    found = values[rows]
    for row in range(1, down + 2 * beyond):
        join(found, values[rows + row], out=found)
    found = _join_beside(found, join, across + 2 * beside)
    return np.ascontiguousarray(found[:, : across * parts * band.tile_columns : across]).reshape(-1, parts)


def _join_beside(values: np.ndarray, join: np.ufunc, count: int) -> np.ndarray:
    """Join each value with the next count - 1 of its row, by intervals that double: (rows, columns - count + 1)."""
    length = 1
    while length < count:
        step = min(length, count - length)
        values = join(values[:, :-step], values[:, step:])
        length += step
    return values


def join_extremes(band: PsfBand, extremes: np.ndarray, reach_px: int, parts: int = 1) -> np.ndarray:
    """Least and greatest value within reach of each part of each tile, (2, tiles, parts).

    extremes: (2, rows, columns) by places of `join_within`.
    """
    joined = zip(extremes, (np.minimum, np.maximum), strict=True)
    return np.stack([join_within(band, values, join, reach_px, parts) for values, join in joined])


def make_terms(
    band: PsfBand,
    present: np.ndarray,
    radii_px: tuple[float, ...],
    kept: np.ndarray,
    ranges: np.ndarray | None,
    together: int = 1,
) -> tuple[np.ndarray, np.ndarray]:
    """Parts of tiles (tiles, parts, 4) uint32 and terms of kernels/psf_gather.cl, in the order of `PsfBand.tiles`.

    present: of `tile_nodes`. radii_px: blur radii of the kernels, ascending. kept: (radii,) whether the kernels of a radius are
        not 0, and so are terms.
    ranges: (2, tiles, parts) least and greatest blur radius in each part of a tile; None: one kernel for all
        radii, and one part.
    together: the number of terms of a part is a multiple of this; terms without weight are added.
    """
    radii = np.array(radii_px)
    below, above = np.r_[-np.inf, radii[:-1]], np.r_[radii[1:], np.inf]
    held = np.ones((len(present), 1, 1), bool)
    if ranges is not None:
        least, greatest = ranges[..., np.newaxis]
        held = np.less(least, above) & np.greater(greatest, below) & kept
    parts = held.shape[1]
    tile, part, number, node = np.nonzero(held[..., None] & present[:, None, None, :])
    count = (held.sum(axis=2) * present.sum(axis=1)[:, None]).ravel()
    room = -(-count // together) * together
    first_term = np.cumsum(room) - room
    terms = np.zeros(int(room.sum()), TERM)
    terms["radius"], terms["rise"] = NO_RADIUS, 1.0
    at = np.repeat(first_term - (np.cumsum(count) - count), count) + np.arange(len(tile))
    terms["number"][at], terms["node_column"][at], terms["radius"][at] = number, node, radii[number]
    terms["rise"][at], terms["fall"][at] = 1.0 / (radii - below)[number], 1.0 / (above - radii)[number]
    rows, columns = np.repeat(np.array(band.tiles).reshape(-1, 2), parts, axis=0).T
    first = HALF_TILE * columns + HALF_TILE // parts * np.tile(np.arange(parts), len(present))
    found = np.stack([first, TILE_ROWS * rows, first_term, room], axis=-1).astype(np.uint32)
    return found.reshape(len(present), parts, 4), terms
