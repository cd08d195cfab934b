"""What lies within reach of the tiles of a band."""

import numpy as np
import pytest

from simulator.optics.passes.psf_bands import EXTREME_ROWS, HALF_TILE, TILE_ROWS, join_within, make_terms, split_into_bands
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


def test_the_terms_of_a_tile_are_the_kernels_around_its_blur_radii_that_are_not_zero():
    """Kernels of two sizes share their outer radii, where those of the other size are 0: no tile gathers with these."""
    (band,) = split_into_bands(Window(0, 0, 384, 16), 16, 1)
    radii, kept = (-1.0, 0.0, 1.0, 2.0, 3.0), np.array([True, True, True, True, False])
    ranges = np.array([[0.2, -0.5, 3.5], [0.8, 1.5, 4.0]])[..., None]
    for together, room in ((1, [2, 4, 0]), (2, [2, 4, 0]), (3, [3, 6, 0])):
        tiles, terms = make_terms(band, np.ones((3, 1), bool), radii, kept, ranges, together)
        assert tiles[:, 0, 3].tolist() == room
        found = [terms["radius"][first : first + count] for _, _, first, count in tiles[:, 0]]
        assert [[radius for radius in one if radius in radii] for one in found] == [[0.0, 1.0], [-1.0, 0.0, 1.0, 2.0], []]
        for one in (0.2, 0.8, 4.0):  # what is added has no weight
            unused = terms[~np.isin(terms["radius"], radii)]
            assert (1.0 - np.abs(one - unused["radius"]) * np.minimum(unused["rise"], 1.0) < 0.0).all()
