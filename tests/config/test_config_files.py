"""The shipped configurations load and are what they say; tests/config/test_camera_library.py has the cameras' numbers."""

import numpy as np
import pytest

from simulator.color.color_tables import CONFIGS
from simulator.config import load_camera, load_shot, shot_warnings
from simulator.config.document import parse_document

SHOTS = sorted((CONFIGS / "shots").glob("*.yaml"))


@pytest.mark.parametrize("path", SHOTS, ids=lambda path: path.stem)
def test_shipped_shots_load(path):
    assert load_shot(path).name == path.stem


def test_sony_a7s2_is_the_published_camera():
    camera = load_camera("sony_a7s2")
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


def test_the_ideal_camera_counts_photons_only():
    camera = load_camera("ideal")
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


def test_only_shots_at_a_high_iso_have_a_word_of_warning():
    warned = {path.stem for path in SHOTS if shot_warnings(load_shot(path))}
    assert warned == {"motorcycle_stopped_down", "small_sensor"}


@pytest.mark.parametrize("path", sorted(CONFIGS.rglob("*.yaml")), ids=lambda path: path.stem)
def test_the_quick_parser_reads_what_comes_with_photosite_as_the_careful_one_does(path):
    text = path.read_text(encoding="utf-8")
    quick, careful = (parse_document(text, path.name, path.parent, is_ours=ours) for ours in (True, False))
    assert quick.data == careful.data and quick.places == careful.places
