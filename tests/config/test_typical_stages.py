"""Typical stages of the library's cameras: off unless asked for, by the rules that their sources state."""

import re

import numpy as np
import pytest
from helpers.randomness import accept, mean_p

from data_gen.recipe.dataset_config import load_data_set
from simulator import simulate
from simulator.color.color_tables import CONFIGS
from simulator.config import load_camera, load_shot, read_camera_document
from simulator.errors import PhotositeError
from simulator.sensor.stages.thermal_generation import rate_ratio

NAMES = sorted(path.stem for path in (CONFIGS / "cameras").glob("*.yaml") if path.stem != "ideal")
TYPICAL = {"dark_current", "prnu", "dsnu", "hot_pixels"}


@pytest.mark.parametrize("name", NAMES)
def test_a_camera_has_its_typical_stages_when_asked_for_them(name):
    plain, typical = load_camera(name), load_camera(name, ["camera.typical=true"])
    assert not TYPICAL & plain.stages.keys()
    assert typical.stages.keys() == plain.stages.keys() | TYPICAL
    assert {stem: typical.stages[stem] for stem in plain.stages} == plain.stages


@pytest.mark.parametrize("name", NAMES)
def test_the_numbers_follow_from_their_sources(name):
    stages = load_camera(name, ["camera.typical=true"]).stages
    camera, sources = load_camera(name), read_camera_document(name).data["camera"]["typical_stages"]["source"]
    assert all(text.startswith("assumed, ") for text in sources.values())
    rate, at, pitch = re.search(r"([\d.]+) e-/s at (-?\d+) degC in photosites of ([\d.]+) um", sources["dark_current"]).groups()
    dark, hot = stages["dark_current"], stages["hot_pixels"]
    expected = float(rate) * (camera.pixel_pitch_um / float(pitch)) ** 2
    assert dark.rate_e_per_s == pytest.approx(expected, rel=5e-3)
    assert dark.measured_at_k == hot.measured_at_k == pytest.approx(float(at) + 273.15)
    assert "100 times the dark current" in sources["hot_pixels.rate, hot_pixels.measured_at"]
    assert hot.rate_e_per_s == pytest.approx(100 * dark.rate_e_per_s, rel=5e-3)
    assert f"{100 * hot.share:g} % warm pixels" in sources["hot_pixels.share"]
    settings = [camera.iso_setting(iso) for iso in camera.isos]
    lowest_e = min(setting.read_noise_dn / setting.gain_dn_per_e for setting in settings)
    assert stages["dsnu"].sigma_e == pytest.approx(lowest_e / 4, rel=0.05)  # two digits
    shares = [float(text) / 100 for text in re.findall(r"([\d.]+) %", sources["prnu"])]
    assert stages["prnu"].sigma == pytest.approx(np.mean(shares))


def test_a_dark_frame_has_the_dark_current_at_the_sensor_s_temperature():
    settings = {"camera": "sony_a7s2", "camera.typical": True, "exposure.time": "30 s", "exposure.iso": 3200}
    settings |= {"scene.luminance": "1e-9 cd/m^2", "camera.window": {"x": 0, "y": 0, "width": 128, "height": 128}}
    shot = load_shot("flat_field", settings | {"camera.typical_stages.hot_pixels": None})
    raw = simulate(shot)
    mean_e = 0.0549 * rate_ratio(298.15, 263.15) * 30.0
    gain = shot.camera.iso_setting(3200).gain_dn_per_e
    noise = shot.camera.iso_setting(3200)
    variance = gain**2 * (mean_e + shot.camera.stages["dsnu"].sigma_e ** 2) + noise.read_noise_dn**2
    of_mean = variance / raw.dn.size + noise.row_noise_dn**2 / raw.dn.shape[0]
    accept({"mean": mean_p(float(raw.dn.mean()), shot.camera.black_level_dn + gain * mean_e, of_mean)})


def test_own_stages_replace_typical_ones_and_null_takes_one_away(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("base: nikon_d850\ntypical: true\nstages: {prnu: {sigma: 0.01}}\ntypical_stages: {dsnu: null}\n", "utf-8")
    stages = load_camera(str(path)).stages
    assert stages["prnu"].sigma == 0.01 and "dsnu" not in stages and "hot_pixels" in stages


def test_a_resolved_shot_has_the_stages_alone_and_is_taken_again():
    plain, shot = (load_shot("flat_field", {"camera.typical": wanted}) for wanted in (False, True))
    for one in (plain, shot):
        assert not {"typical", "typical_stages"} & one.resolved["camera"].keys()
    assert plain.resolved == load_shot("flat_field").resolved and TYPICAL < shot.resolved["camera"]["stages"].keys()


def test_a_data_set_s_camera_can_have_them():
    found = load_data_set("sony_a7s2_drawings", ["noise.cameras.sony_a7s2.camera.typical=true"])
    assert TYPICAL < found.noise.cameras["sony_a7s2"].camera.stages.keys()
    assert TYPICAL < load_data_set("own_prior", ["noise.camera.typical=true"]).noise.camera.stages.keys()


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("camera.typical=true", "camera.typical = true: this camera states no typical_stages"),
        ("camera.typical=often", "camera.typical = often: give true or false"),
        ("camera.tipical=true", "camera.tipical: unknown key; did you mean `typical`"),
    ],
)
def test_a_switch_that_means_nothing_is_told(setting, message):
    with pytest.raises(PhotositeError, match=message):
        load_camera("ideal", [setting])
