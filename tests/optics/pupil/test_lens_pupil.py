"""The pupil's shape: areas by hand and by counting, points spread evenly, stops that clip."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from simulator.errors import PhotositeError
from simulator.optics.defocus.aperture_kernel import aperture_weights
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.pupil.pupil import Pupil, PupilStop, generate_r2_points
from simulator.optics.pupil.pupil_points import points_of

CATS_EYE = (PupilStop(1.2, 2.0), PupilStop(1.3, -1.5))
PUPILS = [
    Pupil(),
    Pupil(3, 13.0),
    Pupil(6, 10.0),
    Pupil(7, 25.0, 0.5),
    Pupil(9, 0.0, 1.0),
    Pupil(stops=CATS_EYE),
    Pupil(5, 40.0, stops=CATS_EYE),
    Pupil(7, 3.0, 0.8, CATS_EYE),
]
FIELDS = [(0.0, 0.0), (0.3, 0.0), (-0.2, 0.35), (0.0, -0.6)]


@pytest.mark.parametrize("blades", [3, 5, 6, 7, 9, 16])
def test_blades_keep_the_area_of_the_round_pupil(blades):
    """And the corners lie where n/2 R^2 sin(2 pi / n) = pi puts them."""
    corner = math.sqrt(2 * math.pi / (blades * math.sin(2 * math.pi / blades)))
    assert Pupil(blades).area() == pytest.approx(math.pi, rel=1e-13)
    for radius, inside in ((corner - 1e-9, True), (corner + 1e-9, False)):
        angle = math.radians(20.0)
        assert Pupil(blades, 20.0).contains([[radius * math.cos(angle), radius * math.sin(angle)]])[0] == inside


def test_blade_curvature_leads_from_the_polygon_to_the_circle():
    farthest = [np.hypot(*Pupil(5, 0.0, curvature).outline().T).max() for curvature in (0.0, 0.3, 0.6, 0.9, 1.0)]
    assert np.all(np.diff(farthest) < 0) and farthest[-1] == pytest.approx(1.0, abs=2e-5)
    for curvature in (1e-12, 1e-6, 9e-5, 1.1e-4, 1e-3, 0.999999):
        assert Pupil(5, 0.0, curvature).area() == pytest.approx(math.pi, rel=1e-7)
        assert Pupil(5, 0.0, curvature, (PupilStop(1.1, 1.0),)).area((0.5, 0.2)) == pytest.approx(
            Pupil(5, 0.0, round(curvature), (PupilStop(1.1, 1.0),)).area((0.5, 0.2)), rel=1e-3
        )


def test_two_circles_leave_the_lens_of_the_textbook():
    """Two unit circles at distance d share 2 acos(d/2) - d/2 sqrt(4 - d^2)."""
    for distance in (0.1, 0.7, 1.5, 1.999):
        lens = 2 * math.acos(distance / 2) - distance / 2 * math.sqrt(4 - distance**2)
        assert Pupil(stops=(PupilStop(1.0, 1.0),)).area((distance * 0.6, -distance * 0.8)) == pytest.approx(lens, rel=1e-9)
    assert Pupil(stops=(PupilStop(1.0, 1.0),)).area((2.1, 0.0)) == 0.0
    assert Pupil(stops=(PupilStop(1.0, 1.0),)).area() == math.pi  # one circle twice is one circle
    assert Pupil(stops=(PupilStop(0.4, 1.0),)).area((0.2, 0.1)) == pytest.approx(math.pi * 0.16, rel=1e-13)


@pytest.mark.parametrize("pupil", PUPILS)
@pytest.mark.parametrize("field", FIELDS)
def test_area_is_what_a_fine_grid_counts(pupil, field):
    """Truth: cells of a grid whose centre lies inside; the error of N cells along the edge grows with the root of N."""
    step = 1 / 500
    axis = np.arange(-1.6, 1.6, step) + 0.5 * step
    counted = pupil.contains(np.stack(np.meshgrid(axis, axis), axis=-1), field).sum() * step**2
    assert pupil.area(field) == pytest.approx(counted, abs=5 * step**1.5)


@pytest.mark.parametrize("pupil", PUPILS)
@pytest.mark.parametrize("field", FIELDS)
def test_points_lie_inside_and_outline_has_the_area(pupil, field):
    points, outline = pupil.points(4001, field), pupil.outline(field)
    assert points.shape == (4001, 2) and points.dtype == np.float64
    centre = points.mean(axis=0)
    assert pupil.contains(centre + (points - centre) * (1 - 1e-5), field).all()
    x, y = outline.T
    shoelace = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert abs(shoelace) == pytest.approx(pupil.area(field), rel=2e-5)
    assert np.array_equal(pupil.points(100, field), points[:100])


@pytest.mark.parametrize("pupil", PUPILS)
def test_points_are_more_even_than_chance(pupil):
    """Counts in parts of known area: chi-square far below that of random points, and no part is off by much."""
    field, count = (0.25, 0.2), 4096
    points = pupil.points(count, field)
    axis = (np.arange(-800, 800) + 0.5) / 500
    grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    grid = grid[pupil.contains(grid, field)]

    def part(at):
        return (np.floor(4 * at[:, 0]) + 100 * np.floor(4 * at[:, 1])).astype(int)

    parts, cells = np.unique(part(grid), return_counts=True)
    expected = count * cells / len(grid)
    found = np.array([np.sum(part(points) == one) for one in parts])
    large = expected > 8
    statistic = np.sum((found - expected)[large] ** 2 / expected[large])
    assert statistic < chi2.ppf(1e-4, large.sum() - 1)
    assert np.abs(found - expected).max() < 0.3 * math.sqrt(count * math.log(count))


def test_mean_over_the_points_is_the_mean_over_the_disk():
    """E[r^2] = 1/2, E[x^4] = 1/8 of the unit disk; the error falls faster than that of chance."""
    x, y = Pupil().points(4096).T
    assert np.mean(x**2 + y**2) == pytest.approx(0.5, abs=2e-3 * 0.5)  # chance: 4.5e-3
    assert np.mean(x**4) == pytest.approx(0.125, abs=2e-3 * 0.5)
    assert abs(np.mean(x)) < 1e-3 and abs(np.mean(y)) < 1e-3


@pytest.mark.parametrize("pupil", PUPILS)
def test_points_of_many_fields_are_those_of_each(pupil):
    """Cut into 512 strips instead of 4096: 0.004 of the radius at a corner of blades, where the edge turns within a strip."""
    fields = np.array([*FIELDS, (0.25, 0.2)])
    found = points_of(pupil, fields, generate_r2_points(512).T)
    expected = np.stack([pupil.points(512, field) for field in fields])
    assert found.shape == (5, 512, 2) and np.abs(found - expected).max() < 0.006 and np.abs(found - expected).mean() < 2e-4


def test_a_closed_pupil_has_no_area_and_no_points():
    closed = Pupil(stops=(PupilStop(1.0, 3.0), PupilStop(1.0, -3.0)))
    assert closed.area((0.5, 0.0)) == 0.0 and not len(closed.outline((0.5, 0.0)))
    with pytest.raises(PhotositeError, match="no ray reaches the field"):
        closed.points(10, (0.5, 0.0))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((2,), "lens.aperture.blades = 2: give 3 to 32"),
        ((6, math.nan), "lens.aperture.rotation"),
        ((6, 0.0, 1.5), "lens.aperture.blade_curvature = 1.5"),
    ],
)
def test_impossible_pupils_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=message):
        Pupil(*arguments)


@pytest.mark.parametrize("pupil", [Pupil(), Pupil(6, 10.0), Pupil(7, 25.0, 0.5)])
def test_the_image_of_a_skewed_pupil_is_that_of_an_upright_one_skewed(pupil):
    skewed, matrix = replace(pupil, skew=(0.3, -0.2)), np.array([[1.0, 0.3], [0.0, 0.8]])
    assert not skewed.is_round
    assert np.allclose(skewed.outline(), pupil.outline() @ matrix.T, atol=1e-12)
    assert skewed.corner_radius >= np.linalg.norm(skewed.outline(), axis=1).max() - 1e-9
    weights, upright = (aperture_weights(one, 9.0) for one in (skewed, pupil))
    reach = (len(weights) - 1) // 2
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    own = np.mgrid[: len(upright), : len(upright)] - len(upright) // 2
    moments = [[(upright * a * b).sum() for a in own[::-1]] for b in own[::-1]]
    found = [[(weights * a * b).sum() for a in (x, y)] for b in (x, y)]
    assert np.allclose(found, matrix @ moments @ matrix.T, atol=0.15)  # photosites add 1/12, and 1/12 skewed


@pytest.mark.parametrize("depth_m", [0.7, 2.0, 5.0, 1e4])
def test_a_photosite_at_x_sees_the_plane_of_radius_s_at_x_plus_s_u(depth_m):
    """Traced from the sensor: in the room's axes the photosite at x lies at -x, and u of the pupil at -u (both turned)."""
    lens, photosite, through = ThinLens(50.0, 1.8, 2.0), np.array([3.0, -7.0]), np.array([0.6, 0.3])
    image_mm, height_mm = lens.image_distance_mm, -through * 0.5 * lens.pupil_diameter_mm
    slope = (height_mm + photosite) / image_mm - height_mm / lens.focal_length_mm  # an ideal lens turns a ray by height / f
    seen_mm = (height_mm + 1e3 * depth_m * slope) * image_mm / (1e3 * depth_m)  # as the picture of that plane is scaled
    assert seen_mm == pytest.approx(photosite + 1e-3 * lens.blur_radius_um(depth_m) * through, rel=1e-9)
