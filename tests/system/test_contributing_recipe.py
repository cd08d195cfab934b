"""CONTRIBUTING's recipe for a sensor stage, done word for word in a copy of the checkout."""

import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest
from helpers.randomness import accept, counts_p, mean_p, variance_p

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("## Add a sensor stage")[2].partition("\n## ")[0]
VEILS_E = ("3", "100", "3000")
BLACK_DN = 256  # of the ideal camera, which gives a code per electron
WINDOW = "window: {x: 622, y: 372, width: 256, height: 256}"  # in the middle of its 1500 x 1000 photosites
LENS_CAP = "chart: flat_field, reflectance: 0"
SHOT = """
scene: {SCENE, luminance: 100 cd/m^2, illuminant: D55, depth: infinity}
lens: {focal_length: 50 mm, f_number: f/8, cos4: false}
exposure: {time: 1/100 s, iso: 100}
camera: CAMERA
"""
TAKE = """
import sys
import numpy as np
from simulator.config import load_shot
from simulator.pipeline.simulate import simulate
shot, *overrides = sys.argv[1:]
for number, text in enumerate(overrides):
    raw = simulate(load_shot(shot, [text]))
    np.savez(f"{shot}_{number}.npz", dn=raw.dn, noise_free_dn=raw.noise_free_dn, mean_electrons=raw.mean_electrons)
"""


def run(tree: Path, *command: str) -> str:
    """Output of a Python command that imports the copy and nothing of this checkout."""
    environment = os.environ | {"PYTHONPATH": str(tree)}
    done = subprocess.run([sys.executable, *command], cwd=tree, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def follow(text: str, tree: Path) -> list[str]:
    """Do what each item of the recipe says; return the paths of its files.

    An item begins with the path of its file. A block behind which the text says "behind `X`" comes into that file behind the
    one line that holds X, indented as that line; any other block is the whole of a new file.
    """
    paths = []
    for path, item in re.findall(r"^\d+\. `([^`]+)`(.*?)(?=^\d+\. |^\S)", text, re.MULTILINE | re.DOTALL):
        paths.append(path)
        for told, block in re.findall(r"(.*?)^   ```\w+\n(.*?)^   ```$", item, re.MULTILINE | re.DOTALL):
            block, file = textwrap.dedent(block), tree / path
            anchor = re.search(r"behind `([^`]+)`\s*$", told)
            if anchor is None:
                assert not file.exists(), f"{path} is there already"
                file.write_text(block, encoding="utf-8")
                continue
            lines = file.read_text(encoding="utf-8").splitlines()
            (place,) = (number for number, line in enumerate(lines) if anchor[1] in line)
            indent = re.match(r" *", lines[place])[0]
            lines[place + 1 : place + 1] = textwrap.indent(block, indent).splitlines()
            file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return paths


@pytest.fixture(scope="module")
def tree(tmp_path_factory) -> Path:
    """A copy of the checkout that has the stage."""
    tree = tmp_path_factory.mktemp("checkout")
    skipped = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "out", "demo", "images", "benchmarks", "*.egg-info")
    shutil.copytree(ROOT, tree, ignore=skipped, dirs_exist_ok=True)
    paths = follow(TEXT, tree)
    assert len(paths) == len(set(paths)) == len(re.findall(r"^\d+\. ", TEXT, re.MULTILINE)) == 7
    return tree


def override(veil_e: str) -> str:
    """What follows --set in the text, with another veil."""
    (written,) = re.findall(r"`--set ([^`]+)`", TEXT)
    (told,) = shlex.split(written)
    return told.replace("3 e-", f"{veil_e} e-")


def take(tree: Path, folder: Path, scene: str, *overrides: str, camera: str = "") -> list[dict[str, np.ndarray]]:
    """Codes and truth of frames that the copy takes, one for each override."""
    shot = folder / "shot.yaml"
    shot.write_text(SHOT.replace("SCENE", scene).replace("CAMERA", camera or f"{{base: ideal, {WINDOW}}}"), encoding="utf-8")
    run(tree, "-c", TAKE, str(shot), *overrides)
    return [dict(np.load(f"{shot}_{number}.npz")) for number in range(len(overrides))]


@pytest.fixture(scope="module")
def dark_frames(tree, tmp_path_factory) -> dict[str, dict[str, np.ndarray]]:
    """Frames with the lens cap on, by veil."""
    frames = take(tree, tmp_path_factory.mktemp("dark"), LENS_CAP, *map(override, VEILS_E))
    return dict(zip(VEILS_E, frames, strict=True))


def test_a_veil_over_a_dark_frame_has_its_mean_its_variance_and_the_shape_of_counts(dark_frames):
    checks = {}
    for veil_e, frame in dark_frames.items():
        counts, mean_e = frame["dn"].astype(int) - BLACK_DN, float(veil_e)
        checks[veil_e, "mean"] = mean_p(counts, mean_e, mean_e)
        checks[veil_e, "variance"] = variance_p(counts, mean_e, excess_kurtosis=1.0 / mean_e)
        checks[veil_e, "shape"] = counts_p(counts, mean_e)
    accept(checks)


def test_the_truth_of_a_dark_frame_has_the_veil(dark_frames):
    for veil_e, frame in dark_frames.items():
        assert not frame["mean_electrons"].any(), "the veil is no light of the scene"
        assert (frame["noise_free_dn"] == BLACK_DN + float(veil_e)).all()


def test_dark_tiles_beside_bright_ones_have_the_counts_of_the_dark_frame(tree, dark_frames, tmp_path):
    half = np.zeros((100, 150, 3), np.float32)
    half[:50] = 1.0
    np.save(tmp_path / "half.npy", half)
    (found,) = take(tree, tmp_path, "image: half.npy, encoding: linear", override("3000"))
    dark = found["mean_electrons"] == 0.0
    assert 0.4 < dark.mean() < 0.6 and found["mean_electrons"].max() > 100.0
    assert np.array_equal(found["dn"][dark], dark_frames["3000"]["dn"][dark])


def test_a_camera_file_switches_the_stage_on_as_the_option_does(tree, dark_frames, tmp_path):
    (block,) = re.findall(r"^```yaml\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    (tmp_path / "veiled.yaml").write_text(f"base: ideal\n{WINDOW}\n{block}", encoding="utf-8")
    (found,) = take(tree, tmp_path, LENS_CAP, "exposure.iso=100", camera="veiled.yaml")
    assert np.array_equal(found["dn"], dark_frames["3"]["dn"])


@pytest.mark.slow
def test_the_tests_of_the_house_pass_with_the_stage(tree):
    rooms = ("sensor/stages/test_stray_light", "sensor/stages/test_stage", "sensor/kernel/test_sensor")
    rooms += ("pipeline/test_planner", "system/test_architecture", "system/test_package")
    chosen = [f"tests/{name}.py" for name in rooms]
    told = run(
        tree,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "--assert=plain",
        *chosen,
        "-k",
        "stray or stage or truth or imports or rooms",
    )
    assert re.search(r"^\d+ passed", told.splitlines()[-1]), told
