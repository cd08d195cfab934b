"""Division of frames into tiles, and the selection of tiles for one launch.

A work-group of the sensor kernel is one pair of rows of a tile; the device limits how long a row may be.
"""

import numpy as np

TILE_HEIGHT = 64
FIRST_ROW, SECOND_ROW, BOTH_ROWS = 1, 2, 3  # rows of a pair, as kernels/sensor_part.h numbers them


def split_evenly(extent: int, size: int) -> np.ndarray:
    """Return the borders (parts + 1,) that split 0 to extent into the fewest nearly equal parts of at most `size`."""
    parts = -(-extent // size)
    return np.linspace(0, extent, parts + 1).astype(np.int64)


def column_edges(width: int, size: int, vector: int) -> np.ndarray:
    """Return borders (tiles + 1,) that split columns 0 to width into nearly equal tiles of multiples of `vector` columns.

    The last tile also takes the remainder. size: largest width of a tile without that remainder; at least `vector`.
    """
    vectors = max(width // vector, 1)
    return np.append(vector * split_evenly(vectors, max(size // vector, 1))[:-1], width)


def pair_edges(first: int, extent: int, size: int) -> np.ndarray:
    """Return borders (tiles + 1,) of tile rows from 0 to extent that do not separate pairs of sensor rows (2 n, 2 n + 1).

    first: sensor row of row 0. A single row of a pair at either end is a tile row of its own. size: 2 or more.
    """
    start = first % 2 if extent > 1 else 0
    pairs = (extent - start) // 2
    inner = start + 2 * split_evenly(pairs, size // 2) if pairs else np.array([start])
    return np.unique(np.concatenate([[0], inner, [extent]])).astype(np.int64)


def rows_of_pairs(first: int, rows: np.ndarray) -> np.ndarray:
    """Return which rows of its pairs each tile row of `pair_edges` contains: FIRST_ROW, SECOND_ROW or BOTH_ROWS."""
    return np.where(np.diff(rows) > 1, BOTH_ROWS, np.where((rows[:-1] + first) % 2 == 0, FIRST_ROW, SECOND_ROW))


def stack_edges(firsts: list[int], extent: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the borders of `pair_edges` for frames stacked vertically, and the `rows_of_pairs` of each tile row.

    firsts: sensor row of row 0 of each frame. extent: rows of a frame.
    """
    edges = {parity: pair_edges(parity, extent, size) for parity in {first % 2 for first in firsts}}
    masks = {parity: rows_of_pairs(parity, rows) for parity, rows in edges.items()}
    inner = [place * extent + edges[first % 2][:-1] for place, first in enumerate(firsts)]
    return np.concatenate([*inner, [len(firsts) * extent]]), np.concatenate([masks[first % 2] for first in firsts])


def join_pairs(columns: np.ndarray, rows: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Return column, row, width and height (tiles, 4) int64 of the wanted tiles.

    Columns 2 n and 2 n + 1 are one tile where both are wanted: wide tiles start fewer work-groups, narrow ones have means that
    differ less.
    columns, rows: borders of the tiles. wanted: (tile rows, tile columns) bool.
    """
    paired = wanted.shape[1] // 2 * 2
    joined, single = np.zeros_like(wanted), wanted.copy()
    joined[:, :paired:2] = wanted[:, 0:paired:2] & wanted[:, 1:paired:2]
    single[:, :paired] &= ~joined[:, :paired:2].repeat(2, axis=1)
    tile_y, tile_x = np.nonzero(joined | single)
    right = columns[tile_x + 1 + joined[tile_y, tile_x]]
    return np.stack([columns[tile_x], rows[tile_y], right - columns[tile_x], np.diff(rows)[tile_y]], axis=-1)
