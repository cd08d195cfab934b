"""The reference blur of layers whose pixels no grid of samples divides, and of scenes of fewer pixels than photosites."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest
import yaml
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.stats import qmc

from simulator import load_shot, simulate
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.reference_mosaic import light_limit
from simulator.pipeline.shot import Shot


@pytest.mark.parametrize("size", [(26, 21), (29, 23)])
def test_layers_of_any_scale_are_followed_by_rays(tmp_path, size):
    """Even light behind half a layer of the same light, out of focus: every photosite has the same."""
    alpha = np.repeat([[1.0] * 40 + [0.0] * 40], 64, axis=0).astype(np.float32)
    np.save(tmp_path / "light.npy", np.full((64, 80), 0.5, np.float32))
    np.save(tmp_path / "alpha.npy", alpha)
    document = {
        "name": "halves",
        "scene": {
            "layers": [
                {"image": "light.npy", "alpha_image": "alpha.npy", "depth": "1.9 m"},
                {"image": "light.npy", "depth": "2.1 m"},
            ],
            "luminance": "20 cd/m^2",
        },
        "lens": {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m", "cos4": False},
        "exposure": {"time": "1/100 s", "iso": 100},
        "camera": {"base": "ideal", "width": size[0], "height": size[1]},
        "tolerance": 0,
    }
    (tmp_path / "halves.yaml").write_text(yaml.safe_dump(document), "utf-8")
    electrons = simulate(load_shot(tmp_path / "halves.yaml")).mean_electrons
    assert electrons == pytest.approx(np.full(electrons.shape, electrons[0, 0]), rel=1e-5)


@pytest.mark.parametrize(("tolerance", "most"), [(0.0, 0.006), (0.1, 0.03)])
def test_blurred_photosites_of_a_coarse_scene_are_means_over_their_area(tolerance, most):
    """Random pixels, 0.7 to a photosite, R = 0.3: against points of photosite and aperture; at its middle 0.13 off."""
    picture, camera = np.random.default_rng(3).random((14, 21)), small_camera(30, 20)
    lens = ThinLens(50.0, 2.0, focus_distance_m=2.0, cos4=False)
    per_px = np.asarray(lens.blur_radius_um(np.array([2.0, 2.2]))) / camera.pixel_pitch_um
    depth_m = 1.0 / (0.5 + (1.0 / 2.2 - 0.5) * 0.3 / abs(per_px[1]))
    shot = Shot(band_scene(picture, depth_m), lens, Exposure(0.01), camera, tolerance=tolerance)
    radius_px = abs(float(lens.blur_radius_um(depth_m))) / camera.pixel_pitch_um
    points = qmc.Sobol(4, seed=1).random_base2(13)
    turn, reach = 2.0 * np.pi * points[:, 2], radius_px * np.sqrt(points[:, 3])
    inside = points[:, :2] + np.column_stack([reach * np.cos(turn), reach * np.sin(turn)])
    row, column = (side[..., None] for side in np.mgrid[:20, :30])
    places = 0.7 * (row + inside[:, 1]) - 0.5, 0.7 * (column + inside[:, 0]) - 0.5
    truth = map_coordinates(picture, places, order=1, mode="nearest").mean(axis=2)
    light = simulate(shot).mean_electrons.astype(float)
    even = simulate(replace(shot, scene=band_scene(np.ones((14, 21)), depth_m))).mean_electrons.astype(float)
    assert np.abs(light / even - truth).max() < most


def test_few_rays_cross_the_border_of_a_tiny_circle_but_some_do():
    """R = 0.0005 beside a step, two pixels per photosite: 2 R / 3 pi of it; some photosites had nothing of it."""
    picture, camera = np.repeat([[0.2] * 16 + [1.0] * 16], 16, axis=0), small_camera(16, 8)
    lens = ThinLens(50.0, 2.0, focus_distance_m=2.0, cos4=False)
    per_dioptre = abs(float(lens.blur_radius_um(math.inf) - lens.blur_radius_um(1.0))) / camera.pixel_pitch_um
    scenes = (band_scene(light, 1.0 / (0.5 - 0.0005 / per_dioptre)) for light in (picture, np.ones((16, 32))))
    light, even = (simulate(Shot(one, lens, Exposure(0.3), camera, tolerance=0.0)).mean_electrons for one in scenes)
    step = (light / even).astype(float)[:, 7:9]
    share = 2.0 * 0.0005 / (3.0 * math.pi)
    assert step == pytest.approx(np.array([[0.2 + 0.8 * share, 1.0 - 0.8 * share]] * 8), abs=0.2 * share)


def test_lights_before_black_are_small_lights_in_the_colours_that_they_have():
    """The mean of such a scene is 0, and a colour without light has no light to compare with."""
    light = np.zeros((64, 64), np.float32)
    light[5, 7] = 3.0
    scene = band_scene(light, 2.0).load()
    weights = np.ones((scene.planes.shape[2], 2), np.float32) * np.array([1.0, 0.0], np.float32)
    with warnings.catch_warnings(action="error"):
        found = light_limit(scene, weights)
    assert found is not None
    limit, kept = found
    assert 0.0 < limit[0] < 1e-3 * light.max() and limit[1] == 0.0
    assert (kept < limit + 1e-30).all() and np.isfinite(kept).all()
