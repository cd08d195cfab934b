"""Cutting frames into tiles: work-groups of equal shape, and which of them a pass needs.

A work-group of the sensor pass is one row of a tile; the device says how long a row may be.
"""

import numpy as np

TILE_HEIGHT = 64


def edges(extent: int, size: int) -> np.ndarray:
    """Borders of the fewest nearly equal parts of at most `size`: (parts + 1,) from 0 to extent."""
    parts = -(-extent // size)
    return np.linspace(0, extent, parts + 1).astype(np.int64)


def pair_edges(first: int, extent: int, size: int) -> np.ndarray:
    """Borders of row tiles that keep pairs of sensor rows (2 n, 2 n + 1) together: (tiles + 1,) from 0 to extent.

    first: sensor row of row 0. Half a pair at either end is a tile of its own. size: 2 or more.
    """
    start = first % 2 if extent > 1 else 0
    pairs = (extent - start) // 2
    inner = start + 2 * edges(pairs, size // 2) if pairs else np.array([start])
    return np.unique(np.concatenate([[0], inner, [extent]])).astype(np.int64)


def rows_of_pairs(first: int, rows: np.ndarray) -> np.ndarray:
    """Which rows of its pairs each tile of `pair_edges` holds: 1 the first, 2 the second, 3 both."""
    return np.where(np.diff(rows) > 1, 3, np.where((rows[:-1] + first) % 2 == 0, 1, 2))


def stack_edges(firsts: list[int], extent: int, size: int) -> tuple[np.ndarray, np.ndarray]:
    """Borders of `pair_edges` for frames that lie one below the other, and the rows of pairs of each tile between them.

    firsts: sensor row of row 0 of each frame. extent: rows of a frame.
    """
    frames = [pair_edges(first, extent, size) for first in firsts]
    inner = [place * extent + edges[:-1] for place, edges in enumerate(frames)]
    pairs = [rows_of_pairs(first, edges) for first, edges in zip(firsts, frames, strict=True)]
    return np.concatenate([*inner, [len(firsts) * extent]]), np.concatenate(pairs)


def group_by_shape(columns: np.ndarray, rows: np.ndarray, wanted: np.ndarray) -> dict[tuple[int, int], np.ndarray]:
    """Wanted tiles by (width, height): (tiles, 2) uint32 of x, y. wanted: (tile rows, tile columns) bool."""
    tile_y, tile_x = np.nonzero(wanted)
    widths, heights = np.diff(columns)[tile_x], np.diff(rows)[tile_y]
    corners = np.stack([columns[tile_x], rows[tile_y]], axis=-1).astype(np.uint32)
    return {
        (int(width), int(height)): corners[(widths == width) & (heights == height)]
        for width, height in sorted(set(zip(widths.tolist(), heights.tolist(), strict=True)))
    }
