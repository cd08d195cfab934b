"""Blocks take as many points of the aperture as they need, and no crop or device changes how many."""

import dataclasses

import numpy as np
import pytest
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import case_plan, executed_case, with_accuracy
from helpers.lens_truths import stripes
from helpers.textured_planes import one_picture, textured_planes
from scipy.ndimage import map_coordinates

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.aperture_samples import (
    MOST_OF_ALL,
    aperture_samples,
    most_samples,
    moving_samples,
    sample_count,
)
from simulator.optics.pupil.pupil import Aperture, Pupil
from simulator.sensor.camera.camera import Window


class Half(Accuracy):
    """Half as many points."""

    points_factor = 0.5


class Quarter(Accuracy):
    """A quarter of the points."""

    points_factor = 0.25


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


@pytest.fixture(scope="module")
def layers():
    """An edge before stripes, both out of focus: blocks near the edge are corrected by their covariance."""
    return stripes(-5.1, 6.0, 12.0)


def test_corrections_of_faint_light_get_the_bits_of_few_points(layers):
    """A quarter of 256 points: the covariance over 32 and over 64 is as good as equal, and as good as nothing."""
    faint = dataclasses.replace(layers, colour=0.5 * layers.coverage + 1e-3 * layers.colour)
    planned = case_plan(faint)
    few = executed_case(faint, with_accuracy(planned, Quarter, brightest=0.0))
    assert np.array_equal(executed_case(faint, planned), few)
    assert not np.array_equal(executed_case(faint, with_accuracy(planned, Accuracy, brightest=0.0)), few)


def test_corrections_take_points_until_they_are_exact(layers):
    """The covariance differs from that over as many points as there are by a small part of the tolerance."""
    planned = case_plan(layers, electrons=20000.0)
    truth = executed_case(layers, with_accuracy(planned, Most, brightest=0.0))
    off = z_scores(executed_case(layers, planned), truth, 20000.0)
    assert 0.0 < np.quantile(np.abs(off), 0.99) < 0.1


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


@pytest.mark.parametrize("name", ["steps", "layers"])
def test_a_crop_takes_the_points_of_the_frame(name, request):
    case = request.getfixturevalue(name)
    planned = case_plan(case, electrons=20000.0)
    whole = executed_case(dataclasses.replace(case, margin=0), planned)
    part = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, window=Window(21, 19, 40, 20)))
    assert np.array_equal(executed_case(dataclasses.replace(case, margin=0), part), whole[19:39, 21:61])


@pytest.mark.parametrize("count", [256, 1024])
@pytest.mark.parametrize(
    "pupil", [Pupil(), Aperture(7, 13.5).pupil(), Aperture(5, 2.0, 0.3).pupil()], ids=["round", "blades", "arcs"]
)
def test_each_sample_of_a_photosite_has_points_all_over_the_pupil(pupil, count):
    """Beside random lines through it, for 4 x 4 samples: points that are even in either alone miss 3 to 5 times as much."""
    rng, dense = np.random.default_rng(4), pupil.points(2**16)
    x, y, *place = aperture_samples(pupil, count, 4)[:, :4].astype(np.float64).T
    sample = np.digitize(place[0], [-0.25, 0.0, 0.25]) + 4 * np.digitize(place[1], [-0.25, 0.0, 0.25])
    missed = []
    for angle, distance in zip(rng.uniform(0.0, 2.0 * np.pi, 40), rng.uniform(-0.8, 0.8, 40), strict=True):
        way = np.array([np.cos(angle), np.sin(angle)])
        share = np.mean(dense @ way < distance)
        beside = np.stack([x, y], axis=-1) @ way < distance
        missed += [np.mean(beside & (sample == one)) - share / 16.0 for one in range(16)]
    assert np.std(missed) < 4.0 * count**-0.75 / 16.0


@pytest.mark.parametrize("samples", [2, 4])
@pytest.mark.parametrize("points_of", [aperture_samples, moving_samples])
def test_points_see_the_mean_of_even_squares_over_a_photosite_that_looks_aside(points_of, samples):
    """Bilinear reads of samples, each the light of a square, at 64 points and any place: the light of the area there."""
    places = points_of(Pupil(), 64, samples)[:, 2:4].astype(np.float64)
    light = np.random.default_rng(2).random((6 * samples, 6 * samples))
    sums = np.pad(light.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))

    def bilinear(values, y, x):
        return map_coordinates(values, (y, x), order=1, mode="nearest")

    for middle in ((3.0, 3.0), (2.93, 3.31), (3.62, 2.25)):
        y, x = (samples * (middle[axis] + places[:, 1 - axis]) - 0.5 for axis in (0, 1))
        below, right = (samples * (middle[axis] + np.array([-0.5, 0.5])) for axis in (0, 1))
        corners = bilinear(sums, *np.meshgrid(below, right, indexing="ij"))
        area = (corners[1, 1] - corners[0, 1] - corners[1, 0] + corners[0, 0]) / samples**2
        assert bilinear(light, y, x).mean() == pytest.approx(area, abs=1e-7)
