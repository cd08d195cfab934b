"""Exposure: H = E t, and what cannot be set."""

import pytest

from simulator.errors import PhotositeError
from simulator.exposure import Exposure, Integration
from simulator.stage import Moments


@pytest.mark.parametrize("time_s", [0.0, -1.0])
def test_a_shutter_that_does_not_open_is_refused(time_s):
    with pytest.raises(PhotositeError, match="exposure.time .*1/125 s"):
        Exposure(time_s)


def test_iso_must_be_positive():
    with pytest.raises(PhotositeError, match="exposure.iso"):
        Exposure(0.01, 0)


def test_electrons_grow_with_time_and_area():
    assert Integration(0.5, 8.0).moments(Moments(10.0, 0.0)) == Moments(40.0, 0.0)
