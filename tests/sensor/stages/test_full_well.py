"""A full well holds its capacity and no more, before read noise and gain."""

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.stage import Moments


def test_clips_electrons_before_the_gain(bench):
    electrons = np.array([[0.0, 999.0, 1000.0, 1001.0, 1e6]])
    assert bench.sensor(electrons, FullWell(1000.0), gain=2.0, black=10.0).tolist() == [[10, 2008, 2010, 2010, 2010]]


def test_a_saturated_photosite_has_no_noise(bench):
    assert (bench.sensor(np.full((64, 64), 5e4), FullWell(1e4), PhotonShotNoise()) == 10000).all()


def test_a_well_without_room_is_refused():
    with pytest.raises(PhotositeError, match="full_well.capacity"):
        FullWell(0.0)


def test_moments_stop_at_the_capacity():
    assert FullWell(10.0).moments(Moments(9.0, 4.0)) == Moments(9.0, 4.0)
    assert FullWell(10.0).moments(Moments(11.0, 4.0)) == Moments(10.0, 0.0)
