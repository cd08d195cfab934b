"""Planes in interleaved columns: stored and read back, against plain indexing, on the host and in a kernel."""

import numpy as np
import pytest

from simulator.optics.geometry.interleaved_columns import InterleavedColumns, column_of, element

ROWS, COLUMNS = 12, 48  # of samples
OVERS = pytest.mark.parametrize("over", [1, 2, 4])


def numbered(layout: InterleavedColumns, planes: int = 3) -> np.ndarray:
    """Planes (planes, rows, columns) of which each sample is its own number."""
    shape = planes, layout.rows, layout.column_sets * layout.set_columns
    return np.arange(np.prod(shape)).reshape(shape)


@OVERS
def test_what_is_stored_is_read_back(over):
    layout = InterleavedColumns.holding(over, ROWS, COLUMNS)
    planes = numbered(layout)
    assert planes.shape[2] == COLUMNS
    assert np.array_equal(layout.decode(layout.encode(planes)), planes)
    assert np.array_equal(layout.decode(layout.encode(planes[0])), planes[0])


@OVERS
def test_a_sample_stands_where_its_column_set_and_row_say(over):
    layout = InterleavedColumns.holding(over, ROWS, COLUMNS)
    planes, stored = numbered(layout), layout.encode(numbered(layout))
    assert stored.shape == layout.shape(3) == (3, 2 * over, ROWS, COLUMNS // (2 * over))
    assert stored.flags.c_contiguous
    for column_set in range(2 * over):
        assert np.array_equal(stored[:, column_set], planes[:, :, column_set :: 2 * over])


@OVERS
def test_an_element_is_the_place_in_the_buffer(over):
    layout = InterleavedColumns.holding(over, ROWS, COLUMNS)
    planes = numbered(layout)
    plane, row, column = np.indices(planes.shape)
    assert np.array_equal(layout.encode(planes).ravel()[layout.element(plane, row, column)], planes)
    sets, _, in_set = np.indices(layout.shape(1)[1:])
    assert np.array_equal(np.sort(column_of(sets, in_set, over)[:, 0].ravel()), np.arange(COLUMNS))


@OVERS
def test_steps_to_the_left_go_back_in_the_buffer(over):
    """Distances from a photosite's own column, which kernels add to its place: the same on either side of it."""
    layout = InterleavedColumns.holding(over, ROWS, COLUMNS)
    home = 4 * 2 * over  # first sample of a photosite in an even column
    for step in range(-3 * over, 3 * over):
        distance = element(0, 1, step, over, ROWS, layout.set_columns)
        assert layout.element(1, 3, home) + distance == layout.element(1, 4, home + step)


@pytest.mark.parametrize(("over", "columns", "set_columns"), [(1, 7, 4), (2, 9, 3), (4, 8, 1), (4, 9, 2)])
def test_there_is_room_for_all_columns(over, columns, set_columns):
    layout = InterleavedColumns.holding(over, ROWS, columns)
    assert layout.shape(2) == (2, 2 * over, ROWS, set_columns)
    assert layout.work_size(2) == (set_columns, ROWS, 4 * over)


@OVERS
def test_the_kernels_find_the_same_element(bench, over):
    layout = InterleavedColumns.holding(over, ROWS, COLUMNS)
    plane, row, column = (index.ravel().astype(np.uint32) for index in np.indices(numbered(layout).shape))
    place = (
        f"(uint)(row_start(COLUMN_SETS * plane + column_set((int)column), row, {ROWS}, {layout.set_columns})"
        " + column_in_set((int)column))"
    )
    arrays = {"plane": plane, "row": row, "column": column}
    found = bench.header("interleaved_columns.h", place, arrays, {"OVER": over, "SPAN": 1}, np.uint32)
    assert np.array_equal(found, layout.element(plane, row, column))
