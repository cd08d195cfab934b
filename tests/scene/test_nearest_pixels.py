"""The nearest of some pixels, by comparing all pairs."""

import numpy as np
import pytest

from simulator.scene.nearest_pixels import MOST_STEPS, nearest_pixels

REACHES = [0.5, 1.0, 2.9, 6.0, float(MOST_STEPS), MOST_STEPS + 1.0]  # the last one by SciPy's transform


def by_all_pairs(places):
    """Row, column and squared distance of the nearest place; of equal ones that of the least column, then of the least row."""
    rows, columns = np.nonzero(places.T)[::-1]
    y, x = np.mgrid[: places.shape[0], : places.shape[1]][..., None]
    squared = (y - rows) ** 2 + (x - columns) ** 2
    first = squared.argmin(axis=-1)
    return rows[first], columns[first], squared.min(axis=-1)


@pytest.mark.parametrize("reach_px", REACHES)
@pytest.mark.parametrize(("height", "width"), [(1, 40), (40, 1), (30, 31), (2, 300)])
def test_it_is_the_nearest_one_within_reach_and_a_farther_one_beyond(height, width, reach_px):
    rng = np.random.default_rng(height)
    for share in (0.5, 0.05, 0.0):
        places = rng.random((height, width)) < share
        places[rng.integers(height), rng.integers(width)] = True
        found, true = nearest_pixels(places, reach_px), by_all_pairs(places)
        within = true[2] <= reach_px**2
        for own, other in zip(found, true, strict=True):
            assert own.dtype == np.int32
            np.testing.assert_array_equal(own[within], other[within])
        assert (found[2][~within] > reach_px**2).all()
        assert (found[0] >= 0).all() and (found[0] < height).all()  # a pixel of the picture in any case


def test_large_pictures_are_searched_in_strips():
    places = np.zeros((40, 2000), bool)
    places[::13, 7::29] = True
    row, column, squared = nearest_pixels(places, 20.0)
    assert places[row, column].all()
    y, x = np.mgrid[:40, :2000]
    np.testing.assert_array_equal(squared, (row - y) ** 2 + (column - x) ** 2)
    assert (squared == nearest_pixels(places, MOST_STEPS + 1.0)[2]).all()
