"""The shipped configurations: every number has a source, and derived ones follow from the measured ones."""

import numpy as np
import pytest
import yaml

from simulator.config import load_shot, shot_warnings
from simulator.config.layers import CONFIGS

SHOTS = sorted((CONFIGS / "shots").glob("*.yaml"))
CAMERAS = sorted((CONFIGS / "cameras").glob("*.yaml"))


def camera_of(name: str):
    return load_shot(CONFIGS / "shots" / "flat_field.yaml", {"camera": name}).camera


@pytest.mark.parametrize("path", SHOTS, ids=lambda path: path.stem)
def test_shipped_shots_load(path):
    assert load_shot(path).name == path.stem


@pytest.mark.parametrize("path", CAMERAS, ids=lambda path: path.stem)
def test_every_number_of_a_camera_names_its_source(path):
    camera = yaml.safe_load(path.read_text())
    source = camera["source"]
    if isinstance(source, dict):
        sourced = {key for names in source for key in names.split(", ")}
        identity = {"source", "make", "model", "response", "stages"}  # names; and sections with sources of their own
        assert set(camera) - identity <= sourced
        for stem, stage in camera["stages"].items():
            assert stage == {} or "source" in stage, stem
    else:
        assert source.startswith("assumed")
    if "file" in camera["response"]:
        response = yaml.safe_load((CONFIGS / "responses" / f"{camera['response']['file']}.yaml").read_text())
        assert response["source"] and response["license"]
    else:
        assert camera["response"]["source"]


def test_sony_a7s2_is_the_published_camera():
    camera = camera_of("sony_a7s2")
    assert (camera.width_px, camera.height_px, camera.cfa, camera.bit_depth, camera.black_level_dn) == (
        4240,
        2832,
        "RGGB",
        14,
        512,
    )
    assert camera.pixel_pitch_um == pytest.approx(35.6e3 / 4240, abs=0.005)
    assert len(camera.iso_table) == 28
    # PMN's calibration: K = 0.0009563 ISO exactly; the steps 64, 160, 320 ... are nominal settings.
    for iso, setting in camera.iso_table.items():
        assert setting.gain_dn_per_e == pytest.approx(0.0009563 * iso, rel=1e-6)
    full_scale_e = (2**14 - 1 - 512) / camera.iso_table[100].gain_dn_per_e
    assert camera.stages["full_well"].capacity_e == pytest.approx(full_scale_e, abs=0.5)


def test_sony_a7s2_read_noise_after_gain_is_the_two_source_fit():
    camera = camera_of("sony_a7s2")
    rows = [(setting.gain_dn_per_e, setting.read_noise_dn) for iso, setting in camera.iso_table.items() if 100 <= iso <= 1600]
    gain, sigma = np.array(rows).T
    terms = np.stack([gain**2, np.ones_like(gain)], axis=1) / sigma[:, None] ** 2
    (before_squared, after_squared), *_ = np.linalg.lstsq(terms, np.ones_like(gain), rcond=None)
    assert np.sqrt(before_squared) == pytest.approx(4.42, abs=0.01)
    assert camera.read_noise_after_gain_dn == pytest.approx(np.sqrt(after_squared), abs=0.005)
    fitted = np.sqrt(before_squared * gain**2 + after_squared)
    assert np.abs(fitted / sigma - 1).max() < 0.085
    assert camera.read_noise_after_gain_dn < min(setting.read_noise_dn for setting in camera.iso_table.values())


def test_the_ideal_camera_counts_photons_only():
    camera = camera_of("ideal")
    assert np.all(camera.response.quantum_efficiency == 1.0)
    assert (camera.response.wavelengths_nm[0], camera.response.wavelengths_nm[-1]) == (400.0, 700.0)
    stages = camera.sensor_stages(100, 0.01)
    assert set(stages) == {"photon_shot_noise", "analog_gain", "adc"} and stages["analog_gain"].gain_dn_per_e == 1.0


@pytest.mark.parametrize("name", ["motorcycle_wide_open", "motorcycle_stopped_down", "color_checker", "grey_ramp"])
def test_white_lands_about_one_stop_below_clipping(name):
    shot = load_shot(CONFIGS / "shots" / f"{name}.yaml")
    lens = shot.lens
    magnification = lens.focal_length_mm / (1e3 * lens.focus_distance_m - lens.focal_length_mm)
    illuminance_lx = np.pi * shot.scene.luminance_cd_m2 / (1 + 4 * lens.f_number**2 * (1 + magnification) ** 2)
    saturation_lx_s = 78 / shot.exposure.iso  # ISO 12232:2019, saturation-based speed
    stops = np.log2(saturation_lx_s / (illuminance_lx * shot.exposure.time_s))
    assert 0.9 < stops < 1.2


def test_only_the_high_iso_shot_has_a_word_of_warning():
    warned = {path.stem for path in SHOTS if shot_warnings(load_shot(path))}
    assert warned == {"motorcycle_stopped_down"}
