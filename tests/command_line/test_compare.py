"""`photosite compare`: cameras, shots and raw files in the same plots; one line for an error."""

import csv

import pytest
from helpers.raw_frame import random_frame
from helpers.study_folder import ISOS, STOPS, figures_at, write_study_folder

from simulator.command_line.main import main
from simulator.raw.dng.writer import write_dng


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["compare", *arguments])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def rows_of(path) -> list[dict[str, str]]:
    with path.open() as file:
        return list(csv.DictReader(file))


def test_two_cameras_share_each_plot(capsys, tmp_path):
    table, figure = tmp_path / "c.csv", tmp_path / "c.svg"
    names = ("--only", "snr", "--only", "mtf")
    code, _, _ = run(capsys, "sony_a7s2", "nikon_d850", *names, "--out", str(figure), "--csv", str(table))
    rows = rows_of(table)
    assert code == 0 and {row["subject"] for row in rows} == {"Sony ILCE-7SM2", "Nikon D850"}
    assert {row["line"] for row in rows if row["plot"] == "snr"} == {"ISO 100", "ISO 1600"}
    last = {row["subject"]: float(row["x"]) for row in rows if row["plot"] == "mtf"}  # one cycle per photosite [cycles/mm]
    assert last == pytest.approx({"Sony ILCE-7SM2": 1e3 / 8.4, "Nikon D850": 1e3 / 4.35}, rel=0.01)
    assert "Nikon D850, ISO 1600" in figure.read_text()


def test_two_shots_share_a_plot(capsys, tmp_path):
    code, _, _ = run(capsys, "color_checker", "flat_field", "--only", "depth_of_field", "--out", str(tmp_path / "c.png"))
    assert code == 0 and (tmp_path / "c.png").stat().st_size > 10_000


def test_raw_files_and_the_model_of_their_camera_share_each_plot(capsys, tmp_path):
    for name, seed in (("a.dng", 1), ("b.dng", 2)):
        write_dng(random_frame(seed=seed), tmp_path / name)
    files, table = [str(tmp_path / name) for name in ("a.dng", "b.dng")], tmp_path / "c.csv"
    code, _, _ = run(capsys, *files, "sony_a7s2", "--out", str(tmp_path / "c.svg"), "--csv", str(table))
    rows = rows_of(table)
    assert code == 0 and {row["plot"] for row in rows} >= {"noise_of_signal", "snr_of_signal", "codes"}
    assert {row["subject"] for row in rows} == {"a.dng", "b.dng", "Sony ILCE-7SM2"}
    assert {row["line"] for row in rows if row["subject"] == "Sony ILCE-7SM2"} == {"model, ISO 400"}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (("a/x.dng", "b/x.dng", "y.dng"), {"a/x.dng", "b/x.dng", "y.dng"}),
        (("a/x.dng", "./a/x.dng"), {"a/x.dng", "a/x.dng (2)"}),
        (("a/x.dng", "y.dng"), {"x.dng", "y.dng"}),
    ],
)
def test_raw_files_of_one_name_are_subjects_of_their_own(capsys, tmp_path, monkeypatch, given, told):
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate(("a/x.dng", "b/x.dng", "y.dng"), 1):
        write_dng(random_frame(seed=seed), tmp_path / name)
    code, _, _ = run(capsys, *given, "--csv", "c.csv")
    assert code == 0 and {row["subject"] for row in rows_of(tmp_path / "c.csv")} == told


def test_cameras_of_one_model_are_told_apart_by_their_files(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_dng(random_frame(seed=1), tmp_path / "x.dng")
    for name, bits in (("a", 14), ("b", 12)):
        (tmp_path / f"{name}.yaml").write_text(f"base: sony_a7s2\nbit_depth: {bits}\n")
    for subjects in (("a.yaml", "b.yaml"), ("x.dng", "a.yaml", "b.yaml")):
        code, _, err = run(capsys, *subjects, "--csv", "c.csv")
        assert (code, {row["subject"] for row in rows_of(tmp_path / "c.csv")}) == (0, set(subjects)), err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("sony_a7s2",), "give two or more to compare"),
        (("sony_a7s2", "nothing"), "no such file in configs/shots"),
        (("a.nef", "sony_a7s2"), "a.nef: no such file"),
        (("sony_a7s2", "nikon_d850", "--only", "codes"), "--only codes: give one of snr"),
        (("sony_a7s2", "nikon_d850", "--iso", "25600"), "exposure.iso = 25600"),
    ],
)
def test_what_cannot_be_compared_is_said_in_one_line(capsys, tmp_path, monkeypatch, arguments, told):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *arguments)
    assert code == 1 and told in err and err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_two_studies_share_the_plots_of_their_reports(capsys, tmp_path):
    folders = [str(write_study_folder(tmp_path / name)) for name in ("one", "two")]
    table = tmp_path / "c.csv"
    options = ("--only", "grey.snr_exposure.iso", "--out", str(tmp_path / "c.svg"), "--csv", str(table))
    code, _, _ = run(capsys, *folders, *options)
    rows = rows_of(table)
    assert code == 0 and {row["subject"] for row in rows} == set(folders)  # of one name, told apart by their folders
    assert {(int(float(row["x"])), float(row["y"])) for row in rows} == {
        (iso, figures_at(iso, stop)["grey.snr"]) for iso in ISOS for stop in STOPS
    }
    code, _, err = run(capsys, *folders, "--only", "bokeh", "--out", str(tmp_path / "d.svg"))
    assert code == 1 and "--only bokeh: give one of grey.mean_dn_exposure.iso" in err
    code, _, err = run(capsys, folders[0], "sony_a7s2", "--out", str(tmp_path / "d.svg"))
    assert code == 1 and "sony_a7s2: is no folder of a study" in err and not (tmp_path / "d.svg").exists()
