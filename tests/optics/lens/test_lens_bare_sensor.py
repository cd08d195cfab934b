"""No lens: every photosite gathers the scene weighted by its solid angle and the cosine."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import FixedScene, band_scene

import simulator
from simulator.command_line.lens_numbers import lens_facts
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.statistics.inspection import inspect_raw
from simulator.optics.lens.bare_sensor import BareSensor, hemisphere_fractions, integrate_hemisphere
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.save import save
from simulator.scene.scene import Layer

CHART = Path(__file__).parents[3] / "configs" / "shots" / "color_checker.yaml"


@pytest.mark.parametrize(("height", "width", "angle"), [(3, 5, 60.0), (8, 8, 140.0), (1, 1, 20.0)])
def test_shares_are_the_integral_of_the_cosine_over_the_solid_angle(height, width, angle):
    """Truth: a midpoint sum over 200 x 200 directions in each pixel of cos dOmega / pi = dx dy / (pi (1 + x^2 + y^2)^2)."""
    step = 2 * math.tan(math.radians(angle / 2)) / width
    fine = (np.arange(200) + 0.5) / 200
    x = step * (np.arange(width)[:, None] + fine - width / 2).ravel()
    y = step * (np.arange(height)[:, None] + fine - height / 2).ravel()
    density = (step / 200) ** 2 / (math.pi * (1 + x**2 + y[:, None] ** 2) ** 2)
    expected = density.reshape(height, 200, width, 200).sum(axis=(1, 3))
    assert np.allclose(hemisphere_fractions(height, width, angle), expected, rtol=1e-4)


def test_a_scene_that_fills_the_hemisphere_has_all_of_it():
    assert hemisphere_fractions(64, 64, 179.99).sum() == pytest.approx(1.0, abs=2e-4)
    assert hemisphere_fractions(3, 4, None).sum() == pytest.approx(1.0)


def frame(scene, camera=None) -> np.ndarray:
    return simulate(Shot(scene, BareSensor(), Exposure(1e-3), camera or small_camera())).mean_electrons


def test_the_frame_is_uniform_and_has_pi_times_the_radiance_of_a_hemisphere():
    image = frame(band_scene(np.random.default_rng(1).uniform(0.0, 2.0, (40, 40))))
    assert np.ptp(image) == 0.0
    through_lens = simulate(Shot(band_scene(np.ones((4, 4))), ThinLens(50.0, 8.0, cos4=False), Exposure(1e-3), small_camera()))
    hemisphere = frame(band_scene(np.ones((4, 4))))
    assert hemisphere[0, 0] / through_lens.mean_electrons[0, 0] == pytest.approx(1 + 4 * 64, rel=1e-5)  # pi over pi / 257


def test_each_colour_gathers_its_own_light_by_the_scene_s_geometry():
    planes = np.random.default_rng(2).uniform(0.0, 1.0, (6, 9, 3))
    shares = hemisphere_fractions(6, 9, 70.0)
    camera = small_camera(cfa="RGGB")
    image, white = frame(band_scene(planes, field_of_view_deg=70.0), camera), frame(band_scene(np.ones((2, 2, 3))), camera)
    blue, green, red = (shares[..., None] * planes).sum(axis=(0, 1))
    found = image / white
    assert [found[0, 0], found[0, 1], found[1, 1]] == pytest.approx([red, green, blue], rel=1e-6)


def test_what_stands_in_front_hides_what_lies_behind():
    scene = band_scene(np.ones((4, 4))).scene
    coverage = np.full((4, 4), 0.25, np.float32)
    layered = replace(scene, planes=scene.planes * 0.25 * 2.0, coverage=coverage, behind=(Layer(scene.planes * 8.0),))
    assert integrate_hemisphere(layered).planes[0, 0, 0] == pytest.approx(0.25 * 2.0 + 0.75 * 8.0)
    assert frame(FixedScene(layered)).max() == pytest.approx(6.5 * frame(FixedScene(scene)).max(), rel=1e-6)


def test_a_shot_file_states_a_bare_sensor_and_its_file_tells_of_no_lens(tmp_path):
    small = {"camera.window": {"x": 0, "y": 0, "width": 64, "height": 48}, "exposure.time": "1 us", "truth": ["blur", "depth"]}
    shot = simulator.load_shot(CHART, {"lens": {"bare_sensor": {}}, **small})
    assert shot.lens == BareSensor() and shot.resolved["lens"] == {"bare_sensor": {"model": "no lens"}}
    raw = simulate(shot)
    assert np.isinf(raw.truth["blur"]).all() and np.isinf(raw.truth["depth"]).all()
    save(raw, tmp_path)
    found = inspect_raw(tmp_path / "color_checker.dng")
    assert (found.lens, found.f_number, found.focal_length_mm) == ("no lens", None, None)
    planned = plan(shot)
    assert "without a lens" in planned.optics.scene.notes[-1]
    assert lens_facts(shot, planned)[0].value == "3.14159 sr"


def test_keys_of_another_lens_are_refused():
    with pytest.raises(PhotositeError, match="lens.f_number: is of another kind .*lens bare sensor"):
        simulator.load_shot(CHART, {"lens": {"bare_sensor": {}, "f_number": 4}})
