"""The wheel: all that the program needs, nothing else, and it works away from the source tree."""

import email
import os
import shutil
import subprocess
import sys
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

import pytest

import simulator
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import fields_from_shot
from simulator.units import key_of

REPOSITORY = Path(__file__).parents[2]
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
PACKAGES = ("photosite", "simulator", "data_gen")
SMALL = "camera.window={x: 0, y: 0, width: 64, height: 48}"


def run(*command, cwd: Path, **environment: str) -> str:
    done = subprocess.run(command, cwd=cwd, env=os.environ | environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def files(folder: str, pattern: str, inside: str) -> set[str]:
    """Names in the wheel that the files of a folder of the tree must have."""
    found = (path for path in (REPOSITORY / folder).rglob(pattern) if "__pycache__" not in path.parts)
    return {f"{inside}/{path.relative_to(REPOSITORY / folder).as_posix()}" for path in found}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """Built from a copy of the tree, so that neither an old build/ gets in nor a new one stays behind."""
    tree, out = tmp_path_factory.mktemp("tree"), tmp_path_factory.mktemp("wheel")
    skipped = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "out", "demo", "*.egg-info")
    shutil.copytree(REPOSITORY, tree, ignore=skipped, dirs_exist_ok=True)
    run(*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", out, tree, cwd=out)
    (path,) = out.iterdir()
    return path


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory) -> Path:
    """Folder the wheel is installed in."""
    target = tmp_path_factory.mktemp("installed")
    run(*PIP, "install", "--no-deps", "--no-index", "--target", target, wheel, cwd=target)
    return target


def test_the_wheel_holds_the_source_tree_and_nothing_else(wheel):
    expected = {
        *files("kernels", "*.cl", "simulator/kernels"),
        *files("kernels", "*.h", "simulator/kernels"),
        *files("configs", "*.yaml", "simulator/configs"),
        *files("configs", "*.csv", "simulator/configs"),
        *(name for package in PACKAGES for kind in ("*.py", "*.pyi", "py.typed") for name in files(package, kind, package)),
    }
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert held == expected
    assert {"photosite/__init__.pyi", "photosite/py.typed", "simulator/py.typed", "data_gen/py.typed"} < held
    assert {"simulator/kernels/sensor.cl", "simulator/kernels/philox.h", "simulator/configs/cameras/ideal.yaml"} < held


def test_the_metadata_say_what_is_true(wheel):
    archive = zipfile.ZipFile(wheel)
    folder = f"photosite-{simulator.__version__}.dist-info"
    metadata = email.message_from_bytes(archive.read(f"{folder}/METADATA"))
    assert metadata["Version"] == simulator.__version__
    assert metadata["Requires-Python"] == ">=3.11"
    assert (metadata["License-Expression"] or metadata["License"]) == "BSD-3-Clause"
    assert archive.read(f"{folder}/licenses/LICENSE") == (REPOSITORY / "LICENSE").read_bytes()


def test_an_installed_photosite_uses_its_own_kernels_and_configs(installed, tmp_path):
    code = "from simulator.device import KERNELS; from simulator.color.color_tables import CONFIGS; "
    code += "print(KERNELS, CONFIGS, sep='\\n')"
    found = run(sys.executable, "-c", code, cwd=tmp_path, PYTHONPATH=str(installed)).splitlines()
    assert [Path(line) for line in found] == [installed / "simulator" / "kernels", installed / "simulator" / "configs"]


def test_an_installed_photosite_takes_a_picture_from_another_folder(installed, tmp_path):
    photosite = installed / "bin" / "photosite"
    shot = installed / "simulator" / "configs" / "shots" / "flat_field.yaml"
    assert "simulate" in run(photosite, "--help", cwd=tmp_path, PYTHONPATH=str(installed))
    assert "photon_shot_noise" in run(photosite, "explain", shot, cwd=tmp_path, PYTHONPATH=str(installed))
    run(photosite, "simulate", shot, "--set", SMALL, "--out", "frames", cwd=tmp_path, PYTHONPATH=str(installed))
    assert [path.suffix for path in (tmp_path / "frames").glob("*.dng")] == [".dng"]


@pytest.mark.parametrize("stem", sorted(STAGES))
def test_every_stage_stands_in_the_page_of_the_sensor_with_its_keys(stem):
    text = (REPOSITORY / "docs" / "sensor.md").read_text(encoding="utf-8")
    line = next((line for line in text.splitlines() if line.startswith(f"| `{stem}` |")), "")
    assert line, f"docs/sensor.md has no line for {stem}"
    if STAGES[stem].in_camera_stages:
        hints = get_type_hints(STAGES[stem], include_extras=True)
        own = [field.name for field in fields(STAGES[stem]) if field.name not in fields_from_shot(STAGES[stem])]
        for name in own:
            assert f"{key_of(name, hints[name])}: " in line, f"docs/sensor.md: {stem} has a key {name}"
