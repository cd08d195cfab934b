"""`photosite explain` in its formats: tables of 100 columns, and the same numbers as JSON, CSV and HTML."""

import csv
import io
import json
import re
from html.parser import HTMLParser

import pytest
from rich.console import Console

import simulator
from simulator.color.color_tables import CONFIGS
from simulator.command_line.explain_formats import split_value
from simulator.command_line.main import main
from simulator.command_line.patch_numbers import budget_tables
from simulator.device import open_device
from simulator.pipeline.explain.noise_budget import iso_budgets
from simulator.pipeline.planner import measure, plan

SMALL = ["--set", "camera.window={x: 0, y: 0, width: 64, height: 48}"]
STAGES = ("prnu={sigma: 0.01}", "dsnu={sigma: 2 e-}", "dark_current={rate: 5 e-/s}", "banding={amplitude: 2 DN, period: 30}")
STAGES += ("random_telegraph_noise={share: 0.05, amplitude: 30 e-}", "hot_pixels={share: 0.02, rate: 300 e-/s}")
NOISY = [part for one in STAGES for part in ("--set", f"camera.stages.{one}")]
BLURRED = ["--set", "lens.focus_distance=1 m", *SMALL]


def run(capsys, *arguments: str) -> str:
    with pytest.raises(SystemExit) as ended:
        main(["explain", *arguments])
    assert not ended.value.code
    return capsys.readouterr().out


def told_as_json(capsys, *arguments: str) -> dict:
    return json.loads(run(capsys, *arguments, "--format", "json"))


@pytest.mark.parametrize("focus", ["2 m", "1 m"])  # sharp, and out of focus, where the blur has a method and an error
def test_each_pass_has_method_size_memory_error_and_time(capsys, focus):
    settings = [f"lens.focus_distance={focus}", SMALL[1]]
    rows = told_as_json(capsys, "color_checker", "--set", settings[0], *SMALL)["passes"]
    planned = measure(plan(simulator.load_shot("color_checker", settings)), open_device(None))
    assert [(row["pass"], row["method"], row["kept"]) for row in rows] == [(p.name, p.method, p.kept) for p in planned.passes]
    for one, row in zip(planned.passes, rows, strict=True):
        numbers = [row[name] for name in ("size", "memory [byte]", "scratch memory [byte]", "predicted error [sigma]")]
        wanted = [one.size, one.memory_bytes, one.scratch_bytes, one.error_sigma]
        assert numbers == (wanted if one.kept else [None] * 4)
        assert row["predicted time [ms]"] == (one.cost_ms if one.kept else None)
    assert any(row["predicted error [sigma]"] for row in rows) == (focus == "1 m")


def test_every_pass_that_runs_can_be_measured(capsys):
    rows = told_as_json(capsys, "color_checker", "--measure", *BLURRED)["passes"]
    kept = [row for row in rows if row["kept"]]
    assert {"scene planes", "radius statistics", "defocus", "sensor", "truth"} <= {row["pass"] for row in kept}
    assert all(row["measured time [ms]"] > 0 for row in kept)
    assert all(row["measured time [ms]"] is None for row in rows if not row["kept"])


SHOTS = {
    "a chart": ("color_checker",),
    "a scene in depth": ("color_checker", *BLURRED, "--set", "lens.f_number=f/1.4", "--set", "lens.diffraction=true"),
    "all noises": ("color_checker", *SMALL, *NOISY, "--set", "camera.low_pass=5 um"),
    "a rolling shutter": ("flat_field", *SMALL, "--set", "exposure.shutter={readout_time: 20 ms}"),
}


@pytest.mark.parametrize("name", SHOTS)
def test_tables_fit_100_columns_and_no_number_is_cut(capsys, name):
    out = run(capsys, *SHOTS[name])
    assert "…" not in out and max(map(len, out.splitlines())) <= 100
    told = told_as_json(capsys, *SHOTS[name])
    words = set(re.findall(r"[^\s│]+", out))
    for row in told["noise"]:
        assert f"{row['time [s]']:.4g}" in words and f"{row['signal [e-]']:.1f}" in words
        if not row["clipped"]:
            assert {f"{row['sigma [DN]']:.4g}", f"{row['SNR']:.2f}"} <= words
            shares = [value for key, value in row.items() if key.startswith("share of ")]
            assert {f"{100 * value:.2f}" for value in shares} <= words
            assert sum(shares) == pytest.approx(1.0, rel=1e-9)


def test_a_table_too_wide_is_divided_with_the_iso_in_each_part():
    shot = simulator.load_shot("color_checker", [*NOISY[1::2], SMALL[1]])
    budgets = iso_budgets(plan(shot).sensor, shot.exposure, 1000.0, [100, 1600], "exposure")
    (whole,) = budget_tables("noise", budgets, Console(width=300))
    parts = budget_tables("noise", budgets, Console(width=60))
    heads = [[str(column.header) for column in part.columns] for part in parts]
    assert len(parts) > 2 and all(head[0] == "ISO" for head in heads)
    assert {name for head in heads for name in head} == {str(column.header) for column in whole.columns}


def csv_text(value: object) -> str:
    """A value of the JSON as the CSV has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else repr(value) if isinstance(value, float) else str(value)


def test_csv_has_each_value_of_the_json_with_every_digit(capsys):
    told = told_as_json(capsys, "color_checker", *BLURRED)
    rows = list(csv.DictReader(io.StringIO(run(capsys, "color_checker", *BLURRED, "--format", "csv"))))
    found = {(row["section"], int(row["row"]), row["column"], row["unit"]): row["value"] for row in rows}
    checked = 0
    for section, lines in told.items():
        if not (isinstance(lines, list) and lines and isinstance(lines[0], dict)):
            continue
        for place, line in enumerate(lines):
            for key, value in line.items():
                name, _, unit = key.rstrip("]").partition(" [") if key.endswith("]") else (key, "", "")
                text = found[section, place, name, unit]
                assert text == csv_text(value)
                checked += 1
    assert checked > 300 and float(found["totals", 0, "predicted time [ms]", ""]) == told["totals"]["predicted time [ms]"]


class Cells(HTMLParser):
    """Texts of the cells of a page's tables, and the attributes that lead somewhere."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.cells: list[str] = []
        self.links: list[str] = []
        self.is_inside = False
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.links += [value or "" for name, value in attrs if name in ("src", "href")]
        self.is_inside = tag == "td"
        self.cells += [""] * self.is_inside

    def handle_data(self, data: str) -> None:
        if self.is_inside:
            self.cells[-1] += data

    def handle_endtag(self, tag: str) -> None:
        self.is_inside = self.is_inside and tag != "td"


def test_html_has_the_values_for_people_and_nothing_from_elsewhere(capsys):
    told = told_as_json(capsys, "color_checker", *BLURRED)
    text = run(capsys, "color_checker", *BLURRED, "--format", "html")
    page = Cells(text)
    assert not page.links and "://" not in text and "<script" not in text
    for section in ("lens", "exposure", "white", "patch"):
        assert {row["value"] for row in told[section]} <= set(page.cells)
    assert {f"{row['sigma [e-]']:.5g}" for row in told["noise"]} <= set(page.cells)


def test_values_of_one_number_have_it_as_a_number_with_its_unit(capsys):
    lens = {row["quantity"]: (row["number"], row["unit"]) for row in told_as_json(capsys, "color_checker", *SMALL)["lens"]}
    assert lens["image distance"] == (51.282, "mm") and lens["magnification"] == (0.02564, "")
    assert lens["circle of confusion"] == (None, None)  # in two units
    assert split_value("-0.46 stops") == (-0.46, "stops") and split_value("infinity") == (None, None)
    assert split_value("1/15 s") == (None, None) and split_value("4e-05 lx s") == (4e-05, "lx s")


def test_another_format_is_refused(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["explain", str(CONFIGS / "shots" / "flat_field.yaml"), "--format", "xml"])
    assert ended.value.code == 1 and "--format xml: give one of table, json, csv, html" in capsys.readouterr().err
