"""No command writes over a file that it reads, or gives a file a name of another kind; one line for an error."""

import shutil

import numpy as np
import pytest
from helpers.raw_frame import random_frame
from helpers.study_folder import write_study_folder

from simulator.command_line.main import main
from simulator.raw.dng.writer import write_dng
from simulator.raw.image_files import write_picture

CURVES = "wavelength_nm,red,green,blue\n400,0,0.1,0.4\n500,0.1,0.5,0.2\n600,0.5,0.2,0\n700,0.2,0,0\n"
SHOT = """scene: {image: wall.png, luminance: 100 cd/m^2, depth: 2 m}
lens: {focal_length: 50 mm, f_number: 4, focus_distance: 2 m}
exposure: {time: 1/100 s, iso: 100}
camera: mine.yaml
"""
LENS = ("lens", "--focal-length", "50mm", "--f-number", "f/2")


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with a shot, its picture, its camera and the camera's curves, a raw file of two names, and a study."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "curves.csv").write_text(CURVES)
    (tmp_path / "mine.yaml").write_text("base: sony_a7s2\nresponse: {file: curves.csv}\n")
    (tmp_path / "shot.yaml").write_text(SHOT)
    write_picture(tmp_path / "wall.png", np.full((8, 12, 3), 90, np.uint8))
    (tmp_path / "link.png").symlink_to("wall.png")
    write_dng(random_frame(seed=1), tmp_path / "raw.dng")
    shutil.copy(tmp_path / "raw.dng", tmp_path / "raw.tif")
    write_study_folder(tmp_path / "study")
    return tmp_path


def run(capsys, *arguments: str) -> tuple[int, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return ended.value.code or 0, capsys.readouterr().err


def contents(folder) -> dict[str, bytes]:
    return {str(path): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("report", "study", "--out", "mine.yaml"), "--out mine.yaml: end the name with .html, .htm"),
        (("report", "study", "--pdf", "mine.yaml"), "--pdf mine.yaml: end the name with .pdf"),
        (("plot", "mine.yaml", "--csv", "mine.yaml"), "--csv mine.yaml: end the name with .csv"),
        (("plot", "mine.yaml", "--out", "mine.yaml"), "--out mine.yaml: end the name with .svg, .png, .pdf"),
        (("compare", "mine.yaml", "sony_a7s2", "--csv", "raw.dng"), "--csv raw.dng: end the name with .csv"),
        ((*LENS, "--plot", "mine.yaml"), "--plot mine.yaml: end the name with .svg, .png, .pdf"),
        (("schema", "--out", "shot.yaml"), "--out shot.yaml: end the name with .json"),
        (("sheet", "mine.yaml", "--out", "mine.yaml"), "--out mine.yaml: end the name with .xml"),
        (("calibrate", "raw.dng", "--out", "raw.dng"), "--out raw.dng: end the name with .yaml, .yml"),
        (("develop", "raw.dng", "--out", "raw.dng"), "--out raw.dng: end the name with .png"),
    ],
)
def test_a_name_of_another_kind_is_refused(capsys, desk, arguments, told):
    before = contents(desk)
    code, err = run(capsys, *arguments)
    assert code == 1 and told in err and err.count("\n") == 1
    assert contents(desk) == before


@pytest.mark.parametrize(
    "arguments",
    [
        ("plot", "mine.yaml", "--csv", "curves.csv"),
        ("plot", "shot.yaml", "--csv", "curves.csv"),
        ("plot", "shot.yaml", "--out", "wall.png"),
        ("plot", "shot.yaml", "--out", "link.png"),
        ("compare", "shot.yaml", "sony_a7s2", "--csv", "curves.csv"),
        ("compare", "study", "study", "--csv", "study/points.csv"),
        ("lens", "shot.yaml", "--plot", "wall.png"),
        ("develop", "raw.tif", "--out", "raw.tif"),
        ("calibrate", "raw.dng", "--base", "mine.yaml", "--out", "mine.yaml"),
    ],
)
def test_what_a_command_reads_is_not_written_over(capsys, desk, arguments):
    before = contents(desk)
    code, err = run(capsys, *arguments)
    told = f"{arguments[-2]} {arguments[-1]}: the command reads this file and would write over it; give another name\n"
    assert (code, err) == (1, f"error: {told}")
    assert contents(desk) == before


def test_a_sheet_that_is_the_camera_is_not_written_over(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run(capsys, "sheet", "sony_a7s2", "--out", "s.xml")[0] == 0
    code, err = run(capsys, "sheet", "s.xml", "--out", "./s.xml")
    assert code == 1 and "--out s.xml: the command reads this file" in err


def test_a_file_that_a_command_does_not_read_is_written_again(capsys, desk):
    for name in ("P.SVG", "p.csv", "page.htm"):
        (desk / name).write_text("old")
    assert run(capsys, "plot", "mine.yaml", "--only", "noise", "--out", "P.SVG", "--csv", "p.csv")[0] == 0
    assert run(capsys, "report", "study", "--out", "page.htm")[0] == 0
    assert all((desk / name).read_text() != "old" for name in ("P.SVG", "p.csv", "page.htm"))
