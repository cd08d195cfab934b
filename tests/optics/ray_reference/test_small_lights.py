"""Small bright lights in the reference blur, against quadrature in float64."""

import dataclasses
import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
from helpers.area_truth import photosite_means
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.lens_error import statistics, z_scores
from helpers.lens_frame import blurred_case, case_plan, executed_case
from helpers.lens_truths import Case, square_light
from scipy.stats import qmc

from simulator.optics.defocus.lamp_images import square_image
from simulator.optics.pupil.pupil import Pupil
from simulator.optics.ray_reference.small_lights import SmallLights, cell_shares, light_pairs, take_lights
from simulator.sensor.camera.camera_sections import Window

ROWS, COLUMNS, MARGIN, OVER = 36, 40, 13, 4
EDGE, LIGHT = 22, (18 * OVER + 1, 25 * OVER + 2)  # of the near half-plane [photosites]; cell of the light
NEAR_PX, FAR_PX = -5.0, 8.0


def penumbra() -> np.ndarray:
    """Share of the near half-plane on each photosite of a row: the mean over its columns of the closed form."""
    columns = np.arange(MARGIN, COLUMNS - MARGIN)[:, None] + (np.arange(64) + 0.5) / 64
    t = np.clip((EDGE - columns) / abs(NEAR_PX), -1.0, 1.0)
    return (0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / np.pi).mean(axis=1)


def spot() -> np.ndarray:
    """Share of the light on each photosite: points of photosite and light whose ray meets the pupil and not the half-plane."""
    points = qmc.Sobol(4, seed=3).random_base2(16).T
    shares = np.zeros((ROWS - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    for (row, column), _ in np.ndenumerate(shares):
        y, x = row + MARGIN + points[0], column + MARGIN + points[1]
        u_y, u_x = (((at + q) / OVER - p) / FAR_PX for at, q, p in ((LIGHT[0], points[2], y), (LIGHT[1], points[3], x)))
        shares[row, column] = np.mean((u_y**2 + u_x**2 <= 1.0) & (x + NEAR_PX * u_x >= EDGE))
    return shares / (OVER**2 * np.pi * FAR_PX**2)


def sharp_spot() -> np.ndarray:
    """Share of the light on each photosite where it is in focus: its cell, as far as the half-plane lets its light through."""
    shares = np.zeros((ROWS - 2 * MARGIN, COLUMNS - 2 * MARGIN))
    t = np.clip(((LIGHT[1] + (np.arange(64) + 0.5) / 64) / OVER - EDGE) / abs(NEAR_PX), -1.0, 1.0)
    through = (0.5 + (t * np.sqrt(1.0 - t**2) + np.arcsin(t)) / np.pi).mean()
    shares[LIGHT[0] // OVER - MARGIN, LIGHT[1] // OVER - MARGIN] = through / OVER**2
    return shares


def half_plane_before_a_light(single: bool, radiance: float, far_px: float = FAR_PX) -> Case:
    """A near half-plane of 0.5 before a wall of 0.3 with one bright cell; as one picture or as layers."""
    near = np.broadcast_to(np.arange(COLUMNS * OVER) < EDGE * OVER, (ROWS * OVER, COLUMNS * OVER)).astype(float)
    far, whole = np.full(near.shape, 0.3), np.ones_like(near)
    far[LIGHT] += radiance
    truth = 0.3 + 0.2 * penumbra() + radiance * (spot() if far_px == FAR_PX else sharp_spot())
    if single:
        colour, radius = np.where(near > 0, 0.5, far), np.where(near > 0, NEAR_PX, far_px)
        return Case("single", colour[None], whole[None], radius[None], truth, MARGIN, OVER, True)
    radius = np.stack([NEAR_PX * whole, far_px * whole])
    return Case("layers", np.stack([0.5 * near, far]), np.stack([near, whole]), radius, truth, MARGIN, OVER, True)


@pytest.mark.slow
@pytest.mark.parametrize(("single", "electrons"), [(False, 2000.0), (True, 2000.0), (True, 200.0)])
def test_a_light_half_hidden_by_an_edge_is_right_to_a_tenth_of_the_noise(single, electrons):
    """A light of 3000 on a wall of 0.3: rays alone would meet it so rarely that they were off by tens of sigma."""
    case = half_plane_before_a_light(single, 3000.0)
    found = statistics(z_scores(blurred_case(case, electrons, tolerance=0.0), case.truth, electrons))
    assert found.p99 < 0.1 and found.p99_9 < 0.15


@pytest.mark.filterwarnings("ignore:.* photosites have an estimated error")
@pytest.mark.parametrize("single", [False, True])
def test_a_light_in_focus_is_hidden_as_far_as_an_edge_out_of_focus_hides_it(single):
    """Of rays from its cell to the photosite hardly one goes through the pupil: one ray told whether all of it was hidden."""
    case = half_plane_before_a_light(single, 100.0, 1e-4)
    z = z_scores(blurred_case(case, 2000.0, tolerance=0.0), case.truth, 2000.0)
    assert np.abs(z[LIGHT[0] // OVER - MARGIN, LIGHT[1] // OVER - MARGIN]) < 0.1
    assert statistics(z).p99 < 0.1


@pytest.mark.filterwarnings("ignore:.* photosites have an estimated error")
@pytest.mark.parametrize("single", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_nothing_is_left_of_a_light_where_all_of_it_is_hidden(single):
    """Of a light of 10^8 a thousandth more than it would bring was taken away: photosites were far below black."""
    case = half_plane_before_a_light(single, 1e8)
    planned = case_plan(case, 200.0, tolerance=0.0)
    few = dataclasses.replace(planned.optics.accuracy, rays=4096)
    found = executed_case(case, dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, accuracy=few)))
    # A ray from x through u meets the light at x + FAR_PX u, and the near half-plane left of EDGE.
    last = (EDGE * FAR_PX - (LIGHT[1] + 1) / OVER * NEAR_PX) / (FAR_PX - NEAR_PX)
    columns = np.arange(MARGIN, COLUMNS - MARGIN)
    reached, hidden = columns + 1 > LIGHT[1] / OVER - FAR_PX, columns + 1 < last
    assert (reached & hidden).sum() >= 4
    dark = half_plane_before_a_light(single, 0.0).truth
    assert np.abs(z_scores(found, dark, 200.0)[:, hidden]).max() < 0.15


@pytest.mark.parametrize("radius", [2.4, 7.6])
def test_the_spot_of_a_square_light_has_no_noise(radius):
    case = square_light(radius, OVER)
    assert np.abs(z_scores(blurred_case(case, 2000.0, tolerance=0.0), case.truth, 2000.0)).max() < 0.1


def test_what_rays_cannot_reach_is_told():
    planned = case_plan(half_plane_before_a_light(False, 3000.0), 2000.0, tolerance=0.0)
    few = dataclasses.replace(planned.optics.accuracy, rays=1024, ray_error=1e-3)
    planned = dataclasses.replace(planned, optics=dataclasses.replace(planned.optics, accuracy=few))
    with pytest.warns(UserWarning, match="photosites have an estimated error above 0.001 sigma after 8192 rays each"):
        executed_case(half_plane_before_a_light(False, 3000.0), planned)


def test_enough_rays_are_no_reason_to_warn():
    with warnings.catch_warnings(action="error"):
        blurred_case(square_light(2.4, OVER), 2000.0, tolerance=0.0)


@pytest.mark.parametrize("oversampling", [1, 2, 4])
@pytest.mark.parametrize("pupil", [Pupil(), Pupil(6, 20.0)])
@pytest.mark.parametrize("radius", [0.6, -3.3, 8.0])
def test_shares_are_the_areas_of_the_pupils_image_in_cells(pupil, radius, oversampling):
    """Points of photosite and cell are counted on a fine grid; at one sample per photosite the photosite is its centre."""
    shares, offset = cell_shares(pupil, radius, oversampling)
    fine = 24 if abs(radius) < 1.0 else 10
    cells = (np.arange(len(shares) * fine) + 0.5) / (fine * oversampling) + offset / oversampling
    places = np.array([0.5]) if oversampling == 1 else (np.arange(5) + 0.5) / 5
    counted = np.zeros_like(shares)
    for y in places:
        for x in places:
            points = np.stack(np.broadcast_arrays((cells - x)[None, :], (cells - y)[:, None]), axis=-1) / radius
            inside = pupil.contains(points, (0.0, 0.0)).reshape(len(shares), fine, len(shares), fine)
            counted += inside.mean(axis=(1, 3)) / len(places) ** 2
    expected = counted / (np.pi * (radius * oversampling) ** 2)
    assert np.isclose(shares.sum(), 1.0, atol=1e-6)
    assert np.abs(shares - expected).max() < 0.02 * shares.max() + 0.002 * expected.max()


@pytest.mark.parametrize("radius", [1e-4, 0.003, -0.04])
def test_circles_that_hardly_cross_borders_have_exact_shares(radius):
    """A photosite sees beyond each border by the mean of |x| over half of a disk, 2 / (3 pi) radii."""
    shares, offset = cell_shares(Pupil(), radius, 8)
    assert shares.sum() == pytest.approx(1.0, abs=1e-9)
    assert shares[:, :-offset].sum() == pytest.approx(2.0 / (3.0 * np.pi) * abs(radius), rel=1e-6)


@pytest.mark.parametrize("oversampling", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_open_areas_behind_blades_see_shares_of_their_own(oversampling):
    """One cell is bright: the open part of the photosite in the middle sees it, by chords of the polygon in float64."""
    pupil, radius_px, side, photosites = Pupil(5, 12.0), -2.3, 0.8, 11
    shares, offset = cell_shares(pupil, radius_px, oversampling, (side, 0.0))
    for row, column in ((0, 1), (2, 4), (len(shares) // 2, len(shares) // 2)):
        cells = np.zeros((oversampling * photosites,) * 2)
        cells[oversampling * 5 + offset + row, oversampling * 5 + offset + column] = 1.0
        seen = photosite_means(cells, (photosites,) * 2, radius_px, side**2, 2000, pupil.corners())[5, 5]
        assert shares[row, column] == pytest.approx(seen, abs=1e-5 * shares.max())


@pytest.mark.parametrize("start", [(0.8, 0.0), (1.0, 0.4), (0.7, 0.5)])
@pytest.mark.parametrize("oversampling", [1, 3])
def test_open_areas_and_filters_see_shares_of_their_own(start, oversampling):
    """Points of the pupil and of the open squares, of which a filter makes two by two, are counted in cells."""
    shares, offset = cell_shares(Pupil(), -2.3, oversampling, start)
    side, apart = start
    points = qmc.Sobol(4, seed=5).random_base2(17)
    radius, angle = np.sqrt(points[:, 0]), 2.0 * np.pi * points[:, 1]
    begin = 0.5 + side * (points[:, 2:] % 0.5 * 2.0 - 0.5) + apart * ((points[:, 2:] >= 0.5) - 0.5)
    met = begin + 2.3 * radius[:, None] * np.stack([np.sin(angle), np.cos(angle)], axis=-1)
    borders = (np.arange(len(shares) + 1) + offset) / oversampling
    counted = np.histogram2d(*met.T, bins=(borders, borders))[0] / len(points)
    assert shares.sum() == pytest.approx(1.0, abs=1e-6)
    assert np.abs(shares - counted).max() < 0.02 * oversampling * shares.max()


def test_a_light_behind_an_open_area_is_met_where_hardly_a_ray_meets_it():
    """A pixel of 10^8 e-, 11 photosites out of focus: one ray of 3,000 meets it, and no set of 1,024 did so in 3 % of them."""
    scale, side, radius_px = 2.0, 32, 11.0
    light = np.ones([round(scale * side)] * 2, np.float32)
    light[30, 33] += 1e7
    shot = fine_shot(light, (side, side), radius_px, 10.0)
    shot = replace(shot, camera=replace(shot.camera, fill_factor=0.8), tolerance=0.0)
    found, _ = frame_radiance(shot)
    away = [np.arange(side) + 0.5 - (place + 0.5) / scale for place in (30, 33)]
    truth = 1.0 + 1e7 * square_image(radius_px, 1.0 / scale, math.sqrt(0.8), *away)
    assert np.abs(found / truth - 1.0).max() < 1e-3


def test_lights_in_tiny_circles_are_taken_of_round_pupils():
    """Of others, and in circles that many rays cross borders through, they stay."""
    colour, limit = np.zeros((1, 1, 9, 9), np.float32), np.ones(1, np.float32)
    colour[0, 0, 4, 4] = 1e6
    for radius_px, is_round, taken in ((0.01, True, 1), (0.01, False, 0), (0.3, True, 0), (0.0, True, 0), (0.7, False, 1)):
        radii = np.full((1, 9, 9), radius_px, np.float32)
        assert len(take_lights(colour.copy(), np.ones_like(radii), radii, limit, limit, 4, is_round=is_round).rows) == taken


def test_lights_in_tiny_circles_stay_where_a_nearer_surface_may_hide_them():
    """A layer whose circles reach the cell, or a nearer part of the same surface."""
    colour, limit = np.zeros((2, 1, 41, 41), np.float32), np.ones(1, np.float32)
    colour[1, 0, 20, 20] = 1e6
    for columns, radius_px, taken in ((slice(0, 15), -2.0, 0), (slice(0, 15), -0.5, 1), (slice(0, 0), -2.0, 1)):
        coverage, radii = np.ones((2, 41, 41), np.float32), np.full((2, 41, 41), 0.01, np.float32)
        coverage[0], radii[0] = 0.0, radius_px
        coverage[0][:, columns] = 1.0
        one = np.where(coverage[:1] > 0.0, radii[:1], radii[1:])
        for planes, covered, radius in ((colour, coverage, radii), (colour[1:], np.ones_like(one), one)):
            assert len(take_lights(planes.copy(), covered, radius, limit, limit, 4, is_round=True).rows) == taken


@pytest.mark.parametrize(("radius_px", "apart"), [(0.01, 1e-9), (0.05, 1e-9), (0.6, 0.015), (-1.0, 0.01), (2.5, 0.01)])
def test_a_light_whose_radius_has_a_slope_is_seen_as_brightly_as_its_pupil_is_wide(radius_px, apart):
    """Against rays from its cell through points of the pupil; a photosite sees a tiny circle through all of the pupil."""
    side, slopes, (row, column) = 9, np.array([0.1, -0.06]), (17, 18)
    where = np.array([row + MARGIN * OVER]), np.array([column + MARGIN * OVER]), np.array([0])
    lights = SmallLights(*where, np.array([radius_px]), slopes[:, None], np.ones((1, 1)))
    pairs, shares = light_pairs(lights, Pupil(), Window(0, 0, side, side), MARGIN, OVER)
    found, truth = np.zeros(side * side), np.zeros((side, side))
    found[pairs[:, 0]] = shares
    axis = (np.arange(400) + 0.5) / 200.0 - 1.0
    u = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    u = u[np.hypot(*u.T) <= 1.0]
    places = (np.arange(12) + 0.5) / 12.0
    for down in places:
        y = np.floor((row + down) / OVER - radius_px * u[:, 1]).astype(int)
        for right in places:
            np.add.at(truth, (y, np.floor((column + right) / OVER - radius_px * u[:, 0]).astype(int)), 1.0 - u @ slopes)
    truth /= len(u) * len(places) ** 2 * OVER**2
    assert np.abs(found.reshape(side, side) - truth).max() < apart * truth.max()
