"""Nonlinearity adds an error that is read between nodes."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.sensor.stages.nonlinearity import Nonlinearity
from simulator.sensor.stages.stage import Moments

ERRORS = (0.0, 30.0, -10.0, 5.0)


def test_codes_follow_the_table_with_straight_lines_between_its_nodes(bench):
    light = np.linspace(0.0, 14000.0, 5000)[np.newaxis]
    codes = bench.sensor(light, Nonlinearity(ERRORS, 12000.0))
    truth = light + np.interp(light, np.linspace(0.0, 12000.0, 4), ERRORS)  # np.interp holds the end values as well
    assert np.abs(codes - truth).max() < 0.5 + 2e-3


def test_a_table_of_zeros_changes_nothing(bench):
    light = np.arange(1000.0)[np.newaxis]
    assert np.array_equal(bench.sensor(light, Nonlinearity((0.0, 0.0), 500.0)), light)


@pytest.mark.parametrize("errors", [(1.0,), (0.0, 1e5)])
def test_too_few_or_impossible_errors_are_refused(errors):
    with pytest.raises(PhotositeError, match="nonlinearity.errors"):
        Nonlinearity(errors, 100.0)


def test_moments_follow_value_and_slope():
    stage = Nonlinearity((0.0, 10.0, 10.0), 200.0)
    assert stage.moments(Moments(50.0, 4.0, 1.0)) == Moments(55.0, pytest.approx(4.84), pytest.approx(1.21))
    assert stage.moments(Moments(150.0, 4.0)) == Moments(160.0, 4.0)
    assert stage.moments(Moments(900.0, 4.0)) == Moments(910.0, 4.0)
