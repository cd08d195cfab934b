"""`photosite mtf`: a table or JSON for each colour of a file's edges; one message where there is none."""

import dataclasses
import json
import math

import numpy as np
import pytest
from helpers.raw_frame import random_frame
from helpers.scene_builders import distances
from scipy.special import erf

from simulator.command_line.main import main
from simulator.measurement.quantities import MeasuredFrame
from simulator.raw.dng import writer

WIDTH, HEIGHT = 208, 200


@pytest.fixture
def edge_file(tmp_path):
    """An edge of 5.7 degrees, 1000 to 11000 DN above black in each place, behind RGGB, blurred by 1 photosite."""
    share = 0.5 * (1.0 + erf(distances(WIDTH, HEIGHT, 5.7) / math.sqrt(2.0)))
    raw = random_frame(HEIGHT, WIDTH, "RGGB", 14)
    dn = np.rint(raw.black_level_dn + 1000.0 + 10000.0 * share).astype(np.uint16)
    writer.write_dng(dataclasses.replace(raw, dn=dn), tmp_path / "edge.dng")
    return tmp_path / "edge.dng"


def run(capsys, *arguments) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["mtf", *map(str, arguments)])
    told = capsys.readouterr()
    return ended.value.code, told.out, told.err


def test_the_edge_is_found_and_measured_in_each_colour(edge_file, capsys):
    """exp(-2 (pi nu)^2) falls to a half at 0.1874 cycles/px."""
    code, out, _ = run(capsys, edge_file, "--json", "--pixel-pitch", "4 um", "--most", "1")
    assert code == 0
    (edge,) = json.loads(out)["edges"]
    assert set(edge["planes"]) == {"R", "Gr", "Gb", "B"} and edge["area"][2:] == [160, 160]
    for plane in edge["planes"].values():
        assert plane["mtf50"] == pytest.approx(0.1874, rel=0.015)
        assert plane["mtf50_cy_mm"] == pytest.approx(250.0 * plane["mtf50"])
        assert plane["mtf50_lw_ph"] == pytest.approx(2 * HEIGHT * plane["mtf50"])
        assert plane["step_dn"] == pytest.approx(10000.0, rel=0.01)
        assert plane["angle_deg"] == pytest.approx(5.7, abs=0.1)


def test_a_table_and_a_plot_are_made_of_the_area_that_is_given(edge_file, tmp_path, capsys):
    code, out, err = run(capsys, edge_file, "--area", "20,30,160,150", "--plot", tmp_path / "edge.svg")
    assert code == 0 and "20,30,160,150" in out and "MTF50" in out and out.splitlines()[-1].endswith("edge.svg")
    assert (tmp_path / "edge.svg").read_text().count("MTF50 = 0.1") in (0, 4)  # text, or outlines of letters


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--area", "1,2,3"), "--area 1,2,3: give TOP,LEFT,HEIGHT,WIDTH"),
        (("--area", "0,0,900,900"), r"area = [0, 0, 900, 900]: [top, left, height, width] must lie inside"),
        (("--area", "0,0,60,20"), "edge.dng: area 0,0,60,20, B: "),
        (("--pixel-pitch", "4"), "--pixel-pitch 4: "),
        (("--plot", "edge.gif"), "--plot edge.gif: end the name with .svg, .png, .pdf"),
    ],
)
def test_a_wrong_area_is_one_message(edge_file, capsys, arguments, message):
    code, _, err = run(capsys, edge_file, *arguments)
    assert code == 1 and err.count("error:") == 1 and message in err


def test_a_file_without_an_edge_says_what_to_give(tmp_path, capsys):
    writer.write_dng(random_frame(), tmp_path / "noise.dng")
    code, _, err = run(capsys, tmp_path / "noise.dng")
    assert code == 1 and "noise.dng: no square of 48 to 160 photosites holds one straight edge" in err and "--area" in err


def test_an_area_that_clips_is_told_with_the_count_and_what_helps(edge_file, tmp_path, capsys):
    """The same codes in a file whose white level is 8000 DN: no edge is found, and the one that is given is refused."""
    raw = random_frame(HEIGHT, WIDTH, "RGGB", 14, white_level_dn=8000)
    dn = np.minimum(MeasuredFrame.from_file(edge_file).dn, 8000)
    writer.write_dng(dataclasses.replace(raw, dn=dn), tmp_path / "bright.dng")
    code, _, err = run(capsys, tmp_path / "bright.dng", "--area", "20,30,160,150")
    count = int((dn[20:180, 30:180][0::2, 0::2] == 8000).sum())
    assert code == 1 and f"area 20,30,160,150, R: {count} at or above the white level of 8000 DN of 6000 photosites" in err
    assert err.count("note:") == 3 and err.count("error:") == 1 and "expose it less" in err
    code, _, err = run(capsys, tmp_path / "bright.dng")
    assert code == 1 and "holds one straight edge" in err
