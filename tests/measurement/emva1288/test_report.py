"""EMVA 1288 in a closed loop: simulated DNG files, measured alone, give quantum efficiency, K, noise and speed back."""

import dataclasses
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.color.spectra import LIGHT_SPEED_M_S, PLANCK_J_S
from simulator.command_line.main import main
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.measurement.emva1288 import checks as check_emva
from simulator.measurement.emva1288.files_to_planes import measure_emva
from simulator.measurement.emva1288.frames import EmvaBench, take_emva_frames
from simulator.measurement.emva1288.html import emva_html
from simulator.measurement.emva1288.measured_sheet import write_measured_sheets
from simulator.measurement.emva1288.report import validate_emva
from simulator.measurement.noise_check.expected import reason_read_noise_is_unmeasurable
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.row_noise import RowNoise


def mono(**settings):
    """12 bit, K = 0.5, read noise 4 e-, fill factor 0.8."""
    fields = {
        "bit_depth": 12,
        "black_level_dn": 100.0,
        "fill_factor": 0.8,
        "iso_table": {100: IsoSetting(0.5, 2.0)},
        "stages": {"photon_shot_noise": PhotonShotNoise()},
    }
    return small_camera(400, 300, "MONO", **{**fields, **settings})


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    stages = {"photon_shot_noise": PhotonShotNoise(), "dark_current": DarkCurrent(20.0), "full_well": FullWell(7000.0)}
    return validate_emva(mono(stages=stages), 100, tmp_path_factory.mktemp("frames"))


def failed(checks):
    return [(check.quantity, check.where, check.measured, check.expected) for check in checks if not check.passed]


def test_a_mono_camera_is_measured_back(report):
    assert not failed(report.checks)
    asked = {check.quantity for check in report.checks if not check.reason_unchecked}
    assert {"K", "quantum efficiency", "sigma_d", "saturation", "SNR_max", "dynamic range", "LE_min", "LE_max"} <= asked
    assert {"dark current by mean", "dark current by variance"} <= asked
    plane = report.found.planes["MONO"]
    assert plane.quantum_efficiency.value == pytest.approx(0.8, rel=0.005)  # unit efficiency on 80 % of the area
    assert 0.95 * 7000 < plane.saturation_e < 7000
    assert report.found.dark_current_e_per_s["MONO"][0].value == pytest.approx(20.0, rel=0.02)


@pytest.mark.parametrize("seed", [1, 1000])
def test_small_frames_widen_every_gate_to_four_standard_errors(tmp_path, seed):
    """The step of the largest variance among those 1 % apart is found by chance where few photosites tell it."""
    body = dataclasses.replace(mono(), width_px=64, height_px=48)
    report = validate_emva(body, 100, tmp_path, seed=seed)
    assert not failed(report.checks)
    for check in report.checks:
        assert bool(check.reason_unchecked) or check.tolerance >= (4.0 - 1e-9) * check.error, check
    found = {check.quantity: check for check in report.checks}
    assert found["saturation"].tolerance > 0.02 and found["SNR_max"].tolerance > 0.01
    assert found["saturation"].error > found["K"].error and found["SNR_max"].error == found["saturation"].error / 2


def test_the_patterns_of_a_body_are_measured_back(tmp_path):
    stages = {
        "photon_shot_noise": PhotonShotNoise(),
        "prnu": Prnu(0.01),
        "dsnu": Dsnu(3.0),
        "column_offset": ColumnOffset(1.0),
        "row_noise": RowNoise(0.8),
    }
    report = validate_emva(mono(bit_depth=14, black_level_dn=500.0, stages=stages), 100, tmp_path)
    assert not failed(report.checks)
    asked = {check.quantity: check for check in report.checks if not check.reason_unchecked}
    assert asked["DSNU"].expected == pytest.approx(np.hypot(3.0, 1.0 / 0.5)) and asked["PRNU"].expected == pytest.approx(0.01)
    assert asked["sigma_d"].expected == pytest.approx(np.hypot(2.0, 0.8) / 0.5)
    dsnu, prnu = (getattr(report.found.planes["MONO"], name) for name in ("dsnu", "prnu"))
    assert dsnu.pixel == pytest.approx(3.0, rel=0.01) and prnu.pixel == pytest.approx(0.01, rel=0.01)
    assert dsnu.column == pytest.approx(2.0, rel=4 / np.sqrt(2 * 400))
    assert dsnu.row == pytest.approx(1.6 / 4, rel=4 / np.sqrt(2 * 300))  # row noise over sqrt(16 frames), no pattern
    assert prnu.row < 0.001 and prnu.column < 0.001


def test_defects_are_named_as_the_reason_not_to_ask(tmp_path):
    stages = {"photon_shot_noise": PhotonShotNoise(), "prnu": Prnu(0.01), "hot_pixels": HotPixels(1e-3, 1e4)}
    sensor = EmvaBench(mono(stages=stages), 100, tmp_path).white.sensor
    assert "hot pixels" in reason_read_noise_is_unmeasurable(sensor)
    with pytest.raises(PhotositeError, match=r"camera\.binning = .*single photosites"):
        _ = EmvaBench(mono(binning=Binning(2)), 100, tmp_path).white
    with pytest.raises(PhotositeError, match=r"camera\.hdr_readout = .*single readings"):
        _ = EmvaBench(mono(hdr_readout=HdrReadout(exposures=(1.0, 0.25))), 100, tmp_path).white


def test_photons_are_counted_as_the_definition_says():
    """mu_p = E A t lambda / (h c), E = pi L / (1 + 4 N^2) at infinity, L of 5 mW m^-2 sr^-1."""
    bench = EmvaBench(mono(), 100, None).colors["MONO"]
    (wavelength_nm,) = bench.light.wavelengths_nm[bench.light.spectrum_w_m2_sr_nm > 0]
    irradiance = np.pi * 1e-3 * 5.0 / (1.0 + 4.0 * 4.0**2)
    expected = irradiance * (5e-6) ** 2 * 0.01 * wavelength_nm * 1e-9 / (PLANCK_J_S * LIGHT_SPEED_M_S)
    assert bench.photons == pytest.approx(expected, rel=1e-9)
    assert bench.electrons[0] == pytest.approx(0.8 * expected, rel=1e-5)


def test_the_files_alone_are_measured(tmp_path, monkeypatch):
    """A camera with 3 % more gain and 2 % less efficiency than its file is seen as such."""
    camera = mono()
    response = dataclasses.replace(camera.response, quantum_efficiency=0.98 * camera.response.quantum_efficiency)
    other = mono(iso_table={100: IsoSetting(0.515, 2.0)}, response=response)
    files = take_emva_frames(EmvaBench(other, 100, tmp_path), 1)
    checks = check_emva.check_emva(measure_emva(files), EmvaBench(camera, 100, tmp_path))
    assert {"K", "quantum efficiency", "sigma_d"} <= {name for name, *_ in failed(checks)}


def test_the_report_states_the_band_of_the_light(report):
    """Full width at half of the peak, by the light that the bench has."""
    light = EmvaBench(mono(), 100, Path()).colors["MONO"].light
    half = np.interp(
        np.linspace(light.wavelengths_nm[0], light.wavelengths_nm[-1], 2001), light.wavelengths_nm, light.spectrum_w_m2_sr_nm
    )
    share = float(np.mean(half >= 0.5 * half.max()))
    width_nm = share * float(np.ptp(light.wavelengths_nm))
    assert f"a band of {width_nm:.1g} nm" in emva_html(report)


def test_the_report_is_one_page_that_needs_nothing_else(report):
    page = emva_html(report)
    open_tags = []

    class Checker(HTMLParser):
        def handle_starttag(self, tag, attributes):
            assert not [value for name, value in attributes if name in ("src", "srcset") or tag == "link"]
            if tag not in ("meta",):
                open_tags.append(tag)

        def handle_endtag(self, tag):
            assert open_tags.pop() == tag

    Checker(convert_charrefs=True).feed(page)
    assert not open_tags and page.count("<svg") == 7
    assert "quantum efficiency" in page and "S_sat" in page and page == emva_html(report)


def test_a_measured_sheet_is_a_camera_of_these_numbers(report, tmp_path):
    about = {"width": 400.0, "height": 300.0, "pixel_size": 5.0, "bit_depth": 12.0}
    (path,) = write_measured_sheets(report.found, tmp_path, {"iso": "100"}, about)
    camera, plane = load_camera(str(path)), report.found.planes["MONO"]
    assert camera.iso_table[100].gain_dn_per_e == plane.gain.value
    assert camera.iso_table[100].read_noise_dn == pytest.approx(plane.gain.value * plane.read_noise.value, rel=1e-12)
    assert camera.response.quantum_efficiency[0, 0] == pytest.approx(plane.quantum_efficiency.value, rel=1e-12)
    assert camera.stages["full_well"].capacity_e == plane.saturation_e
    assert camera.stages["dark_current"].rate_e_per_s == report.found.dark_current_e_per_s["MONO"][0].value


def test_the_command_writes_page_picture_and_json(tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        main(["validate", "emva", "ideal", "--iso", "100", "--out", str(tmp_path)])
    printed = capsys.readouterr()
    assert end.value.code == 0, printed.err
    assert "ISO 12232" in printed.out and "gates passed" in printed.err
    content = json.loads((tmp_path / "emva.json").read_text())
    assert content["passed"] and content["planes"]["MONO"]["gain"]["value"] == pytest.approx(1.0, rel=0.006)
    assert str(tmp_path / "emva_MONO.xml") in printed.out.splitlines() and (tmp_path / "emva_MONO.xml").is_file()
    assert (tmp_path / "emva.html").stat().st_size > 10_000 and (tmp_path / "emva.png").stat().st_size > 10_000


@pytest.mark.slow
@pytest.mark.parametrize("iso", [100, 1600, 25600])
def test_sony_a7s2_per_colour_plane(tmp_path, iso):
    camera = load_camera("sony_a7s2")
    report = validate_emva(camera, iso, tmp_path)
    assert not failed(report.checks)
    assert list(report.found.planes) == ["R", "Gr", "Gb", "B"]
    if iso == 100:  # its efficiency was derived from H_sat = 78 / 100 lx s; the step of largest variance lies a little lower
        assert report.found.saturation_speed == pytest.approx(100.0, rel=0.03)
