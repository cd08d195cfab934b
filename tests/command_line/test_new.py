"""`photosite new`: files that are valid as they are, and with each of their examples taken out of its comment."""

import re
from pathlib import Path

import pytest

from data_gen.command_line import main
from data_gen.recipe.dataset_config import load_data_set
from simulator.command_line.new import NEXT, TEMPLATES
from simulator.config import load_camera, load_shot, load_sweep
from simulator.studies import load, load_study

SMALL = ["--set", "camera.window={x: 0, y: 0, width: 64, height: 48}"]
EXAMPLE = re.compile(r"^( *)# (\S+:(?: .*)?)$")  # a line of YAML in a comment


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def text_of(kind: str) -> str:
    return (TEMPLATES / f"{kind}.yaml").read_text(encoding="utf-8")


def with_examples(kind: str, *keys: str, without: tuple[str, ...] = ()) -> str:
    """A start file with the examples of these keys as YAML; lines that hold a text of `without` left out."""
    lines, found = [], set()
    for line in text_of(kind).splitlines():
        example = EXAMPLE.match(line)
        if example and (key := example[2].partition(":")[0]) in keys:
            found.add(key)
            line = example[1] + example[2]
        if not any(text in line for text in without):
            lines.append(line)
    assert found == set(keys)
    return "\n".join(lines)


def test_every_kind_has_a_file_and_a_command():
    assert {path.stem for path in TEMPLATES.iterdir()} == set(NEXT)


@pytest.mark.parametrize("kind", NEXT)
def test_the_file_is_written_under_its_name_and_the_command_told(kind, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(capsys, "new", kind) == (0, f"{kind}.yaml\n", f"use it: {NEXT[kind].format(path=f'{kind}.yaml')}\n")
    assert run(capsys, "new", kind, "sub/mine")[:2] == (0, "sub/mine.yaml\n")
    assert run(capsys, "new", kind, "a.b")[:2] == (0, "a.b.yaml\n")
    named = text_of(kind).replace("study: my_study", 'study: "mine"') if kind == "study" else text_of(kind)
    assert Path("sub/mine.yaml").read_text(encoding="utf-8") == named


def test_a_file_that_is_there_is_left_as_it_is(tmp_path, capsys):
    path = tmp_path / "shot.yaml"
    path.write_text("mine", encoding="utf-8")
    code, out, err = run(capsys, "new", "shot", str(path))
    assert (code, out) == (1, "") and err == f"error: {path}: is there already and is left as it is; give another NAME\n"
    assert path.read_text(encoding="utf-8") == "mine"


def test_an_unknown_kind_is_told(capsys):
    code, _, err = run(capsys, "new", "picture")
    assert code == 1 and "KIND = picture: give one of camera, dataset, shot, study" in err


def test_the_shot_is_taken_as_it_is_by_the_camera_as_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for kind in ("shot", "camera"):
        run(capsys, "new", kind)
    assert run(capsys, "simulate", "shot.yaml", *SMALL, "--out", "frames")[0] == 0
    assert run(capsys, "simulate", "shot.yaml", *SMALL, "--set", "camera=camera.yaml", "--out", "mine")[0] == 0
    assert sorted(path.name for path in tmp_path.glob("*/*.dng")) == ["shot.dng", "shot.dng"]


def test_the_data_set_is_made_as_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run(capsys, "new", "dataset")
    smaller = ("--set", "count=2", "--set", "writer.samples_per_shard=2", "--set", "crop=[32, 32]")
    code, out, err = run(capsys, "dataset", "dataset.yaml", "--out", "pairs", *smaller)
    assert (code, out) == (0, "pairs/manifest.json\n"), err


@pytest.mark.parametrize(("keys", "without"), [(("diffraction", "aperture"), ()), (("mode",), ("time: 1/15 s",))], ids=str)
def test_the_shot_s_examples_are_valid(keys, without, tmp_path):
    path = tmp_path / "shot.yaml"
    path.write_text(with_examples("shot", *keys, without=without), encoding="utf-8")
    assert load_shot(path) != load_shot(TEMPLATES / "shot.yaml")


def test_the_shot_s_example_of_a_series_is_valid(tmp_path):
    path = tmp_path / "shot.yaml"
    path.write_text(with_examples("shot", "sweep"), encoding="utf-8")
    sweep = load_sweep(path)
    assert sweep is not None and len(sweep) == 9


def test_the_shot_s_example_of_a_picture_is_valid(tmp_path):
    path = tmp_path / "shot.yaml"
    path.write_text(with_examples("shot", "image", "field_of_view", without=("chart: color_checker",)), encoding="utf-8")
    assert load_shot(path).scene.image == tmp_path / "my_picture.exr"


def test_the_camera_s_examples_are_valid(tmp_path):
    path = tmp_path / "camera.yaml"
    path.write_text(with_examples("camera", "dark_current", "prnu", "hot_pixels"), encoding="utf-8")
    assert set(load_camera(str(path)).stages) == {"photon_shot_noise", "full_well", "dark_current", "prnu", "hot_pixels"}
    text = re.sub(r"^read_noise_model:\n(  .*\n)+", "", with_examples("camera", "iso_table"), flags=re.MULTILINE)
    path.write_text(text, encoding="utf-8")
    assert load_camera(str(path)).isos == (100, 200)
    assert "#   base: sony_a7s2\n#   bit_depth: 12\n" in text
    path.write_text("base: sony_a7s2\nbit_depth: 12\n", encoding="utf-8")
    assert load_camera(str(path)).bit_depth == 12


def test_the_study_is_taken_as_it_is(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run(capsys, "new", "study")
    code, out, err = run(capsys, "study", "study.yaml", "--out", "results")
    assert (code, out) == (0, "results/points.csv\n"), err
    rows = load("results").rows
    assert len(rows) == 6 and {row["state"] for row in rows} == {"done"}
    assert all(row["clipped.white"] == 0 and 10 < row["grey.snr"] < 60 for row in rows)  # shot noise of 500 and 2000 electrons


@pytest.mark.parametrize(("name", "known_as"), [("iso_study", "iso_study"), ("of lenses.yaml", "of_lenses"), ("2026", "2026")])
def test_a_study_has_the_name_of_its_file(name, known_as, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    _, out, _ = run(capsys, "new", "study", name)
    assert load_study(out.strip()).name == known_as


def test_the_study_s_examples_are_valid(tmp_path):
    path = tmp_path / "study.yaml"
    plain = load_study(TEMPLATES / "study.yaml")
    path.write_text(with_examples("study", "camera.typical", "range", "keep"), encoding="utf-8")
    assert len(load_study(path)) == len(plain) == 6
    lists = text_of("study").replace("  # - ", "  - ")
    assert lists != text_of("study")
    path.write_text(lists, encoding="utf-8")
    assert len(load_study(path)) == 6 * 8 * 2 * 2


def test_the_data_set_s_examples_are_valid(tmp_path):
    path = tmp_path / "dataset.yaml"
    (tmp_path / "my_camera.yaml").write_text(text_of("camera"), encoding="utf-8")
    path.write_text(with_examples("dataset", "mine", "imx385"), encoding="utf-8")
    found = load_data_set(path, [])
    assert set(found.pictures) == {"drawings", "mine"} and set(found.noise.cameras) == {"sony_a7s2", "imx385", "mine"}


def test_the_command_that_is_told_can_be_pasted(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    status, *told = run(capsys, "new", "shot", "two words")
    assert status == 0 and (tmp_path / "two words.yaml").exists()
    assert "photosite simulate 'two words.yaml' --out frames" in "".join(told)
