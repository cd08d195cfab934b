"""Least and greatest values of groups of rows, as NumPy finds them."""

import numpy as np

from simulator.optics.geometry.interleaved_columns import InterleavedColumns


def test_groups_of_rows_have_their_least_and_greatest_value(device):
    layout, rows = InterleavedColumns(2, 24, 64), 4
    values = np.random.default_rng(0).normal(size=layout.shape(1)[1:]).astype(np.float32)
    sets, groups = layout.column_sets, layout.rows // layout.over // rows
    found = device.empty((2, sets, groups, layout.set_columns), np.float32)
    kernel = device.kernel("psf_extremes", {"OVER": 2, "EXTREME_ROWS": rows}, file="psf_extremes.cl")
    device.run(kernel, (layout.set_columns, groups, sets), None, planes=device.upload(values), extremes=found)
    grouped = values.reshape(sets, groups, layout.over * rows, layout.set_columns)
    expected = np.stack([grouped.min(axis=2), grouped.max(axis=2)])
    np.testing.assert_array_equal(device.download(found, expected.shape, np.float32), expected)
