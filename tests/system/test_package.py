"""The sdist and the wheel made of it: all that the program needs, nothing else, and it works away from the source tree."""

import configparser
import email
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from dataclasses import fields
from pathlib import Path
from typing import get_type_hints

import pytest
import yaml

import simulator
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import fields_from_shot
from simulator.units import key_of

REPOSITORY = Path(__file__).parents[2]
PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]
PACKAGES = ("photosite", "simulator", "data_gen")
KINDS = ("*.py", "*.pyi", "py.typed", "*.html", "*.css", "*.js", "*.npy")
PYTHONS = ("3.11", "3.12", "3.13")
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
def sdist(tmp_path_factory) -> Path:
    """Built from a copy of the tree, so that neither an old build/ gets in nor a new one stays behind."""
    tree, out = tmp_path_factory.mktemp("tree"), tmp_path_factory.mktemp("sdist")
    skipped = shutil.ignore_patterns(".*", "__pycache__", "build", "dist", "out", "demo", "*.egg-info")
    shutil.copytree(REPOSITORY, tree, ignore=skipped, dirs_exist_ok=True)
    code = f"from setuptools import build_meta; build_meta.build_sdist({str(out)!r})"
    run(sys.executable, "-c", code, cwd=tree)
    (path,) = out.iterdir()
    return path


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory) -> Path:
    """Built from the sdist, as pip does where there is no wheel."""
    out = tmp_path_factory.mktemp("wheel")
    run(*PIP, "wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", out, sdist, cwd=out)
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
        *files("configs", "*.zmx", "simulator/configs"),
        *files("configs", "*.seq", "simulator/configs"),
        *(name for package in PACKAGES for kind in KINDS for name in files(package, kind, package)),
    }
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    assert held == expected
    assert {"photosite/__init__.pyi", "photosite/py.typed", "simulator/py.typed", "data_gen/py.typed"} < held
    assert {"simulator/kernels/sensor.cl", "simulator/kernels/philox.h", "simulator/configs/cameras/ideal.yaml"} < held


def test_the_sdist_holds_what_make_and_the_tests_need(sdist):
    top = f"photosite-{simulator.__version__}"
    with tarfile.open(sdist) as archive:
        held = {name.removeprefix(f"{top}/") for name in archive.getnames()}
    loose = {
        "README.md",
        "LICENSE",
        "CITATION.cff",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "Makefile",
        "pyproject.toml",
        "setup.cfg",
    }
    assert loose < held
    for folder in (*PACKAGES, "kernels", "configs", "tests", "docs", "examples", "benchmarks"):
        assert files(folder, "*.*", folder) - held == set(), folder


def test_the_citation_is_of_this_version_and_licence():
    cited = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"cff-version", "message", "title", "authors"} < cited.keys()  # what Citation File Format 1.2.0 requires
    assert (cited["version"], cited["license"]) == (simulator.__version__, "BSD-3-Clause")
    released = re.search(r"^## (\S+)", (REPOSITORY / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert released is not None and released[1] == simulator.__version__


def test_pipx_finds_the_command_by_the_name_of_the_package(wheel):
    held = zipfile.ZipFile(wheel).read(f"photosite-{simulator.__version__}.dist-info/entry_points.txt").decode()
    commands = configparser.ConfigParser()
    commands.read_string(held)
    assert dict(commands["console_scripts"]) == {"photosite": "data_gen.command_line:main"}


def test_the_metadata_say_what_is_true(wheel):
    archive = zipfile.ZipFile(wheel)
    folder = f"photosite-{simulator.__version__}.dist-info"
    metadata = email.message_from_bytes(archive.read(f"{folder}/METADATA"))
    assert metadata["Version"] == simulator.__version__
    assert metadata["Requires-Python"] == ">=3.11"
    stated = {name for name in metadata.get_all("Classifier") if name.startswith("Programming Language :: Python :: 3.")}
    assert stated == {f"Programming Language :: Python :: {version}" for version in PYTHONS}
    page = (REPOSITORY / "docs" / "install.md").read_text(encoding="utf-8")
    assert f"Python {', '.join(PYTHONS[:-1])} or {PYTHONS[-1]}" in page and Path(wheel).name in page
    assert (metadata["License-Expression"] or metadata["License"]) == "BSD-3-Clause"
    assert archive.read(f"{folder}/licenses/LICENSE") == (REPOSITORY / "LICENSE").read_bytes()


def test_an_installed_photosite_uses_its_own_kernels_and_configs(installed, tmp_path):
    code = "from simulator.device.kernel_source import KERNELS; from simulator.color.color_tables import CONFIGS; "
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


def test_an_installed_photosite_writes_start_files_and_completes_names(installed, tmp_path):
    photosite, own = installed / "bin" / "photosite", {"PYTHONPATH": str(installed)}
    assert run(photosite, "new", "shot", cwd=tmp_path, **own) == "shot.yaml\n"
    asked = {"_PHOTOSITE_COMPLETE": "complete_bash", "COMP_WORDS": "photosite lens color_", "COMP_CWORD": "2"}
    assert run(photosite, cwd=tmp_path, **own, **asked).split() == ["color_checker"]


def interpreter(version: str) -> str | None:
    """A Python of this version; None where there is none, or only a shim of pyenv that leads nowhere."""
    found = shutil.which(f"python{version}")
    works = found and subprocess.run([found, "-c", "import ensurepip, venv"], capture_output=True).returncode == 0
    return found if works else None


@pytest.mark.slow
@pytest.mark.parametrize("version", PYTHONS)
def test_each_python_installs_the_wheel_with_its_packages_and_takes_a_picture(version, wheel, tmp_path):
    """Downloads the packages of install_requires for that Python."""
    python = interpreter(version)
    if python is None:
        pytest.skip(f"no Python {version} is installed here")
    alone = {"PYTHONPATH": ""}
    run(python, "-m", "venv", tmp_path / "venv", cwd=tmp_path, **alone)
    run(tmp_path / "venv" / "bin" / "python", *PIP[1:], "install", wheel, cwd=tmp_path, **alone)
    photosite = tmp_path / "venv" / "bin" / "photosite"
    run(photosite, "simulate", "flat_field", "--set", SMALL, "--out", "frames", cwd=tmp_path, **alone)
    assert (tmp_path / "frames" / "flat_field.dng").stat().st_size > 0


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
