"""Least and greatest value of every tile column."""

import numpy as np
import pytest
from helpers.kernel_bench import device_like

from simulator.sensor.kernel import tiles
from simulator.sensor.kernel.kernel_launch import tile_extremes


@pytest.mark.parametrize("settings", [{}, {"row_px": 16, "span": 1}])
@pytest.mark.parametrize(("height", "width"), [(1, 5), (31, 7), (100, 64), (33, 130), (65, 1031)])
def test_extremes_are_those_of_numpy(device, settings, height, width):
    """A work-item runs along a row, or takes a column as on a GPU."""
    image = np.random.default_rng(height).normal(size=(height, width)).astype(np.float32)
    rows = tiles.split_evenly(height, tiles.TILE_HEIGHT)
    found = tile_extremes(device_like(device, **settings), device.upload(image), width, rows)
    assert np.array_equal(found[0], np.minimum.reduceat(image, rows[:-1], axis=0))
    assert np.array_equal(found[1], np.maximum.reduceat(image, rows[:-1], axis=0))
