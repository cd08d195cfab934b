"""`photosite study` from the command line."""

import sys

import pytest
from helpers.small_study import STUDY, write_study

from simulator.command_line.main import main
from simulator.studies.study_result import load


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["study", *arguments])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def test_a_study_writes_its_table_and_says_what_was_there(tmp_path, capsys):
    path, out = str(write_study(tmp_path)), tmp_path / "out"
    code, told, _ = run(capsys, path, "--out", str(out), "--set", "exposure.iso=200")
    assert (code, told.strip()) == (0, str(out / "points.csv")) and len(load(out).rows) == 6
    code, _, notes = run(capsys, path, "--out", str(out), "--set", "exposure.iso=200")
    assert code == 0 and "6 of 6 points were done already; --redo takes them again" in notes


def test_a_failed_point_is_told_with_the_line_that_repeats_it(tmp_path, capsys, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    path, out = str(write_study(tmp_path, STUDY + "  mine: {python: own.fails_at_400}\n")), tmp_path / "out"
    code, _, notes = run(capsys, path, "--out", str(out))
    assert code == 1 and "error: 2 of 6 points failed; the column error of" in notes
    assert "failed: iso-400_f_number-f-4_time-1-60-s: " in notes
    assert f"repeat it with: photosite simulate {tmp_path / 'flat.yaml'} --set exposure.iso=400" in notes
    sys.modules.pop("own")


def test_mistakes_are_one_line(tmp_path, capsys):
    code, _, told = run(
        capsys, str(write_study(tmp_path, STUDY.replace("iso: [100", "isoo: [100"))), "--out", str(tmp_path / "out")
    )
    assert code == 1 and "study.yaml:4" in told and len(told.strip().splitlines()) == 1 and not (tmp_path / "out").exists()


def test_parquet_without_pyarrow_is_refused_before_the_work(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("simulator.command_line.study.has_parquet", lambda: False)
    code, _, told = run(capsys, str(write_study(tmp_path)), "--out", str(tmp_path / "out"), "--parquet")
    assert code == 1 and "pip install 'photosite[study]'" in told and not (tmp_path / "out").exists()


def test_the_shipped_study_can_be_planned(capsys, tmp_path):
    code, told, _ = run(capsys, "iso_and_aperture", "--out", str(tmp_path / "out"), "--help")
    assert code == 0 and "--dry-run" in told


def test_a_plan_names_a_library_shot_as_the_study_does_and_counts_in_plain_words(capsys, tmp_path):
    path = tmp_path / "one.yaml"
    window = "set: {camera.window: {x: 0, y: 0, width: 32, height: 32}}"
    path.write_text(
        f"study: one\nshot: flat_field\n{window}\nvary:\n  - exposure.iso: [100]\nmeasure: {{grey: {{patch: {{}}}}}}\n"
    )
    code, told, _ = run(capsys, str(path), "--out", str(tmp_path / "out"), "--dry-run")
    lines = [" ".join(line.split()) for line in told.splitlines()]
    assert code == 0 and "study one, of flat_field" in lines and "to take 1 point, 1 image of the light" in lines
    assert any(" on 1 worker, kernels built" in line for line in lines)
