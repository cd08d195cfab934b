"""A shell completes the names of shots, cameras, data sets and kinds of files, and paths."""

import os
import subprocess
import sys

import pytest

from simulator.color.color_tables import CONFIGS
from simulator.command_line.completion import complete_name

ROOT = CONFIGS.parent


def completed(words: str, folder) -> list[str]:
    """What bash is told for a line; its last word is the one that is begun."""
    code = "from data_gen.command_line import main; main()"
    asked = {"_PHOTOSITE_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)}
    environment = os.environ | asked | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, env=environment, capture_output=True, text=True)
    assert not done.stderr
    return done.stdout.split()


def names(kind: str) -> set[str]:
    return {str(path.relative_to(CONFIGS / kind).with_suffix("")) for path in (CONFIGS / kind).rglob("*.yaml")}


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("photosite simulate color_", {"color_checker"}),
        ("photosite explain motorcycle_s", {"motorcycle_stopped_down"}),
        ("photosite validate noise sony_a7s", {"sony_a7s2"}),
        ("photosite lens --camera imx3", {"imx385"}),
        ("photosite validate noise illustrative/x", {"illustrative/x_trans"}),
        ("photosite plot color_", {"color_checker"}),
        ("photosite compare color_checker illu", {"illustrative/dual_gain", "illustrative/x_trans"}),
        ("photosite dataset led", {"led_prior"}),
        ("photosite study iso_", {"iso_and_aperture"}),
        ("photosite new ", {"shot", "camera", "study", "dataset"}),
        ("photosite resim", {"resimulate"}),
    ],
)
def test_a_shell_gets_the_names_of_the_library(words, expected, tmp_path):
    found = completed(words, tmp_path)
    assert set(found) >= expected and all(name.startswith(words.rpartition(" ")[2]) for name in found)


def test_names_and_paths_stand_beside_each_other(tmp_path, monkeypatch):
    (tmp_path / "shots").mkdir()
    for name in ("color_mine.yaml", "color.txt", ".hidden.yaml", "shots/one.yml"):
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    assert complete_name("shots", "color") == ["color_checker", "color_mine.yaml"]
    assert complete_name("shots", "sho") == ["shots/"] and complete_name("shots", "shots/") == ["shots/one.yml"]
    assert complete_name("shots", f"{tmp_path}/co") == [f"{tmp_path}/color_mine.yaml"]
    assert set(complete_name("cameras", "")) == names("cameras") | {"color_mine.yaml", "shots/"}
    assert complete_name("shots", "nowhere/") == []


def test_completion_waits_for_no_heavy_package(tmp_path):
    code = "import sys; from simulator.command_line.completion import complete_name; complete_name('shots', 'c'); "
    code += "print([name for name in ('numpy', 'yaml', 'pydantic', 'pyopencl', 'rich') if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.stdout == "[]\n", done.stderr
