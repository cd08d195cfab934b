"""Shutters in a closed loop: simulated DNG files, measured alone, give back what the shots state."""

import dataclasses
import json

import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept
from scipy import stats

from simulator.command_line.main import main
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.exposure.shutter import (
    CurtainShutter,
    FirstCurtainShutter,
    GlobalShutter,
    LeafShutter,
    RollingShutter,
)
from simulator.measurement.shutter_check import frames as shutter_frames
from simulator.measurement.shutter_check.case import check_number
from simulator.measurement.shutter_check.curtain_slit import CurtainSlitCase
from simulator.measurement.shutter_check.frames import ShutterBench, take_shutter_frames
from simulator.measurement.shutter_check.html import shutter_html
from simulator.measurement.shutter_check.lamp import LampCase
from simulator.measurement.shutter_check.report import validate_shutter
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu

CAMERA = small_camera(
    96,
    160,
    "RGGB",
    bit_depth=14,
    black_level_dn=512.0,
    iso_table={100: IsoSetting(0.5, 2.0)},
    stages={"photon_shot_noise": PhotonShotNoise(), "prnu": Prnu(0.005)},
)
HEIGHT_MM = CAMERA.sensor_mm[1]


def accept_all(report):
    """Every number lies as its standard error says."""
    assert not [(check.quantity, check.where, check.measured, check.expected) for check in report.checks if not check.passed]
    asked = {f"{one.quantity}, {one.where}": one.deviation / one.error for one in report.checks if not one.reason_unchecked}
    accept({name: float(2.0 * stats.norm.sf(abs(z))) for name, z in asked.items()})


@pytest.fixture(scope="module")
def rolling(tmp_path_factory):
    return validate_shutter(CAMERA, tmp_path_factory.mktemp("frames"), shutter=RollingShutter(0.02))


def test_a_rolling_shutter_is_measured_back(rolling):
    accept_all(rolling)
    assert not [check.quantity for check in rolling.checks if check.reason_unchecked]
    expected = {check.quantity: check.expected for check in rolling.checks}
    assert expected["read-out time"] == 20.0 and expected["flash band"] == pytest.approx(160 * (0.2 + 0.1))
    assert expected["skew"] == pytest.approx(1920 * 0.02) and expected["blur"] == pytest.approx(1920 * 0.004)
    depths = [check.expected for check in rolling.of("flicker depth")]
    assert depths == pytest.approx([0.429197, 0.183942, 0.0, 0.108118], abs=1e-6)  # 0.5 |sin(pi x) / (pi x)|
    allowed = {check.quantity: check.tolerance for check in rolling.checks}
    assert allowed["read-out time"] < 2e-4 and allowed["skew"] < 0.004


@pytest.mark.slow
def test_columns_are_measured_as_rows_are(tmp_path):
    """Beside an optical black, of which no file tells."""
    camera = dataclasses.replace(CAMERA, width_px=160, height_px=96, optical_black=OpticalBlack(left_px=8, top_px=4))
    report = validate_shutter(camera, tmp_path, shutter=RollingShutter(0.02, "right_to_left"), seed=2)
    accept_all(report)
    assert report.window == (152, 92) and report.of("read-out time")[0].expected == 20.0


@pytest.mark.slow
def test_curtains_are_measured_back(tmp_path):
    """Accelerated ones, whose penumbra is 5 % of the way."""
    fastest = 2e-3 * HEIGHT_MM / 3e-3**2
    shutter = CurtainShutter(3e-3, 0.5 * fastest, 0.2 * HEIGHT_MM)
    report = validate_shutter(CAMERA, tmp_path, shutter=shutter)
    accept_all(report)
    expected = {check.quantity: check.expected for check in report.checks}
    assert expected["travel time"] == 3.0 and expected["acceleration"] == pytest.approx(0.5 * fastest)
    slit = (0.5**2 + 4 * 0.5 * 0.5) ** 0.5 / 12  # of the way, at the speed in its middle
    assert expected["slit efficiency"] == pytest.approx(slit / (slit + 0.05))


@pytest.mark.parametrize(
    ("shutter", "quantity", "expected"),
    [
        (LeafShutter(1e-3, 2e-3), "efficiency", [0.75]),
        (FirstCurtainShutter(3.5e-3, 3.5e-3, 0.0, 20.0 * HEIGHT_MM), "effective / nominal", [0.98681, 0.98639]),
        (GlobalShutter(0.001, 0.01), "parasitic light", [0.001]),
    ],
    ids=["leaf", "first curtain", "global"],
)
def test_other_shutters_are_measured_back(shutter, quantity, expected, tmp_path):
    report = validate_shutter(CAMERA, tmp_path, shutter=shutter, seed=3)
    accept_all(report)
    assert [check.expected for check in report.of(quantity)] == pytest.approx(expected, abs=1e-5)


def test_the_files_alone_are_measured(tmp_path):
    """A camera that is read 1 % slower than it says is seen as such."""
    stated, slower = (ShutterBench(CAMERA, RollingShutter(time_s), 100, tmp_path) for time_s in (0.02, 0.0202))
    case = LampCase(stated.scan)
    found = case.measure(stated, take_shutter_frames(slower, case.frames(slower), 1))
    assert [check.quantity for check in found.checks if not check.passed] == ["read-out time"]
    assert found.checks[0].deviation == pytest.approx(0.01, abs=2e-4)


def test_the_page_needs_nothing_else(rolling):
    page = shutter_html(rolling)
    assert page.count("<svg") == len(rolling.curves) == 6 and " src=" not in page and page == shutter_html(rolling)
    assert all(check.quantity in page for check in rolling.checks)


def test_a_penumbra_of_few_lines_is_not_gated(tmp_path):
    bench = ShutterBench(CAMERA, CurtainShutter(3e-3, 0.0, 0.04 * HEIGHT_MM), 100, tmp_path)
    lamp = LampCase(bench.scan)
    slit = CurtainSlitCase(lamp)
    found = slit.measure(bench, take_shutter_frames(bench, [*lamp.frames(bench)[:2], *slit.frames(bench)], 1))
    assert ["1.6 lines wide, too few" in check.reason_unchecked for check in found.checks] == [True, True]


def test_darkness_that_files_clip_and_soft_edges_are_reasons_not_to_gate(tmp_path):
    bench = ShutterBench(CAMERA, RollingShutter(0.02), 100, tmp_path)
    black, soft = (dataclasses.replace(CAMERA, **change) for change in ({"black_level_dn": 0.0}, {"low_pass_um": 4.0}))
    clipped, blurred = (dataclasses.replace(bench, camera=one) for one in (black, soft))
    assert bench.reason_dark_is_clipped == bench.reason_edge_is_soft == blurred.reason_dark_is_clipped == ""
    assert "clip the dark" in clipped.reason_dark_is_clipped and clipped.reason_edge_is_soft == clipped.reason_dark_is_clipped
    assert "neighbouring photosites" in blurred.reason_edge_is_soft
    check = check_number("skew", "1 px/s", 1.01, 1.0, 0.001, "px", "because")
    assert check.passed and not dataclasses.replace(check, reason_unchecked="").passed
    assert "4 standard errors are 40 %" in check_number("skew", "1 px/s", 1.0, 1.0, 0.1).reason_unchecked


def test_a_camera_that_states_no_time_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match=r"camera\.readout_time = none: Photosite test states none; give .*--readout-time"):
        validate_shutter(CAMERA, tmp_path)


SMALL = ("--set", "camera.width=64", "--set", "camera.height=128")


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main(["validate", "shutter", "ideal", *SMALL, *map(str, arguments)])
    return end.value.code


def test_the_command_writes_page_picture_and_json(tmp_path, capsys):
    assert run("--shutter", "{opening: 1 ms, closing: 2 ms}", "--out", tmp_path) == 0
    printed = capsys.readouterr()
    assert "efficiency" in printed.out and "all 2 gates passed" in printed.err
    assert max(map(len, printed.out.splitlines())) <= 100
    content = json.loads((tmp_path / "shutter.json").read_text())
    assert content["passed"] and [gate["quantity"] for gate in content["gates"]] == ["efficiency", "shake"]
    assert (tmp_path / "shutter.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "shutter.html").stat().st_size > 10_000
    assert len(list((tmp_path / "frames").glob("*.dng"))) == content["frames"]


def test_a_failed_check_is_an_exit_status(capsys, monkeypatch):
    """A simulator whose leaf shutter opens too slowly."""

    def wrong(shot, **settings):
        shutter = None if shot.exposure.shutter is None else LeafShutter(3e-3, 2e-3)
        return simulate(dataclasses.replace(shot, exposure=dataclasses.replace(shot.exposure, shutter=shutter)), **settings)

    monkeypatch.setattr(shutter_frames, "simulate", wrong)
    assert run("--shutter", "{opening: 1 ms, closing: 2 ms}") == 1
    printed = capsys.readouterr()
    assert "FAIL" in printed.out and "of 2 gates failed: efficiency at 6 ms" in printed.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "give one with --readout-time"),
        (("--readout-time", "20 mm"), "--readout-time"),
        (("--readout-time", "20 ms", "--shutter", "{opening: 1 ms, closing: 1 ms}"), "rolling shutter alone"),
        (("--shutter", "{opening: 1 ms, closing: -1 ms}"), "exposure.shutter.closing"),
        (("--shutter", ""), "--shutter"),
    ],
)
def test_what_cannot_be_measured_is_one_line(arguments, message, capsys):
    assert run(*arguments) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and message in error and "Traceback" not in error


@pytest.mark.slow
@pytest.mark.parametrize(
    "shutter",
    [RollingShutter(), CurtainShutter(3e-3, 900.0, 1.0), LeafShutter(1e-3, 1e-3), FirstCurtainShutter(3.5e-3, 3.5e-3)],
    ids=["rolling", "curtains", "leaf", "first curtain"],
)
def test_sony_a7_iii(shutter, tmp_path):
    accept_all(validate_shutter(load_camera("sony_a7_iii"), tmp_path, shutter=shutter, seed=10))
