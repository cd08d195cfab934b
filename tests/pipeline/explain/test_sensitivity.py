"""ISO 12232 from the frames: where grey and white land at the exposure that an ISO asks for."""

import dataclasses
import shutil
import subprocess

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene

import simulator
from simulator.color.color_tables import CONFIGS
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.explain.grey_patch import grey_patch
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.raw.dng.writer import write_dng
from simulator.sensor.camera.camera import SpectralResponse
from simulator.sensor.iso_speed import baseline_exposure_ev, saturation_exposure_lx_s

FLAT = CONFIGS / "shots" / "flat_field.yaml"  # D55, no fall-off
CAMERAS = (("sony_a7s2", 50), ("sony_a7s2", 2000), ("raspberry_pi_hq", 100), ("ideal", 400), ("canon_5d_mark_iv", 160))


def flat(name: str, iso: int, exposure_lx_s: float) -> simulator.Raw:
    """A white surface in D55 at this luminous exposure."""
    overrides = {"camera": name, "camera.window": {"x": 0, "y": 0, "width": 32, "height": 24}, "exposure.iso": iso}
    shot = simulator.load_shot(FLAT, overrides)
    time_s = exposure_lx_s / grey_patch(shot, plan(shot).optics.scene, 1.0).illuminance_lx
    return simulator.simulate(simulator.load_shot(FLAT, overrides | {"exposure.time": f"{time_s!r} s"}))


def signal(raw) -> float:
    """Of the brightest colour, 0 at black and 1 at white."""
    return float((raw.noise_free_dn.max() - raw.black_level_dn) / (raw.white_level_dn - raw.black_level_dn))


@pytest.mark.parametrize(("name", "iso"), CAMERAS)
def test_grey_exposed_as_the_iso_says_comes_out_as_18_percent(name, iso):
    # Recommended exposure index, ISO 12232: H = 10 lx s / ISO.
    raw = flat(name, iso, 10 / iso)
    assert signal(raw) * 2**raw.baseline_exposure_ev == pytest.approx(0.18, rel=1e-3)


@pytest.mark.parametrize(("name", "iso"), CAMERAS)
def test_the_saturation_exposure_is_where_the_first_colour_reaches_white(name, iso):
    shot = simulator.load_shot(FLAT, {"camera": name, "exposure.iso": iso})
    saturation_lx_s = saturation_exposure_lx_s(plan(shot).sensor)
    assert signal(flat(name, iso, 0.98 * saturation_lx_s)) == pytest.approx(0.98, rel=1e-3)
    assert signal(flat(name, iso, 1.02 * saturation_lx_s)) == pytest.approx(1.0, rel=1e-3)


def test_a_camera_whose_iso_is_the_saturation_based_speed_has_half_a_stop_above_white():
    # 18 % of 78 lx s over 10 lx s, 1.404: log2 of it is 0.49.
    shot = simulator.load_shot(FLAT)
    planned = plan(shot)
    speed = 78 / saturation_exposure_lx_s(planned.sensor)
    assert baseline_exposure_ev(planned.sensor, speed) == pytest.approx(np.log2(1.404), abs=1e-9)
    assert baseline_exposure_ev(planned.sensor, 2 * speed) == pytest.approx(np.log2(2.808), abs=1e-9)


def test_a_camera_that_sees_no_daylight_has_no_baseline():
    infrared = SpectralResponse(np.arange(850.0, 951.0, 10.0), np.ones((11, 1)))
    scene = band_scene(np.ones((4, 4)))
    wavelengths = np.arange(850.0, 951.0, 10.0)
    light = dataclasses.replace(
        scene.scene, wavelengths_nm=wavelengths, spectra_w_m2_sr_nm=np.ones((1, 11)), illuminant=np.ones(11)
    )
    shot = Shot(type(scene)(light), ThinLens(50.0, 8.0, 2.0), Exposure(0.01), small_camera(response=infrared))
    assert baseline_exposure_ev(plan(shot).sensor, 100) is None
    assert simulator.simulate(shot).baseline_exposure_ev is None


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
@pytest.mark.parametrize("value_ev", [-0.51, 0.0, 1.25])
def test_exiftool_finds_the_baseline_and_no_fault(tmp_path, value_ev):
    write_dng(random_frame(baseline_exposure_ev=value_ev), tmp_path / "a.dng")
    command = ["exiftool", "-s3", "-BaselineExposure", "-validate", "-warning", tmp_path / "a.dng"]
    assert subprocess.run(command, capture_output=True, text=True).stdout.split() == [f"{value_ev:g}", "OK"]


@pytest.mark.parametrize("value_ev", [-0.51, 1.25])
def test_adobes_reader_finds_the_baseline(tmp_path, value_ev):
    dngpy = pytest.importorskip("dngpy", reason="dngpy, Adobe's DNG SDK for Python, is not installed")
    write_dng(random_frame(baseline_exposure_ev=value_ev), tmp_path / "a.dng")
    assert dngpy.Dng(str(tmp_path / "a.dng")).get_baseline_exposure() == pytest.approx(value_ev, abs=1e-6)
