"""What lies within reach of the tiles of a band."""

import numpy as np
import pytest

from simulator.optics.passes.psf_bands import EXTREME_ROWS, HALF_TILE, TILE_ROWS, join_within, split_into_bands
from simulator.sensor.camera.camera_sections import Window


@pytest.mark.parametrize("parts", [1, 4])
@pytest.mark.parametrize("reach_px", [0, 7, 16])
def test_extremes_join_all_that_lies_within_reach_of_a_part_of_a_tile(parts, reach_px):
    (band,) = split_into_bands(Window(130, 40, 300, 33), 16, 1)
    values = np.random.default_rng(0).normal(size=(band.rows // EXTREME_ROWS, band.layout.set_columns))
    found = join_within(band, values, np.maximum, reach_px, parts)
    assert found.shape == (len(band.tiles), parts)
    wide, beside, beyond = HALF_TILE // parts, -(-reach_px // 2), -(-reach_px // EXTREME_ROWS)
    for number, (row, column) in enumerate(band.tiles):
        first = row * TILE_ROWS // EXTREME_ROWS
        near = values[first - beyond : first + TILE_ROWS // EXTREME_ROWS + beyond]
        for part in range(parts):
            left = HALF_TILE * column + wide * part
            assert found[number, part] == near[:, left - beside : left + wide + beside].max()
