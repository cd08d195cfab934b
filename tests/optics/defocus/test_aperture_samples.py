"""Blocks take as many points of the aperture as they need, and no crop or device changes how many."""

import dataclasses

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import case_plan, executed_case, with_accuracy
from helpers.textured_planes import one_picture, textured_planes

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_samples import MOST_OF_ALL, most_samples, sample_count
from simulator.sensor.camera.camera import Window


class Half(Accuracy):
    """Half as many points."""

    points_factor = 0.5


class Most(Accuracy):
    """As many points as there are."""

    points_factor = 64.0


@pytest.fixture(scope="module")
def steps():
    """One picture with steps in depth, blur radii up to 4."""
    return one_picture(textured_planes((-4.0, 0.0, 4.0), shape=(80, 104)))


def test_faint_light_gets_the_bits_of_few_points(steps):
    """Half of the 128 points of these radii: the means over 32 and over 64 are as good as equal."""
    faint = dataclasses.replace(steps, colour=0.5 + 1e-3 * steps.colour)
    planned = case_plan(faint)
    assert int(sample_count(np.array(4.0), planned.optics.defocus)) == 128
    few = executed_case(faint, with_accuracy(planned, Half, brightest=0.0))
    assert np.array_equal(executed_case(faint, planned), few)
    assert not np.array_equal(executed_case(faint, with_accuracy(planned, Accuracy, brightest=0.0)), few)


def test_strong_texture_gets_more_points_and_is_more_exact(steps):
    planned = case_plan(steps, electrons=20000.0)
    scene = dataclasses.replace(planned.optics.defocus, guessed=False)  # a guess would keep the number of points
    known = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, defocus=scene))
    truth = executed_case(steps, with_accuracy(known, Most, brightest=0.0))
    fixed = executed_case(steps, with_accuracy(planned, Accuracy, brightest=0.0))
    as_needed, before = (statistics(z_scores(light, truth, 20000.0)) for light in (executed_case(steps, planned), fixed))
    assert as_needed.p99 < before.p99 and as_needed.rms < before.rms
    most = most_samples(np.array([4.0, 900.0]), planned.optics.defocus)
    assert most.tolist() == [256, 2048] and most_samples(np.array(900.0), scene) <= MOST_OF_ALL


def test_a_crop_takes_the_points_of_the_frame(steps):
    planned = case_plan(steps, electrons=20000.0)
    whole = executed_case(dataclasses.replace(steps, margin=0), planned)
    part = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=Window(21, 19, 50, 37)))
    assert np.array_equal(executed_case(dataclasses.replace(steps, margin=0), part), whole[19:56, 21:71])
