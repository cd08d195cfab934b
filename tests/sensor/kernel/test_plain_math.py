"""Elementary functions of plain operators against float64."""

import numpy as np
import pytest

RANGES = {
    "reciprocal(v)": (np.geomspace(1e-30, 1e30, 100_001), lambda v: 1 / v),
    "reciprocal_square_root(v)": (np.geomspace(1e-30, 1e30, 100_001), lambda v: 1 / np.sqrt(v)),
    "natural_log(v)": (np.concatenate([np.geomspace(2e-10, 1.0, 100_000), np.linspace(0.9, 1.1, 100_000)]), np.log),
    "exponential(v)": (np.linspace(-5.0, 5.0, 100_001), np.exp),
}
BOUNDS = {
    "reciprocal_square_root(v)": 9e-7,
    "exponential(v)": 2.5e-6,
    "natural_log(v)": 1e-5,
}  # a shorter iteration, as its header says


@pytest.mark.parametrize("expression", RANGES)
def test_relative_error_is_a_few_float32_roundings(bench, expression):
    values, truth = RANGES[expression]
    values = values.astype(np.float32)
    found = bench.header("plain_math.h", expression, {"v": values}).astype(np.float64)
    expected = truth(values.astype(np.float64))
    assert np.max(np.abs(found - expected) / np.maximum(np.abs(expected), 1e-30)) < BOUNDS.get(expression, 4e-7)


def test_nearest_rounds_ties_to_even(bench):
    values = np.array([-2.5, -1.5, -0.5, 0.5, 1.5, 2.5, 0.49999997, 65534.5, 4.0e6], np.float32)
    assert np.array_equal(bench.header("plain_math.h", "nearest(v)", {"v": values}), np.rint(values))
