"""Frames of the library's cameras have the noise and the levels of their files."""

import math
from dataclasses import replace

import numpy as np
import pytest
import rawpy
from helpers.randomness import accept, variance_p
from helpers.scene_builders import FixedScene, band_scene
from scipy.stats import tukeylambda

from simulator.color.color_tables import CONFIGS
from simulator.config import load_camera, load_shot
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.writer import write_dng
from simulator.sensor.camera.camera_sections import Window


def photograph(camera, iso: int, radiance: float):
    """Raw frame of an even surface."""
    scene = band_scene(np.ones((4, 4)), depth_m=math.inf).load()
    lit = FixedScene(replace(scene, planes=np.full_like(scene.planes, radiance)))
    return simulate(Shot(lit, ThinLens(50.0, 2.0, cos4=False), Exposure(0.01, iso), camera))


@pytest.mark.parametrize(
    ("iso", "black_dn", "white_dn"), [(100, 513, 14008), (160, 512, 10838), (320, 2048, 10838), (400, 2049, 14448)]
)
def test_black_and_white_of_the_iso_reach_the_dng(iso, black_dn, white_dn, tmp_path):
    camera = replace(load_camera("canon_5d_mark_iv"), window=Window(1000, 1000, 64, 48), stages={})
    dark, bright = photograph(camera, iso, 0.0), photograph(camera, iso, 1e9)
    setting = camera.iso_setting(iso)
    noise_dn = math.hypot(setting.read_noise_dn, setting.row_noise_dn)
    assert dark.dn.mean() == pytest.approx(black_dn, abs=5 * noise_dn / math.sqrt(48))  # 48 rows share their noise
    assert (bright.dn == white_dn).all()
    write_dng(bright, tmp_path / "frame.dng")
    with rawpy.imread(str(tmp_path / "frame.dng")) as frame:
        assert frame.black_level_per_channel == [black_dn] * 4
        assert frame.white_level == white_dn


DARK = [("sony_a7s2", iso) for iso in (100, 1600, 2000, 25600)]
DARK += [("nikon_d850", 6400), ("sony_a7_iii", 500), ("sony_a7_iii", 640)]


def test_a_dark_frame_has_the_read_and_row_noise_of_the_file():
    chances = {}
    for name, iso in DARK:
        camera = replace(load_camera(name), window=Window(0, 0, 400, 300), stages={})
        setting, codes = camera.iso_setting(iso), photograph(camera, iso, 0.0).dn.astype(np.float64)
        within = math.sqrt(400 / 399) * (codes - codes.mean(axis=1, keepdims=True))
        shape = setting.tukey_lambda
        kurtosis = 0.0 if shape is None else float(tukeylambda.stats(shape, moments="k"))
        variance = setting.read_noise_dn**2 + 1 / 12  # of rounding to codes
        chances[name, iso, "read"] = variance_p(within, variance, kurtosis)
        chances[name, iso, "row"] = variance_p(codes.mean(axis=1), setting.row_noise_dn**2 + variance / 400)
    accept(chances)


def test_the_dng_carries_the_fitted_matrix_unless_the_published_one_is_asked_for():
    shot = CONFIGS / "shots" / "flat_field.yaml"
    overrides = ["camera=nikon_d850", "camera.window={x: 0, y: 0, width: 64, height: 48}"]
    published = np.array(load_camera("nikon_d850").color_matrix.xyz_to_camera)
    fitted = simulate(load_shot(shot, overrides)).color_matrix
    asked = simulate(load_shot(shot, [*overrides, "camera.color_matrix.in_dng=true"])).color_matrix
    assert np.array_equal(asked, published) and not np.allclose(fitted, published, atol=0.05)
