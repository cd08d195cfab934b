"""Noise against ISO in a closed loop: simulated DNG files, measured alone, give the camera file's numbers back."""

import dataclasses
import json

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.randomness import accept
from scipy import stats

from simulator.command_line.main import main
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.measurement.noise_check import checks as noise_checks
from simulator.measurement.noise_check import flat_bench
from simulator.measurement.noise_check.frames import make_noise_bench, plan_frames, take_frames
from simulator.measurement.noise_check.measure import log_slope, measure_iso_noise, noise_steps
from simulator.measurement.noise_check.report import validate_noise
from simulator.measurement.report.tolerance_check import ToleranceCheck
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.dsnu import Dsnu
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.prnu import Prnu
from simulator.sensor.stages.random_telegraph_noise import RandomTelegraphNoise
from simulator.sensor.stages.row_noise import RowNoise

# IMX385, 12 bit, black 240: K and read noise in DN as CRVD (RViDeNet) publishes them.
IMX385 = {1600: (3.513, 11.92), 3200: (6.956, 38.12), 6400: (13.486, 130.8), 12800: (26.586, 484.5), 25600: (52.033, 1819.8)}


@pytest.fixture(scope="module")
def sony():
    return load_camera("sony_a7s2")


def camera(table, black, bits, cfa="RGGB", **settings):
    lines = {iso: IsoSetting(*line) for iso, line in table.items()}
    stages = {"photon_shot_noise": PhotonShotNoise()}
    fields = dict(cfa=cfa, iso_table=lines, black_level_dn=black, bit_depth=bits, stages=stages)
    return small_camera(640, 560, **{**fields, **settings})


def z_values(report, quantity):
    return np.array([check.deviation / check.error for check in report.of(quantity) if not check.reason_unchecked])


def failed(checks):
    return [(check.quantity, check.where, check.measured, check.expected) for check in checks if not check.passed]


def test_sony_a7s2_over_its_iso_range_with_the_step_of_its_dual_gain(sony, tmp_path):
    report = validate_noise(sony, [100, 400, 1600, 2000, 6400, 25600], tmp_path)
    assert not failed(report.checks)
    (slope,), (step,) = report.of("slope of ln K"), report.of("step of read noise")
    assert slope.expected == 1.0 and abs(slope.measured - 1.0) < 0.005
    assert step.where == "ISO 1600 to 2000" and step.measured == pytest.approx(4.1169 / 1.3876, rel=0.03)
    assert not any(check.reason_unchecked for check in report.checks if check.quantity in ("K", "read noise", "full scale"))
    chi2 = {name: float(np.sum(z_values(report, name) ** 2)) for name in ("K", "read noise")}
    accept({name: float(stats.chi2.sf(value, 6)) for name, value in chi2.items()})
    assert max(check.error for check in report.of("K")) < 0.0016  # the tolerance is four of these


def test_the_files_alone_are_measured(sony, tmp_path):
    """Nothing but the DNG reaches the measurement: a camera of another gain is seen as such, whatever the file says."""
    setting = sony.iso_table[1600]
    other = dataclasses.replace(setting, gain_dn_per_e=1.01 * setting.gain_dn_per_e, read_noise_dn=1.02 * setting.read_noise_dn)
    bench, wrong = (
        make_noise_bench(one, 1600, tmp_path)
        for one in (sony, dataclasses.replace(sony, iso_table=sony.iso_table | {1600: other}))
    )
    found = measure_iso_noise(take_frames(wrong, plan_frames(wrong), 5))
    assert not failed(noise_checks.check_iso(found, wrong, plan_frames(wrong)))
    names = [name for name, *_ in failed(noise_checks.check_iso(found, bench, plan_frames(bench)))]
    assert names == ["K", "read noise", "full scale"]


def test_a_table_of_another_slope_is_held_against_its_own(tmp_path):
    table = {iso: (gain, variance**0.5) for iso, (gain, variance) in IMX385.items()}
    report = validate_noise(camera(table, 240.0, 12), [1600, 25600], tmp_path, seed=7)
    assert not failed(report.checks)
    (slope,) = report.of("slope of ln K")
    assert slope.expected == pytest.approx(np.log(52.033 / 3.513) / np.log(16)) and "own table" in slope.where


def test_a_camera_without_pedestal_is_asked_for_its_gain_only(tmp_path):
    """Nikon D3: black is code 0, and half of the dark is lost in the file."""
    report = validate_noise(camera({1600: (2.17, 14.3), 6400: (8.33, 46.0)}, 0.0, 14), [1600, 6400], tmp_path)
    assert not failed(report.checks)
    assert all(point.dark_is_clipped for point in report.points)
    assert all("pedestal" in check.reason_unchecked for check in report.of("read noise"))
    assert not any(check.reason_unchecked for check in report.of("K"))


@pytest.mark.slow
def test_a_body_with_patterns_row_noise_and_long_tails(tmp_path):
    """Fixed patterns leave no trace in pairs; row noise is told apart from the photosites' own."""
    body = {
        "photon_shot_noise": PhotonShotNoise(),
        "prnu": Prnu(0.01),
        "dsnu": Dsnu(5.0),
        "column_offset": ColumnOffset(3.0),
        "row_noise": RowNoise(1.5),
        "random_telegraph_noise": RandomTelegraphNoise(0.001, 20.0),
    }
    report = validate_noise(camera({400: (0.5, 4.0)}, 512.0, 14, stages=body), [400], tmp_path)
    assert not failed(report.checks)
    assert not any(check.reason_unchecked for check in report.checks)
    assert report.of("row noise")[0].expected == pytest.approx(1.5)
    assert report.of("read noise")[0].expected == pytest.approx(np.sqrt(16.0 + 0.25 * 0.001 * 400.0))


def test_small_frames_widen_every_gate_to_four_standard_errors(sony, tmp_path):
    small = dataclasses.replace(sony, width_px=64, height_px=48)
    report = validate_noise(small, [800], tmp_path, keep=False)
    gated = [check for check in report.checks if not check.reason_unchecked]
    assert not failed(report.checks) and "read noise" in {check.quantity for check in gated}
    for check in gated:
        assert check.tolerance >= (4.0 - 1e-9) * check.error, check
    assert report.of("read noise")[0].tolerance > 0.015


def test_what_is_divided_by_k_is_gated_where_k_is(sony, tmp_path):
    small = dataclasses.replace(sony, width_px=64, height_px=48)
    report = validate_noise(small, [100], tmp_path, keep=False)
    assert all("standard errors" in report.of(name)[0].reason_unchecked for name in ("K", "full scale", "dynamic range"))


def test_read_noise_below_half_a_code_is_not_asked_for(tmp_path):
    report = validate_noise(camera({100: (0.1, 0.3)}, 512.0, 14, "MONO"), [100], tmp_path)
    assert not failed(report.checks) and "rounding" in report.of("read noise")[0].reason_unchecked
    assert not report.of("slope of ln K")


def test_steps_are_drops_no_single_gain_can_make():
    assert noise_steps({100: 8.0, 200: 4.2, 400: 2.4}) == []
    assert noise_steps({100: 8.0, 125: 3.0, 160: 2.9}) == [(100, 125)]
    assert noise_steps({100: 8.0, 200: 0.0}) == []
    assert log_slope([100, 400], [1.0, 4.0**0.9]) == pytest.approx(0.9)


def test_a_check_passes_within_its_tolerance_and_never_by_nan():
    check = ToleranceCheck("K", "ISO 100", 1.006, 1.0, 0.0061, 0.001)
    assert check.passed and check.deviation == pytest.approx(0.006)
    assert not dataclasses.replace(check, measured=0.993).passed
    assert not dataclasses.replace(check, measured=float("nan")).passed
    assert dataclasses.replace(check, measured=7.0, reason_unchecked="because").as_dict()["verdict"] == "not gated"
    assert not dataclasses.replace(check, expected=-1.0, relative=False).passed
    with pytest.raises(PhotositeError, match="relative deviation"):
        ToleranceCheck("K", "ISO 100", 1.0, 0.0, 0.01, 0.0)


def test_a_camera_is_loaded_with_single_values_set():
    camera = load_camera("ideal", ["camera.stages.prnu.sigma=0.01", "camera.bit_depth=12"])
    assert camera.stages["prnu"] == Prnu(0.01) and camera.bit_depth == 12


def run(*arguments):
    with pytest.raises(SystemExit) as end:
        main([str(one) for one in arguments])
    return end.value.code


def test_the_command_writes_table_picture_and_json(tmp_path, capsys):
    assert run("validate", "noise", "sony_a7s2", "--iso", 1600, "--iso", 2000, "--out", tmp_path) == 0
    printed = capsys.readouterr()
    assert "step of read noise, ISO 1600 to 2000" in printed.out and "gates passed" in printed.err
    content = json.loads((tmp_path / "noise.json").read_text())
    assert content["passed"] and [point["iso"] for point in content["points"]] == [1600, 2000]
    assert (tmp_path / "noise.png").read_bytes().startswith(b"\x89PNG")
    assert len(list((tmp_path / "frames").glob("*.dng"))) == 34


def test_a_failed_check_is_an_exit_status(tmp_path, capsys, monkeypatch):
    """A simulator whose gain is 2 % too high."""

    def wrong(shot, **settings):
        raw = simulate(shot, **settings)
        codes = raw.black_level_dn + 1.02 * (raw.dn - raw.black_level_dn)
        return dataclasses.replace(raw, dn=np.minimum(np.rint(codes), raw.white_level_dn).astype(np.uint16))

    monkeypatch.setattr(flat_bench, "simulate", wrong)
    assert run("validate", "noise", "ideal", "--iso", 100) == 1
    printed = capsys.readouterr()
    assert "FAIL" in printed.out and "2 of 2 gates failed: K at ISO 100" in printed.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("no_such_camera",), "no_such_camera"), (("sony_a7s2", "--iso", "20"), "ISO|iso"), (("ideal", "--set", "x=1"), "x")],
)
def test_what_cannot_be_measured_is_one_line(arguments, message, capsys):
    assert run("validate", "noise", *arguments) == 1
    error = capsys.readouterr().err
    assert error.startswith("error: ") and message.split("|")[-1] in error and "Traceback" not in error


@pytest.mark.slow
def test_sony_a7s2_at_every_iso(sony, tmp_path):
    report = validate_noise(sony, sorted(sony.iso_table), tmp_path, keep=False, seed=100)
    assert not failed(report.checks)
    assert not list(tmp_path.iterdir())
    tests = {
        (name, iso.where): 2 * stats.norm.sf(abs(z))
        for name in ("K", "read noise")
        for iso, z in zip(report.of(name), z_values(report, name), strict=True)
    }
    accept(tests)


@pytest.mark.slow
def test_an_imx385_at_every_iso(tmp_path):
    table = {iso: (gain, variance**0.5) for iso, (gain, variance) in IMX385.items()}
    report = validate_noise(camera(table, 240.0, 12), sorted(table), tmp_path, seed=300)
    assert not failed(report.checks)
