"""Colour bias shifts the black level of each place in the 2x2 block."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.stage import Moments

OFFSETS = (1.0, -2.0, 3.0, 40.0)


def test_each_place_has_its_offset_in_codes(bench):
    codes = bench.sensor(np.zeros((4, 6)), ColorBias(OFFSETS), black=100.0, gain=7.0)
    assert np.array_equal(codes, np.tile([[101, 98], [103, 140]], (2, 3)))


def test_places_are_those_of_the_sensor_not_of_the_frame(bench):
    codes = bench.sensor(np.zeros((3, 3)), ColorBias(OFFSETS), black=100.0, x=1, y=1)
    assert codes.tolist() == [[140, 103, 140], [98, 101, 98], [140, 103, 140]]


def test_anything_but_four_offsets_is_refused():
    with pytest.raises(PhotositeError, match="color_bias.offsets"):
        ColorBias((1.0, 2.0))


def test_moments_add_mean_and_fixed_variance_of_the_offsets():
    found = ColorBias(OFFSETS).moments(Moments(0.0, 1.0, 2.0))
    assert found == Moments(np.mean(OFFSETS), 1.0, pytest.approx(2.0 + np.var(OFFSETS)))
