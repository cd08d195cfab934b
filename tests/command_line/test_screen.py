"""Paths of pictures stand alone on their lines, whole, in any terminal and none."""

import json
import os
import re
import subprocess
import sys

import pytest
from helpers.terminal import ROOT, run_in_terminal

from simulator.command_line.main import main

FOLDER = "a folder with a rather long name [bold] and/more of it"
COLOR = re.compile(r"\x1b\[[0-9;]*3[0-9]\b[0-9;]*m")
WINDOW = "camera.window={x: 1800, y: 1200, width: 96, height: 64}"


@pytest.fixture(scope="module")
def frame(tmp_path_factory):
    folder = tmp_path_factory.mktemp("frames") / FOLDER
    main_of("simulate", "slanted_edge", "--out", str(folder))
    return folder / "slanted_edge.dng"


def main_of(*words: str) -> None:
    try:
        main(list(words))
    except SystemExit as end:
        assert not end.code


LENS = ("lens", "--focal-length", "50mm", "--f-number", "f/2", "--focus-distance", "2m")


@pytest.mark.parametrize(
    "words",
    [
        (*LENS, "--plot"),
        ("plot", "sony_a7s2", "--only", "noise", "--out"),
        ("compare", "sony_a7s2", "nikon_d850", "--only", "noise", "--out"),
        ("develop", "FRAME", "--out"),
        ("develop", "FRAME", "--sheet", "--out"),
        ("mtf", "FRAME", "--area", "100,200,160,200", "--plot"),
    ],
    ids=lambda words: words[0],
)
def test_the_last_line_is_the_path_of_the_picture(words, frame, tmp_path, capsys):
    picture = tmp_path / FOLDER / "picture.png"
    picture.parent.mkdir(parents=True)
    main_of(*(str(frame) if word == "FRAME" else word for word in words), str(picture))
    assert picture.is_file()
    assert capsys.readouterr().out.splitlines()[-1] == str(picture)


@pytest.mark.parametrize(
    "words", [(*LENS, "--format", "json", "--plot"), ("mtf", "FRAME", "--area", "100,200,160,200", "--json", "--plot")]
)
def test_json_on_stdout_stays_json(words, frame, tmp_path, capsys):
    main_of(*(str(frame) if word == "FRAME" else word for word in words), str(tmp_path / "picture.png"))
    told = capsys.readouterr()
    assert json.loads(told.out) and told.err.splitlines()[-1] == str(tmp_path / "picture.png")


@pytest.mark.parametrize(
    ("environment", "has_bars", "has_colors"),
    [
        ({"TERM": "dumb"}, False, False),
        ({"TERM": "xterm-256color", "NO_COLOR": "1"}, True, False),
        ({"TERM": "xterm-256color"}, True, True),
    ],
    ids=["dumb", "no color", "xterm"],
)
def test_a_narrow_terminal_shows_whole_paths_and_nothing_strange(environment, has_bars, has_colors, tmp_path):
    told = run_in_terminal("simulate", "color_checker", "--set", WINDOW, "--out", str(tmp_path / FOLDER), **environment)
    paths = "".join(f"{tmp_path / FOLDER / 'color_checker'}{suffix}\r\n" for suffix in (".dng", ".truth.exr", ".json"))
    assert told.endswith(paths)
    before = told.removesuffix(paths)
    assert ("\x1b" in before) == has_bars and bool(COLOR.search(before)) == has_colors
    if has_bars:  # what is left of them is erased, and the cursor is shown again
        assert before.endswith("\x1b[2K") and before.count("\x1b[?25l") == before.count("\x1b[?25h")
    else:
        assert re.fullmatch(r"device: [^\r\n]+\r\n", before)


def test_a_pipe_gets_the_paths_alone(tmp_path):
    command = [sys.executable, "-m", "simulator", "simulate", "color_checker", "--set", WINDOW, "--no-truth"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TERM": "xterm"}
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, check=True)
    assert done.stdout == b"color_checker.dng\ncolor_checker.json\n" and b"\x1b" not in done.stderr
