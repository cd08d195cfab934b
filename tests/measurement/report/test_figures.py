"""Figures: colours that can be told from white and from each other, formats, the same bytes each time, no address outside."""

import re
from itertools import combinations

import numpy as np
import pytest

from simulator.measurement.quantities import Curve
from simulator.measurement.report.figures import COLORS, plot_svg, plots_figure, write_figure
from simulator.measurement.report.plot import Line, Mark, Plot, overlay, write_plots_csv

# Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
VISION = {
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "all colours": np.eye(3),
}


def linear(color: str) -> np.ndarray:
    code = np.array([int(color[place : place + 2], 16) for place in (1, 3, 5)]) / 255.0
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)


def lightness(color: str) -> float:
    return float(linear(color) @ [0.2126, 0.7152, 0.0722])


def curve(scale: float) -> Curve:
    x = np.array([1.0, 2.0, 4.0])
    return Curve(x, scale * x, "ISO", "", "noise", "e-")


PLOT = Plot(
    "noise",
    "Noise",
    (Line(curve(1.0), "a", "one"), Line(curve(2.0), "b", "two")),
    "note",
    "log",
    "log",
    marks=(Mark("x", 2.0, "here"),),
)


@pytest.mark.parametrize("color", COLORS)
def test_a_line_has_three_times_the_contrast_of_white(color):
    assert 1.05 / (lightness(color) + 0.05) >= 3.0


@pytest.mark.parametrize("kind", VISION)
def test_the_first_five_colours_differ_in_all_kinds_of_vision(kind):
    """By a colour difference (CIE 1976) of 15 or more, six times what is just seen."""
    import colour

    seen = [np.clip(np.array(VISION[kind]) @ linear(one), 0.0, 1.0) for one in COLORS[:5]]
    labs = [colour.XYZ_to_Lab(colour.sRGB_to_XYZ(colour.cctf_encoding(one))) for one in seen]
    assert min(float(np.linalg.norm(a - b)) for a, b in combinations(labs, 2)) > 15.0


def test_an_svg_has_no_address_but_those_of_its_own_language():
    svg = plot_svg(PLOT)
    assert set(re.findall(r"https?://[^\"'<> ]+", svg)) <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert all(found.startswith("#") for found in re.findall(r'(?:href|src)="([^"]*)"', svg))
    assert svg == plot_svg(PLOT)


def test_a_line_of_many_points_is_held_as_pixels_inside_the_figure():
    x = np.linspace(0.0, 1.0, 40_000)
    many = Plot("p", "P", (Line(Curve(x, np.sin(400 * x), "x", "", "y", ""), "", has_points=True, has_line=False),))
    svg = plot_svg(many)
    addresses = re.findall(r'(?:href|src)="([^"]*)"', svg)
    assert any(one.startswith("data:image/png;base64,") for one in addresses) and len(svg) < 1_000_000
    assert all(one.startswith(("#", "data:image/png;base64,")) for one in addresses)


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_a_file_has_the_format_of_its_name_and_the_same_bytes_each_time(tmp_path, suffix):
    for name in ("first", "second"):
        write_figure(plots_figure([PLOT], "title"), tmp_path / f"{name}.{suffix}")
    first, second = ((tmp_path / f"{name}.{suffix}").read_bytes() for name in ("first", "second"))
    assert first == second
    assert {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix] == first[: 5 if suffix == "svg" else 4]


def test_plots_of_one_name_are_laid_over_each_other():
    other = Plot("noise", "Other", (Line(curve(3.0), "c", "three"),), marks=(Mark("x", 2.0, "here"), Mark("x", 3.0, "there")))
    both, alone = overlay([PLOT, Plot("mtf", "MTF", ()), other])
    assert [line.subject for line in both.lines] == ["one", "two", "three"] and both.title == "Noise"
    assert [mark.label for mark in both.marks] == ["here", "there"] and alone.name == "mtf"


def test_numbers_are_written_with_every_digit(tmp_path):
    import csv

    thirds = Plot("p", "P", (Line(Curve(np.array([1 / 3]), np.array([np.inf]), "x", "m", "y", ""), "l", "s"),))
    write_plots_csv([thirds], tmp_path / "p.csv")
    (row,) = csv.DictReader((tmp_path / "p.csv").open())
    assert float(row["x"]) == 1 / 3 and float(row["y"]) == np.inf and row["x_unit"] == "m"
