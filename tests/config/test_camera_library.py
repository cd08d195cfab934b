"""The camera library: every number has a source, and what is derived follows from what it is derived from."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from simulator.color.color_tables import CONFIGS
from simulator.color.spectra import WAVELENGTHS_NM, efficiency_on, illuminant, luminance_cd_m2, photons_per_joule
from simulator.config import load_camera, load_shot, read_camera_document
from simulator.errors import PhotositeError
from simulator.sensor.stages.stage import Moments

SHARED = Path(__file__).parents[3] / "shared"  # beside the checkout, where there is one
CURVES, COLLECTED = SHARED / "data" / "spectral_sensitivity", SHARED / "facts" / "camera_facts.json"
NAMES = sorted(path.stem for path in (CONFIGS / "cameras").glob("*.yaml"))
ILLUSTRATIVE = sorted(f"illustrative/{path.stem}" for path in (CONFIGS / "cameras" / "illustrative").glob("*.yaml"))
WANTED = """canon_550d canon_5d_mark_ii canon_5d_mark_iv canon_700d ideal imx385 imx686 nikon_d3 nikon_d850 raspberry_pi_hq
sony_a7_iii sony_a7s2""".split()
IDENTITY = {"make", "model", "source", "license", "file"}
KINDS = r"measured|derived|proxy|assumed|maker's specification|https?://|[\w-]+/[\w-]+@[0-9a-f]{7}|rawspeed|LibRaw|the same"
# Vandermode/ELD@53d5408, Profile-1: Kmin, slope and bias of ln sigma on ln K for the Gaussian and for the rows.
ELD = {
    "nikon_d850": (0.415039, 0.563461, 0.799410, 0.448292, -1.797710),
    "canon_5d_mark_iv": (0.218190, 0.677127, 1.512188, 0.471280, -0.807896),
    "canon_700d": (0.447629, 0.652459, 2.079863, 0.622058, -0.775648),
    "canon_550d": (0.447629, 0.652459, 2.079863, 0.622058, -0.775648),
}


def numbers(section: dict, path: str = "") -> list[str]:
    """Dotted keys of everything a section states, without the ISO of a line."""
    found = []
    for key, value in section.items():
        if key in IDENTITY:
            continue
        name = f"{path}.{key}".strip(".") if not isinstance(key, int) else path
        found += numbers(value, name) if isinstance(value, dict) else [name]
    return found


def sourced(section: dict, path: str = "") -> dict[str, str]:
    """Dotted key -> source, of a section and the sections in it; the key of a source that is text is the section's own."""
    given = section.get("source", {})
    texts = given if isinstance(given, dict) else {"": given}
    found = {f"{path}.{key}".strip("."): text for keys, text in texts.items() for key in keys.split(", ")}
    for key, value in section.items():
        if isinstance(value, dict) and key != "source":
            found |= sourced(value, f"{path}.{key}".strip("."))
    return found


def covers(key: str, number: str) -> bool:
    return key == "" or number == key or number.startswith(f"{key}.")


def test_the_library_holds_the_cameras_it_promises():
    assert set(WANTED) <= set(NAMES)


@pytest.mark.parametrize("name", [*NAMES, *ILLUSTRATIVE])
def test_every_number_has_a_source_and_every_source_its_number(name):
    section = read_camera_document(name).data["camera"]
    stated, sources = set(numbers(section)), sourced(section)
    for number in stated:
        assert any(covers(key, number) for key in sources), f"{name}: {number} has no source"
    for key, text in sources.items():
        assert any(covers(key, number) for number in stated), f"{name}: a source for {key}, which is not there"
        assert re.match(KINDS, text), f"{name}: {key}: {text}"
    if "file" in load_yaml(name).get("response", {}):
        assert section["response"]["license"] == "Apache-2.0"


def load_yaml(name: str) -> dict:
    import yaml

    return yaml.safe_load((CONFIGS / "cameras" / f"{name}.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_the_stages_of_every_iso_add_up_to_the_read_noise_of_the_table(name):
    camera = load_camera(name)
    for iso in camera.isos:
        setting, stages = camera.iso_setting(iso), camera.sensor_stages(iso, 0.01)
        signal = Moments(0.0, 0.0)
        for stem in ("conversion_gain", "read_noise_before_gain", "analog_gain", "read_noise_after_gain"):
            signal = stages[stem].moments(signal) if stem in stages else signal
        assert signal.variance == pytest.approx(setting.read_noise_dn**2, rel=1e-9, abs=1e-12), iso
        one = stages["analog_gain"].gain_dn_per_e * (stages["conversion_gain"].ratio if "conversion_gain" in stages else 1.0)
        assert one == pytest.approx(setting.gain_dn_per_e, rel=1e-12)
        assert (setting.row_noise_dn > 0) == ("row_noise" in stages)
        if setting.tukey_lambda is not None:
            assert "read_noise_before_gain" not in stages
            assert stages["read_noise_after_gain"].tukey_lambda == setting.tukey_lambda
        adc = stages["adc"]
        assert (adc.black_level_dn, adc.max_code) == (setting.black_level_dn, setting.white_level_dn)


DERIVED = [name for name in NAMES if "derived" in sourced(read_camera_document(name).data["camera"]).get(
    "response.peak_quantum_efficiency", "")[:7]]  # fmt: skip


def test_all_but_two_cameras_derive_their_quantum_efficiency():
    assert set(NAMES) - set(DERIVED) == {"ideal", "raspberry_pi_hq"}


@pytest.mark.parametrize("name", DERIVED)
def test_the_saturation_exposure_of_iso_12232_fills_the_range(name):
    camera, text = load_camera(name), sourced(read_camera_document(name).data["camera"])["response.peak_quantum_efficiency"]
    iso = int(re.search(r"at ISO (\d+)", text)[1])
    setting, response, light = camera.iso_setting(iso), camera.response, illuminant("D55")
    green = efficiency_on(WAVELENGTHS_NM, response.wavelengths_nm, response.quantum_efficiency)[:, 1]
    joule_per_m2_nm = light * (78 / iso) / luminance_cd_m2(light)
    step_nm = WAVELENGTHS_NM[1] - WAVELENGTHS_NM[0]
    area_m2 = (1e-6 * camera.pixel_pitch_um) ** 2
    electrons = (joule_per_m2_nm * photons_per_joule(WAVELENGTHS_NM) * green).sum() * step_nm * area_m2
    full_scale_e = (setting.white_level_dn - setting.black_level_dn) / setting.gain_dn_per_e
    assert electrons == pytest.approx(full_scale_e, rel=1e-3)
    assert f"{full_scale_e:.0f} e-" in text
    assert 0.3 < green.max() < 0.7 or green.max() < 0.9 and "lies above 0.7" in text


@pytest.mark.skipif(not CURVES.is_dir(), reason="no measured curves beside the checkout")
@pytest.mark.parametrize("path", sorted((CONFIGS / "responses").glob("*.yaml")), ids=lambda path: path.stem)
def test_a_response_is_the_measured_one(path):
    import yaml

    response = yaml.safe_load(path.read_text(encoding="utf-8"))
    file = re.search(r"\S+_380_780_5\.json", response["source"]["wavelengths, relative"])[0]
    measured = json.loads((CURVES / file).read_text())["spectral_data"]["data"]["main"]
    step = int(response["wavelengths"]["step"].split()[0])
    lines = np.array([measured[str(nm)] for nm in range(380, 781, step)])
    assert np.array(response["relative"]) == pytest.approx(np.maximum(lines / lines.max(), 0), abs=5.1e-5)


FACTS = {
    "canon_550d": "Canon EOS 550D (Rebel T2i / Kiss X4)",
    "canon_5d_mark_ii": "Canon EOS 5D Mark II",
    "canon_5d_mark_iv": "Canon EOS 5D Mark IV",
    "canon_700d": "Canon EOS 700D",
    "imx385": "IMX385 surveillance (CRVD/RViDeNet)",
    "imx686": "IMX686 phone (LRID/PMN)",
    "nikon_d3": "Nikon D3",
    "nikon_d850": "Nikon D850",
    "raspberry_pi_hq": "Raspberry Pi HQ (IMX477)",
    "sony_a7_iii": "Sony ILCE-7M3 (A7 III)",
    "sony_a7s2": "Sony ILCE-7SM2 (A7S2)",
}


@pytest.mark.skipif(not COLLECTED.is_file(), reason="no collected camera facts beside the checkout")
@pytest.mark.parametrize("name", FACTS)
def test_levels_bits_and_matrix_are_the_collected_ones(name):
    facts = json.loads(COLLECTED.read_text(encoding="utf-8"))["cameras"][FACTS[name]]
    camera = load_camera(name)

    def first(value):
        return value["default"] if isinstance(value, dict) else value

    if "black" in facts:
        assert camera.black_level_dn == first(facts["black"]["value"])
    if "white" in facts and name not in ("canon_700d", "sony_a7s2"):  # their files say why they differ
        assert camera.iso_setting(camera.isos[-1]).white_level_dn == first(facts["white"]["value"])
    if "xyz_to_cam_1e4" in facts:
        assert np.ravel(camera.color_matrix.xyz_to_camera) * 1e4 == pytest.approx(facts["xyz_to_cam_1e4"]["value"])
    if "bits" in facts:
        assert camera.bit_depth == facts["bits"]["value"]
    for iso, line in facts.get("per_iso", {}).get("value", {}).items():
        setting = camera.iso_table[int(iso)]
        published = [line[key] for key in ("K_DN_per_e", "gauss_sigma_DN", "tukey_lambda", "row_sigma_DN")]
        found = [setting.gain_dn_per_e, setting.read_noise_dn, setting.tukey_lambda, setting.row_noise_dn]
        assert found == pytest.approx(published, abs=6e-5)


@pytest.mark.parametrize("name", ELD)
def test_the_lines_of_a_published_regression_follow_it(name):
    smallest, slope, bias, row_slope, row_bias = ELD[name]
    for iso, setting in load_camera(name).iso_table.items():
        gain = smallest * iso / 100
        assert setting.gain_dn_per_e == pytest.approx(gain, rel=1e-5)
        assert setting.read_noise_dn == pytest.approx(gain**slope * math.exp(bias), rel=5e-4)
        assert setting.row_noise_dn == pytest.approx(gain**row_slope * math.exp(row_bias), rel=5e-3)


def test_the_two_sources_of_the_nikon_d3_meet_both_measured_points():
    camera = load_camera("nikon_d3")
    assert {iso: round(1 / line.gain_dn_per_e, 2) for iso, line in camera.iso_table.items()} == {
        200: 3.88, 400: 1.84, 800: 0.91, 1600: 0.46, 3200: 0.24, 6400: 0.12
    }  # fmt: skip
    before_e, after_dn = 4.10, camera.read_noise_after_gain_dn
    for line in camera.iso_table.values():
        assert line.read_noise_dn == pytest.approx(math.hypot(before_e * line.gain_dn_per_e, after_dn), rel=1e-3)
    assert (camera.iso_table[200].read_noise_dn, camera.iso_table[1600].read_noise_dn) == (4.3, 9.84)
    assert camera.black_level_dn == 0


def test_the_two_sources_of_the_raspberry_pi_camera_meet_both_measured_points():
    camera = load_camera("raspberry_pi_hq")
    assert camera.iso_setting(100).read_noise_dn == pytest.approx(1.53, abs=5e-3)
    assert camera.iso_setting(1600).read_noise_dn == pytest.approx(11.50, abs=5e-3)


def test_the_canon_5d_mark_ii_has_its_own_gains_and_the_noise_of_the_40d():
    table = load_camera("canon_5d_mark_ii").iso_table
    assert [round(1 / table[iso].gain_dn_per_e, 2) for iso in (200, 400, 800, 1600)] == [2.37, 1.17, 0.58, 0.30]
    for line in table.values():
        assert line.read_noise_dn == pytest.approx(math.hypot(4.8 * line.gain_dn_per_e, 16 / 2.96), rel=1e-3)


def test_imx385_has_the_published_variances():
    table = load_camera("imx385").iso_table
    variances = {1600: 11.917691, 3200: 38.117816, 6400: 130.818508, 12800: 484.53979, 25600: 1819.818657}
    assert {iso: line.read_noise_dn**2 for iso, line in table.items()} == pytest.approx(variances, rel=2e-4)
    electrons = [line.read_noise_dn / line.gain_dn_per_e for line in table.values()]
    assert electrons == pytest.approx([0.983, 0.888, 0.848, 0.828, 0.820], abs=6e-4)


def test_the_sony_a7s2_steps_down_at_its_conversion_gain_and_nothing_is_drawn_across():
    camera = load_camera("sony_a7s2")
    electrons = [camera.iso_setting(iso).read_noise_dn / camera.iso_setting(iso).gain_dn_per_e for iso in (1600, 2000)]
    assert electrons == pytest.approx([4.12, 1.39], abs=0.005)
    with pytest.raises(PhotositeError, match="exposure.iso = 1800: the Sony ILCE-7SM2 .* at 50 to 1600 and 2000 to 25600"):
        camera.iso_setting(1800)


def test_an_iso_outside_is_refused_with_file_and_line_and_how_to_ask():
    shot = CONFIGS / "shots" / "flat_field.yaml"
    with pytest.raises(
        PhotositeError, match="exposure.iso = 51200: .*; give an ISO within, or set camera.iso_range: extrapolate"
    ):
        load_shot(shot, ["camera=nikon_d850", "exposure.iso=51200"])
    asked = load_shot(shot, ["camera=nikon_d850", "exposure.iso=51200", "camera.iso_range=extrapolate"])
    assert asked.camera.iso_setting(51200).gain_dn_per_e == pytest.approx(0.415039 * 512, rel=1e-4)


@pytest.mark.parametrize(
    ("iso", "white_dn"), [(200, 15950), (250, 15950), (500, 15950), (1000, 15950), (640, 12995), (320, 12995)]
)
def test_a_third_stop_of_the_5d_mark_ii_has_the_white_level_published_for_it(iso, white_dn):
    assert load_camera("canon_5d_mark_ii").iso_setting(iso).white_level_dn == white_dn
