"""`photosite plot`: figure and numbers of a camera or a shot; one line for an error."""

import csv

import pytest

from simulator.command_line.main import main


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["plot", *arguments])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def test_a_camera_is_drawn_with_its_numbers(capsys, tmp_path):
    figure, table = tmp_path / "p.svg", tmp_path / "p.csv"
    options = ("--only", "snr", "--only", "noise", "--iso", "100", "--out", str(figure), "--csv", str(table))
    code, out, _ = run(capsys, "sony_a7s2", *options)
    assert code == 0 and out.split() == [str(figure), str(table)]
    rows = list(csv.DictReader(table.open()))
    assert {row["plot"] for row in rows} == {"snr", "noise"}
    assert {row["line"] for row in rows if row["plot"] == "snr"} == {"ISO 100"}
    (noise,) = (float(row["y"]) for row in rows if row["plot"] == "noise" and float(row["x"]) == 100)
    assert noise == pytest.approx(11.0, rel=0.01)  # the camera file's 1.06 DN with rounding, over its K
    assert "ISO 100" in figure.read_text()


def test_a_camera_in_a_folder_of_the_library_is_named_as_in_a_shot(capsys, tmp_path):
    figure = tmp_path / "p.svg"
    code, out, _ = run(capsys, "illustrative/x_trans", "--only", "noise", "--out", str(figure))
    assert code == 0 and out.strip() == str(figure) and "X-Trans" in figure.read_text()


def test_a_shot_has_its_own_iso_and_its_lens(capsys, tmp_path):
    table = tmp_path / "p.csv"
    options = ("--set", "exposure.iso=800", "--out", str(tmp_path / "p.png"), "--csv", str(table))
    code, _, err = run(capsys, "color_checker", *options)
    rows = list(csv.DictReader(table.open()))
    assert code == 0 and "lens.diffraction is off" in err
    assert {row["plot"] for row in rows} >= {"snr", "noise", "mtf", "blur", "depth_of_field", "dynamic_range"}
    assert {row["line"] for row in rows if row["plot"] == "snr"} == {"ISO 800"}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("no_such",), "no such file in configs/shots"),
        (("no_such.yaml",), "no_such.yaml"),
        (("sony_a7s2", "--only", "blur"), "--only blur: needs the lens of a shot"),
        (("sony_a7s2", "--only", "bokeh"), "--only bokeh: give one of snr, noise"),
        (("sony_a7s2", "--iso", "3"), "exposure.iso = 3: "),
        (("sony_a7s2", "--out", "p.jpg"), "--out p.jpg: end the name with"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(capsys, tmp_path, monkeypatch, arguments, told):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *arguments)
    assert code == 1 and told in err and err.count("\n") == 1
    assert not list(tmp_path.iterdir())
