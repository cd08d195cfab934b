"""Means and extremes over windows are those of SciPy, bit for bit."""

import numpy as np
import pytest
from scipy import ndimage

from simulator.scene.window_filters import window_maximum, window_mean, window_minimum

SCIPY = {window_mean: ndimage.uniform_filter, window_minimum: ndimage.minimum_filter, window_maximum: ndimage.maximum_filter}


def values(shape, dtype):
    """Light of a large range: rounding errors of running sums show."""
    rng = np.random.default_rng(5)
    return (rng.standard_normal(shape) * 10.0 ** rng.uniform(-6.0, 3.0, shape)).astype(dtype)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("beyond", ["reflect", "nearest"])
@pytest.mark.parametrize("width", [1, 2, 3, 4, 5, 8, 9, 30])
@pytest.mark.parametrize("own", SCIPY)
def test_they_are_those_of_scipy(own, width, beyond, dtype):
    for shape in ((17, 12), (7, 6, 3), (1, 5)):
        light = values(shape, dtype)
        found = own(light, width, beyond)
        size = (width, width) + (1,) * (light.ndim - 2)
        np.testing.assert_array_equal(found, SCIPY[own](light, size, mode=beyond), strict=True)


def test_other_axes_can_be_chosen():
    light = values((3, 9, 8, 2), np.float64)
    np.testing.assert_array_equal(window_mean(light, 4, axes=(1, 2)), ndimage.uniform_filter(light, (1, 4, 4, 1)))


def test_infinite_values_reach_as_far_as_the_window():
    light = np.full((5, 5), np.inf)
    light[2, 2] = 1.0
    assert np.isfinite(window_minimum(light, 3)).sum() == 9
