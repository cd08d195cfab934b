"""Shots as clean pictures: the simulator's own mean electrons, over those that saturate the camera."""

import numpy as np
import pytest

from data_gen.sources.shots import Shots, saturating_electrons
from data_gen.sources.source import apply_cfa
from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate

SHOT = """
scene: {{chart: color_checker, luminance: 120 cd/m^2, illuminant: {light}, depth: 2 m}}
lens: {{focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}}
exposure: {{time: 1/15 s, iso: {iso}}}
camera: {{base: sony_a7s2, window: {{x: 2001, y: 1400, width: 90, height: 61}}{camera}}}
{sweep}
"""


def write_shot(folder, iso=100, light="D65", camera="", sweep=""):
    path = folder / "chart.yaml"
    path.write_text(SHOT.format(iso=iso, light=light, camera=camera, sweep=sweep))
    return path


def read(path, name="chart"):
    return Shots(path).read(name, np.random.default_rng(0))


@pytest.mark.parametrize("iso", [100, 1600])
def test_planes_are_the_mean_electrons_of_the_shot(tmp_path, iso):
    path = write_shot(tmp_path, iso, "A")
    picture, raw = read(path), simulate(load_shot(path))
    gain = {100: 0.09563, 1600: 1.53008}[iso]  # configs/cameras/sony_a7s2.yaml; black 512, white 16383 DN
    expected = raw.mean_electrons.astype(np.float64) * gain / (16383 - 512)
    assert Shots(path).names() == ("chart",) and picture.cfa is None and raw.cfa == "GRBG"
    np.testing.assert_allclose(apply_cfa(picture.signal, raw.cfa), expected, rtol=1e-4)
    assert picture.signal.shape == (61, 90, 3) and picture.signal.dtype == np.float32
    neutral = np.array(raw.as_shot_neutral)
    np.testing.assert_allclose(picture.white_balance, neutral[1] / neutral, rtol=1e-9)
    np.testing.assert_allclose(picture.color_matrix, raw.color_matrix)


def test_one_is_where_the_code_reaches_white(tmp_path):
    """At ISO 12800 some patches are too bright for the sensor: codes saturate where the signal does."""
    path = write_shot(tmp_path, 12800)
    picture, raw = read(path), simulate(load_shot(path))
    own = apply_cfa(picture.signal, raw.cfa)
    at_white = raw.noise_free_dn >= raw.white_level_dn - 0.5
    assert at_white.any() and (own[at_white] > 0.9999).all()
    assert (own[~at_white] < 1.0001).all() and not at_white.all()


def test_a_sweep_gives_every_point_a_name(tmp_path):
    path = write_shot(tmp_path, sweep="sweep: {vary: {exposure.time: [1/30 s, 1/60 s]}}")
    shots = Shots(path)
    assert shots.names() == ("chart_0000", "chart_0001")
    first, second = (shots.read(name, np.random.default_rng(0)).signal for name in shots.names())
    np.testing.assert_allclose(first, 2 * second, rtol=1e-5)


def test_crosstalk_leaves_the_mosaic_of_the_camera(tmp_path):
    path = write_shot(tmp_path, camera=", crosstalk: {optical: 0.05}")
    picture, raw = read(path), simulate(load_shot(path))
    assert picture.cfa == raw.cfa == "GRBG"
    np.testing.assert_allclose(picture.signal, raw.mean_electrons / 165963.0, rtol=1e-4)


def test_binned_charge_saturates_at_the_same_code(tmp_path):
    path = write_shot(tmp_path, camera=", binning: {factor: 2, mode: charge}").read_text().replace("x: 2001", "x: 2000")
    (tmp_path / "chart.yaml").write_text(path.replace("height: 61", "height: 64").replace("width: 90", "width: 88"))
    picture, raw = read(tmp_path / "chart.yaml"), simulate(load_shot(tmp_path / "chart.yaml"))
    assert picture.signal.shape == raw.dn.shape == (32, 44)
    linear = (raw.noise_free_dn.astype(np.float64) - 512) / (16383 - 512)
    dim = linear < 0.99
    np.testing.assert_allclose(picture.signal[dim], linear[dim], rtol=1e-3)


def test_optical_black_is_cut_off(tmp_path):
    text = write_shot(tmp_path, camera=", optical_black: {left: 2010, top: 1402}, crosstalk: {optical: 0.05}").read_text()
    (tmp_path / "chart.yaml").write_text(text.replace("x: 2001", "x: 2002"))
    picture, raw = read(tmp_path / "chart.yaml"), simulate(load_shot(tmp_path / "chart.yaml"))
    assert raw.active_area == (2, 8, 61, 90) and raw.cfa == "RGGB" == picture.cfa
    np.testing.assert_allclose(picture.signal, raw.mean_electrons[2:, 8:] / 165963.0, rtol=1e-4)


def test_a_monochrome_shot_is_its_mosaic(tmp_path):
    (tmp_path / "chart.yaml").write_text(
        "scene: {chart: grey_ramp, luminance: 120 cd/m^2}\nlens: {focal_length: 50 mm, f_number: f/4}\n"
        "exposure: {time: 1/200 s, iso: 100}\ncamera: {base: ideal, window: {x: 0, y: 0, width: 60, height: 40}}\n"
    )
    picture = read(tmp_path / "chart.yaml")
    assert picture.cfa == "MONO" and picture.signal.shape == (40, 60) and picture.white_balance == (1, 1, 1)


def test_saturation_counts_electrons_of_the_camera_file(tmp_path):
    assert saturating_electrons(plan(load_shot(write_shot(tmp_path, 100))).sensor) == pytest.approx(15871 / 0.09563, rel=1e-4)


def test_what_cannot_be_exposed_is_refused_by_name(tmp_path):
    path = write_shot(tmp_path)
    with pytest.raises(PhotositeError, match=r"shot = other: no such shot in .*chart\.yaml, which has chart to chart"):
        read(path, "other")
    path.write_text(path.read_text().replace("f/4", "f/0"))
    with pytest.raises(PhotositeError, match=r"chart\.yaml"):
        Shots(path).names()
    text = write_shot(tmp_path).read_text()
    path.write_text(text.replace("chart: color_checker", "image: gone.exr"))
    with pytest.raises(PhotositeError, match=r"chart\.yaml: chart: scene\.image = .*gone\.exr: no such file"):
        read(path)
