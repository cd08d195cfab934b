"""Lenses of lensfun's database: its models in float64, the library itself, and Debian's database where it is installed."""

import math
from pathlib import Path

import numpy as np
import pytest

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.optics.lens.distortion import plan_warp
from simulator.optics.lens.lensfun import database_folders, lens_profile
from simulator.optics.lens.perspective import FULL_FRAME_DIAGONAL_MM
from simulator.pipeline.simulate import simulate

OWN = Path(__file__).parents[2] / "files" / "lensfun.xml"
ZOOM, EVEN, FIVE = "Nobody Zoom 24-70mm f/2.8", "Nobody 40mm f/2 & friends", "Nobody 40mm f/2.4"
WIDTH, HEIGHT = 600, 400


def profile(name, focal_mm=40.0, f_number=2.8, distance_m=10.0, crop=1.5):
    return lens_profile(name, focal_mm, f_number, distance_m, FULL_FRAME_DIAGONAL_MM / crop, OWN)


def placed(found, radius):
    """Where a point at this undistorted radius is seen, in half diagonals, by the distortion as the projection applies it."""
    half_px = math.hypot(WIDTH, HEIGHT) / 2
    warp = plan_warp(found.distortion, 1e4, WIDTH, HEIGHT, 3)
    x, _ = warp.distorted(WIDTH / 2 + radius * half_px, HEIGHT / 2, 1)
    return (x - WIDTH / 2) / half_px


def test_polynomials_of_even_powers_are_taken_as_they_are():
    """poly3 on 3:2 and poly5 on 4:3, by the formulas of lensfun's manual: R is 1 at half the shorter side."""
    corner, r = math.hypot(3, 2) / 2, np.linspace(0, 1, 50)
    d = 1 + 0.021
    big_r = r * corner / d
    seen = big_r * (d - 0.021 * big_r**2) / corner
    np.testing.assert_allclose(placed(profile(EVEN), r), seen, atol=1e-12)
    corner = math.hypot(4, 3) / 3
    big_r = r * corner
    np.testing.assert_allclose(placed(profile(FIVE), r), r * (1 - 0.02 * big_r**2 + 0.005 * big_r**4), atol=1e-12)


def test_odd_powers_are_fitted_as_well_as_is_told():
    corner, r = math.hypot(3, 2) / 2, np.linspace(0, 1, 200)
    a, b, c = 0.012, -0.04, 0.01
    d = 1 - a - b - c
    big_r = r * corner / d
    seen = big_r * (a * big_r**3 + b * big_r**2 + c * big_r + d) / corner
    found = profile(ZOOM, 24.0, crop=1.0)
    inside = seen <= 1
    miss = np.abs(placed(found, r) - seen)[inside].max()
    assert 0.5 * found.fit_error < miss < 1.01 * found.fit_error < 1e-3
    assert np.abs(seen - r).max() > 20 * miss


def test_a_smaller_sensor_sees_the_middle_of_the_profile():
    whole, part = profile(ZOOM, 24.0, crop=1.0), profile(ZOOM, 24.0, crop=1.6)
    r = np.linspace(0, 1, 20)
    np.testing.assert_allclose(placed(part, r), 1.6 * placed(whole, r / 1.6), atol=1e-12)
    np.testing.assert_allclose(part.falloff.shares(r), whole.falloff.shares(r / 1.6), atol=1e-12)
    np.testing.assert_allclose(whole.falloff.shares(r), 1 - 0.9 * r**2 + 0.3 * r**4 - 0.1 * r**6, atol=1e-12)
    with pytest.raises(PhotositeError, match="crop factor 1.5 or more only, yet the camera has 1"):
        profile(EVEN, crop=1.0)


def test_linear_lateral_colour_is_a_magnification():
    assert profile(EVEN).distortion.lateral == pytest.approx((1.0004, 1.0, 0.9998), abs=1e-12)
    assert profile(FIVE).distortion.lateral == (1.0, 1.0, 1.0) and profile(FIVE).falloff is None


@pytest.mark.parametrize("focal_mm", [24.0, 31.0, 37.0, 50.0, 68.0])
def test_the_library_places_points_where_we_do(focal_mm):
    """lensfun 0.3.4 through lensfunpy, its coordinate map; it leaves the factor of the focal length in, which we take out."""
    lensfunpy = pytest.importorskip("lensfunpy", reason="lensfunpy is not installed")
    library = lensfunpy.Database(paths=[str(OWN)], load_common=False, load_bundled=False)
    lens = next(lens for lens in library.lenses if lens.model == ZOOM)
    modifier = lensfunpy.Modifier(lens, 1.0, WIDTH, HEIGHT)
    modifier.initialize(focal_mm, 4.0, 5.0, scale=1.0, pixel_format=np.float32)
    found = profile(ZOOM, focal_mm, 4.0, 5.0, crop=1.0)
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    factor = 1 - sum(lens.interpolate_distortion(focal_mm).terms)
    warp = plan_warp(found.distortion, 1e4, WIDTH, HEIGHT, 3)
    ours = warp.distorted(WIDTH / 2 + factor * (x - WIDTH / 2), HEIGHT / 2 + factor * (y - HEIGHT / 2), 1)
    theirs = modifier.apply_geometry_distortion() + 0.5
    half_px = math.hypot(WIDTH, HEIGHT) / 2
    assert np.abs(np.stack(ours, axis=-1) - theirs).max() < 1.01 * found.fit_error * half_px + 0.06  # pixels; it rounds float32
    light = np.ones((HEIGHT, WIDTH, 3), np.float32)
    assert modifier.apply_color_modification(light)
    radius = np.hypot(x - WIDTH / 2, y - HEIGHT / 2) / half_px
    np.testing.assert_allclose(1 / light[..., 1], found.falloff.shares(radius), atol=2e-3)


SHOT = """
scene: {{chart: flat_field, luminance: 100 cd/m^2, reflectance: 1}}
lens: {{focal_length: {focal}, f_number: f/2.8, focus_distance: 10 m, {more}}}
exposure: {{time: 1/200 s, iso: 100}}
camera: {{base: ideal, width: 96, height: 64, pixel_pitch: 375 um, stages: {{photon_shot_noise: null}}}}
"""


def write_shot(folder, more, focal="24 mm"):
    path = folder / "shot.yaml"
    path.write_text(SHOT.format(more=more, focal=focal))
    return path


def test_a_shot_names_a_lens_and_its_file_holds_numbers(tmp_path):
    more = f"lensfun: {{lens: niemands zoom 24-70mm, database: {OWN}}}"
    shot = load_shot(write_shot(tmp_path, more))
    found = lens_profile(ZOOM, 24.0, 2.8, 10.0, 0.375 * math.hypot(96, 64), OWN)
    assert (shot.lens.distortion, shot.lens.falloff) == (found.distortion, found.falloff)
    assert shot.lens.model == ZOOM and not shot.lens.cos4 and "lensfun" not in shot.resolved["lens"]
    mean_e = simulate(shot).mean_electrons
    x, y = np.meshgrid(np.arange(96) - 47.5, np.arange(64) - 31.5)
    radius = np.hypot(x, y) / math.hypot(48, 32)
    expected = 1 - 0.9 * radius**2 + 0.3 * radius**4 - 0.1 * radius**6  # the sensor is 36 mm wide, as the calibrated one
    np.testing.assert_allclose(mean_e / mean_e.max() * expected.max(), expected, rtol=2e-4)


def test_light_that_rises_outwards_is_counted(tmp_path):
    """The sensor's code is chosen for the range of the light, which must hold a corner brighter than the axis."""
    path = write_shot(tmp_path, "cos4: false, falloff: {k1: 0.4, k2: -0.1}")
    shot = load_shot(path, {"camera.stages.photon_shot_noise": {}})
    raw = simulate(shot)
    x, y = np.meshgrid(np.arange(96) - 47.5, np.arange(64) - 31.5)
    r2 = (x**2 + y**2) / (48**2 + 32**2)
    expected = (1 + 0.4 * r2 - 0.1 * r2**2) * raw.mean_electrons[31:33, 47:49].mean()
    np.testing.assert_allclose(raw.mean_electrons, expected, rtol=2e-3)


@pytest.mark.parametrize(
    ("more", "focal", "says"),
    [
        ("lensfun: {lens: Nobody 40mm}", "40 mm", "no such lens.*near are: Nobody 40mm f/2.4; Nobody 40mm f/2 & friends"),
        (f"lensfun: {{lens: {ZOOM}}}", "90 mm", "has 24 mm to 70 mm; set lens.focal_length"),
        ("lensfun: {lens: Nobody Fish-Eye}", "8 mm", "projection of a fish-eye"),
        (f"lensfun: {{lens: {ZOOM}}}, cos4: true", "24 mm", "cos.4 in its fall-off; leave lens.cos4 out"),
        (f"lensfun: {{lens: {ZOOM}}}, distortion: {{k1: 0.1}}", "24 mm", "leave lens.distortion out"),
    ],
)
def test_what_cannot_be_is_refused_with_the_line(tmp_path, more, focal, says):
    path = write_shot(tmp_path, more.replace("{lens:", f"{{database: {OWN}, lens:"), focal)
    with pytest.raises(PhotositeError, match=rf"shot.yaml:3: lens.lensfun = .*{says}"):
        load_shot(path)


def test_a_database_that_is_not_there_is_told(tmp_path):
    with pytest.raises(PhotositeError, match="has no .xml file; install the database"):
        lens_profile(ZOOM, 24.0, 2.8, 10.0, 43.0, tmp_path)
    (tmp_path / "bad.xml").write_text("<lensdatabase><lens>")
    with pytest.raises(PhotositeError, match="bad.xml: cannot be read"):
        lens_profile(ZOOM, 24.0, 2.8, 10.0, 43.0, tmp_path)


def test_the_installed_database_has_a_known_lens():
    if not any(list(folder.glob("*.xml")) for folder in database_folders()):
        pytest.skip("lensfun's database is not installed")
    found = lens_profile("Canon EF 50mm f/1.8 II", 50.0, 1.8, 1000.0, FULL_FRAME_DIAGONAL_MM)
    assert 0.2 < found.falloff.shares(np.array(1.0)) < 0.4  # a fast lens, wide open
    assert abs(placed(found, 0.8) - 0.8) < 0.02 and found.fit_error < 2e-3
