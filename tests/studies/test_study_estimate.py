"""A dry run counts points, light, disk and time from the plans, without taking a point."""

import json

import pytest
from helpers.small_study import STUDY, small_study

from simulator.studies.study_estimate import estimate_study
from simulator.studies.study_result import load
from simulator.studies.study_run import run_study


@pytest.fixture(autouse=True)
def rates(tmp_path, monkeypatch, device):
    """Rates of the device, so that they are not measured."""
    from simulator.pipeline.device_rates import cache_path, rates_key

    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    cache_path().parent.mkdir(parents=True)
    cache_path().write_text(json.dumps({rates_key(device): {"sensor": 1.0}}))


def test_points_are_counted_by_state_and_light_once(tmp_path):
    study, out = small_study(tmp_path), tmp_path / "out"
    found = estimate_study(study, out)
    assert (found.states, found.to_take, found.lights, found.planned) == ({"missing": 6}, 6, 1, 6)  # a sharp scene
    assert not out.exists() and found.seconds > 0
    run_study(study, out)
    assert estimate_study(study, out).states == {"done": 6} and estimate_study(study, out).seconds == 0
    changed = small_study(tmp_path, STUDY.replace("1600]", "1600, 3200]").replace("[0, 0, 32, 64]", "[0, 0, 16, 64]"))
    assert estimate_study(changed, out).states == {"stale": 6, "missing": 2}
    assert estimate_study(study, out, redo=True).to_take == 6


def test_light_that_differs_counts_each_time(tmp_path):
    text = STUDY.replace("exposure.iso: [100, 400, 1600]", "scene.luminance: [1 cd/m^2, 2 cd/m^2, 5 cd/m^2]")
    assert estimate_study(small_study(tmp_path, text), tmp_path / "out").lights == 3


def test_the_disk_of_what_is_kept_is_that_of_the_files(tmp_path):
    text = (
        STUDY.replace("[100, 400, 1600]", "[100]")
        + "keep: [dng, truth]\nset: {camera.window.width: 640, camera.window.height: 480}\n"
    )
    study, out = small_study(tmp_path, text), tmp_path / "out"
    found = estimate_study(study, out)
    run_study(study, out)
    size = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
    assert found.bytes == pytest.approx(size, rel=0.1)


def test_points_that_cannot_be_taken_are_named(tmp_path):
    vary = "  - exposure.iso: [100, 25600]\n  - camera: [sony_a7s2, canon_550d]\n"
    text = "study: small\nshot: ./flat.yaml\nset: {camera.window: {x: 0, y: 0, width: 64, height: 48}}\nvary:\n" + vary
    found = estimate_study(small_study(tmp_path, text), tmp_path / "out")
    assert list(found.failures) == ["iso-25600_camera-canon_550d"] and found.states == {"missing": 3, "failed": 1}


def test_of_many_points_some_are_planned(tmp_path):
    text = STUDY.replace("exposure.iso: [100, 400, 1600]", "seeds.frame: {range: [0, 1000]}")
    found = estimate_study(small_study(tmp_path, text), tmp_path / "out", most_planned=20)
    assert found.planned <= 100 and found.states == {"missing": 2000} and found.lights < 100


def test_points_of_a_time_budget_are_planned_for_the_device(tmp_path):
    text = STUDY.replace("measure:", "set: {time_budget: 10 s}\nmeasure:").replace("[100, 400, 1600]", "[100]")
    study, out = small_study(tmp_path, text), tmp_path / "out"
    found = estimate_study(study, out)
    assert not found.failures and found.states == {"missing": 2}
    run_study(study, out)
    assert all(0 < row["predicted_seconds"] < 10 for row in load(out).rows)
