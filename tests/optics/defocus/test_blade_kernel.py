"""Exact weights of even squares behind blades, against polygons clipped in float64, and means of single squares."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_error import z_scores
from helpers.lens_frame import LENS

from simulator.optics.defocus.aperture_kernel import make_taps, photosite_weights
from simulator.optics.defocus.blade_kernel import blade_weights
from simulator.optics.defocus.photosite_area import PhotositeArea
from simulator.optics.defocus.square_kernel import disk_square_weights
from simulator.optics.pupil.pupil import Aperture, Pupil


def clipped(corners: np.ndarray, axis: int, border: float, sign: float) -> np.ndarray:
    """Part of a convex polygon (n, 2) whose sign * coordinate is below sign * border (Sutherland and Hodgman 1974)."""
    found = []
    for here, there in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        own, other = (sign * (one[axis] - border) for one in (here, there))
        if own <= 0.0:
            found.append(here)
        if own * other < 0.0:
            found.append(here + (there - here) * own / (own - other))
    return np.array(found).reshape(-1, 2)


def area(corners: np.ndarray) -> float:
    """Area of a polygon (n, 2), by Gauss's formula."""
    x, y = corners.T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def areas_in_squares(corners: np.ndarray, size: int) -> np.ndarray:
    """Share of a polygon in each of the squares around the origin, (size, size)."""
    found = np.zeros((size, size))
    for row, column in np.ndindex(size, size):
        part = corners
        for axis, first in ((1, row - 0.5 * size), (0, column - 0.5 * size)):
            part = clipped(clipped(part, axis, first, -1.0), axis, first + 1.0, 1.0)
        found[row, column] = area(part)
    return found / area(corners)


@pytest.mark.parametrize(
    "pupil", [Pupil(5, 12.8), Pupil(3, 20.0), Pupil(4, 0.0), Pupil(6, 90.0), Pupil(7, 5.0, skew=(0.3, -0.2))]
)
@pytest.mark.parametrize("radius_px", [2.3, -7.1])
def test_weights_are_the_areas_of_a_polygon_in_squares(pupil, radius_px):
    across, down = pupil.skew
    corners = pupil.corners() @ np.array([[1.0, 0.0], [across, 1.0 + down]])
    found = blade_weights(pupil, radius_px, 1)
    assert np.abs(found - areas_in_squares(radius_px * corners, len(found))).max() < 1e-13


@pytest.mark.parametrize(("radius_px", "samples"), [(0.02, 2), (-0.4, 2), (2.2, 4), (-6.02, 2)])
@pytest.mark.parametrize("open_side", [pytest.param(1.0, marks=pytest.mark.slow), 0.7])
def test_weights_are_those_of_single_squares(radius_px, samples, open_side):
    """A photosite amid black squares but for one sees the weight of that one."""
    pupil = Pupil(5, 12.8)
    weights = photosite_weights(pupil, radius_px, samples, PhotositeArea(True, samples, open_side))
    side = len(weights)
    photosites = 2 * (side // samples // 2) + 3  # odd: one in the middle
    first = (samples * photosites - side) // 2
    assert weights.sum() == pytest.approx(1.0)
    rows, columns = np.array([(side // 2, side // 2), (side // 2, 1), (side // 3, side // 4), (side - 2, side // 2)]).T
    scenes = np.zeros((len(rows), samples * photosites, samples * photosites))
    scenes[range(len(rows)), first + rows, first + columns] = 1.0
    means = photosite_means(scenes, (photosites,) * 2, radius_px, open_side**2, 2000, pupil.corners())
    assert weights[rows, columns] == pytest.approx(means[:, photosites // 2, photosites // 2], abs=1e-5 * weights.max())


@pytest.mark.parametrize(("radius_px", "samples"), [(0.3, 2), (4.7, 2), (30.0, 1)])
def test_arcs_are_as_exact_as_disks(radius_px, samples):
    exact = disk_square_weights(radius_px, samples, 0.8)
    found = blade_weights(Pupil(), samples * radius_px, samples, 0.8 * samples)
    assert np.abs(found - exact).max() < 1e-6 * exact.max()


def test_blades_that_are_arcs_of_almost_one_circle_are_a_disk():
    exact, found = (blade_weights(pupil, 4.7, 2, 2.0) for pupil in (Pupil(), Pupil(9, 20.0, 1.0 - 1e-9)))
    assert np.abs(found - exact).max() < 1e-6 * exact.max()


def test_squares_inside_the_image_are_equal_so_that_few_sums_are_read():
    weights = blade_weights(Pupil(6, 20.0), 16.04, 2, 2.0)
    assert len(make_taps([weights], 2)[0].rows) < 0.5 * weights.size and len(np.unique(weights[12:24, 12:24])) == 1


@pytest.mark.parametrize(
    ("radius_px", "tolerance"),
    [(4.57, 1.0), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((-2.4, 0.0), (-2.4, 1.0), (4.57, 0.0)))],
)
def test_the_rim_of_a_lamp_behind_blades_is_sharp(radius_px, tolerance):
    """A lamp of 10^8 squares of light of 1 e-: slices of the aperture's image left some hundred sigma in its dark."""
    pupil = Pupil(5, 6.3)
    scene = np.ones((64, 80))
    scene[33, 41] = 1e8
    lens = replace(LENS, aperture=Aperture(5, 6.3))
    shot = fine_shot(scene, (32, 40), radius_px, 1.0, tolerance=tolerance, lens=lens)
    found, _ = frame_radiance(shot)
    lamp = scene.astype(np.float32).astype(float)
    truth = photosite_means(lamp, (32, 40), radius_px, chords=2000, corners=pupil.corners())
    inside = slice(math.ceil(1.2 * abs(radius_px)) + 1, -math.ceil(1.2 * abs(radius_px)) - 1)
    assert np.abs(z_scores(found, truth, 1.0))[inside, inside].max() < 0.3
