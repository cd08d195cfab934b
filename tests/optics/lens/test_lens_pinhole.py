"""The hole instead of a lens: its light and its shadow by integration, its sharpest size from wave optics."""

import math
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene
from helpers.wave_optics import half_light_radius, spot
from scipy.optimize import minimize_scalar

import simulator
from simulator.command_line.lens_numbers import lens_facts
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.pinhole import SHARPEST, Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate

CHART = Path(__file__).parents[3] / "configs" / "shots" / "color_checker.yaml"
NODES, WEIGHTS = np.polynomial.legendre.leggauss(120)


def integrated_sr(hole: Pinhole, radius_mm: float) -> float:
    """E / L at a distance from the axis: integral of cos^2 / r^2 over the hole, by Gauss and the trapezoid rule."""
    rho = 0.25 * hole.diameter_mm * (NODES + 1.0)
    phi = np.arange(64) * 2 * math.pi / 64
    square = hole.distance_mm**2 + rho[:, None] ** 2 + radius_mm**2 - 2 * rho[:, None] * radius_mm * np.cos(phi)
    ring = (hole.distance_mm**2 / square**2).mean(axis=1) * 2 * math.pi
    return float(np.sum(ring * rho * 0.25 * hole.diameter_mm * WEIGHTS))


@pytest.mark.parametrize("diameter_mm", [0.05, 0.3, 5.0, 40.0])
def test_irradiance_on_the_axis_is_the_integral_over_the_hole(diameter_mm):
    hole = Pinhole(diameter_mm, 50.0)
    assert hole.irradiance_per_radiance_sr() == pytest.approx(integrated_sr(hole, 0.0), rel=1e-12)


def test_off_the_axis_a_small_hole_gives_cos4():
    """To the square of diameter over distance: 3.6e-5 for 0.3 mm before 50 mm."""
    hole = Pinhole(0.3, 50.0)
    for radius_mm in (5.0, 15.0, 30.0):
        cos4 = 1 / (1 + (radius_mm / 50.0) ** 2) ** 2
        assert integrated_sr(hole, radius_mm) == pytest.approx(hole.irradiance_per_radiance_sr() * cos4, rel=3.6e-5)


@pytest.mark.parametrize("depth_m", [0.05, 0.3, 2.0, math.inf])
def test_the_shadow_of_the_hole_is_where_straight_rays_end(depth_m):
    hole = Pinhole(0.4, 60.0)
    edges_mm = np.array([-0.2, 0.2])
    ends_mm = edges_mm * (1 + 60.0 / (1e3 * depth_m))  # from a point on the axis through both edges
    assert hole.blur_radius_um(depth_m) == pytest.approx(-500 * np.ptp(ends_mm), rel=1e-12)


def test_a_hole_is_a_lens_focused_beyond_infinity():
    """The blur of a thin lens with 1 / z_focus = -1 / v: the same sign and size, linear in 1 / z."""
    hole, inverse = Pinhole(0.4, 60.0), np.array([0.0, 0.5, 1.0, 1.5])
    with np.errstate(divide="ignore"):
        radii = hole.blur_radius_um(1 / inverse)
    assert np.allclose(np.diff(radii), radii[1] - radii[0]) and (radii < 0).all()
    assert hole.blur_radius_um(math.inf) == pytest.approx(0.5 * 0.4 * 60.0 * 1e3 * (-1 / 60.0 - 0.0))


def test_the_sharpest_hole_has_half_of_the_light_in_the_smallest_circle():
    found = minimize_scalar(half_light_radius, bounds=(1.2, 1.9), method="bounded", options={"xatol": 1e-6})
    assert found.x == pytest.approx(SHARPEST, abs=5e-4)
    assert half_light_radius(1.9) / found.fun == pytest.approx(1.30, abs=0.005)  # Rayleigh's hole: 30 % wider


def test_other_measures_of_sharpness_give_other_constants():
    """Peak per light: sin^2(a) / a with a = pi c^2 / 8 is greatest at tan a = 2 a. The rms width grows without end."""
    holes = np.linspace(1.6, 1.9, 301)
    peaks = [spot(hole, np.zeros(1))[0] / hole**2 for hole in holes]
    best = holes[int(np.argmax(peaks))]
    angle = math.pi * best**2 / 8
    assert best == pytest.approx(1.723, abs=1e-3) and math.tan(angle) == pytest.approx(2 * angle, rel=5e-3)
    widths = []
    for reach in (4.0, 8.0, 16.0):
        x = np.linspace(0.0, reach, 8001)
        widths.append(np.sum(spot(SHARPEST, x) * x**3) / np.sum(spot(SHARPEST, x) * x))
    assert widths[2] / widths[1] > 1.7 and widths[1] / widths[0] > 1.7  # in proportion to how far out one looks


def test_a_frame_through_a_pinhole_has_the_light_of_its_hole():
    scene, camera, hole = band_scene(np.ones((4, 4)), 2.0), small_camera(), Pinhole(0.3, 50.0, cos4=False)
    through_hole = simulate(Shot(scene, hole, Exposure(1.0), camera)).mean_electrons
    through_lens = simulate(Shot(scene, ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(1.0), camera)).mean_electrons
    lens_sr = math.pi / (1 + 4 * (8.0 * 2000 / 1950) ** 2)
    assert np.allclose(through_hole / through_lens, integrated_sr(hole, 0.0) / lens_sr, rtol=2e-6)


def test_a_frame_through_a_pinhole_is_blurred_by_its_shadow():
    """A bright line through a hole 40 photosites wide, at 0.1 m: a chord profile of diameter 40 (1 + 50 / 100) = 60."""
    planes = np.zeros((96, 192))
    planes[:, 96] = 1.0
    camera, hole = small_camera(192, 96, pixel_pitch_um=7.5), Pinhole(0.3, 50.0, cos4=False, diffraction=False)
    row = simulate(Shot(band_scene(planes, 0.1, interpolation="nearest"), hole, Exposure(1.0), camera)).mean_electrons[48]
    lit = np.flatnonzero(row > 0)
    assert lit[-1] - lit[0] + 1 == pytest.approx(61, abs=1)  # the line is one photosite wide
    edges = np.clip((np.arange(193) - 96.5) / 30.0, -1.0, 1.0)
    chord = np.diff(edges * np.sqrt(1.0 - edges**2) + np.arcsin(edges))  # area of the disk in each column
    assert (
        np.abs(row / row.sum() - chord / chord.sum()).max() < 5e-4
    )  # of 0.021: the blur is exact by row, this looks by column


def test_a_shot_file_states_a_pinhole_and_explain_shows_its_sharpest_size():
    shot = simulator.load_shot(CHART, {"lens": {"pinhole": {"diameter": "0.3 mm", "distance": "50 mm"}}})
    assert shot.lens == Pinhole(0.3, 50.0) and shot.lens.has_diffraction
    told = {fact.quantity: fact.value for fact in lens_facts(shot, plan(shot))}
    assert told["sharpest hole"] == "0.248 mm"  # 1.4944 sqrt(0.00055 * 50)
    assert told["sharpest, Rayleigh"] == "0.315 mm"
    assert told["blur circle at infinity"].startswith("300 um")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.0, 50.0), "lens.pinhole.diameter = 0 mm: .* the sharpest is 0.25 mm wide"),
        ((60.0, 50.0), "lens.pinhole.diameter = 60 mm: no small hole 50 mm before the sensor"),
        ((math.nan, 50.0), "lens.pinhole.diameter = nan mm"),
        ((0.3, 0.0), "lens.pinhole.distance = 0 mm"),
        ((0.3, math.inf), "lens.pinhole.distance = inf mm"),
    ],
)
def test_impossible_holes_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=message):
        Pinhole(*arguments)
