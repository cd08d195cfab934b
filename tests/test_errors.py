"""Bad input ends in one message that names file, key, value and fix, a non-zero status, and nothing half-written."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenImageIO
import pytest

from simulator.command_line import main

ROOT = Path(__file__).parent.parent
SHOT = """\
scene:
  image: good.exr
  depth: 2 m
  luminance: 120 cd/m^2
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
"""


def write_exr(path: Path, pixels: np.ndarray) -> None:
    pixels = np.ascontiguousarray(pixels, dtype=np.float32)
    picture = OpenImageIO.ImageOutput.create(str(path))
    picture.open(str(path), OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], "float"))
    picture.write_image(pixels)
    picture.close()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A good shot beside pictures that are bad in every way."""
    here = tmp_path_factory.mktemp("bad input")
    good = np.random.default_rng(0).random((40, 60, 3))
    write_exr(here / "good.exr", good)
    (here / "cut.exr").write_bytes((here / "good.exr").read_bytes()[:9000])
    (here / "text.exr").write_text("no picture")
    write_exr(here / "two.exr", good[..., :2])
    for name, value in (("nan", np.nan), ("inf", np.inf), ("negative", -1.0)):
        bad = good.copy()
        bad[3, 5, 1] = value
        write_exr(here / f"{name}.exr", bad)
    write_exr(here / "small_depth.exr", good[:20, :, :1] + 1.0)
    write_exr(here / "zero_depth.exr", np.zeros((40, 60, 1)))
    (here / "shot.yaml").write_text(SHOT)
    (here / "unknown.yaml").write_text(SHOT.replace("focal_length", "focal_lenght"))
    (here / "syntax.yaml").write_text(SHOT + "  - [")
    (here / "short.dng").write_bytes(b"II*\0" + bytes(200))
    return here


CASES = {  # arguments of `photosite simulate`, and what the message must hold
    "missing file": (["shot.yaml", "--set", "scene.image=none.exr"], ["scene.image", "none.exr", "no such file"]),
    "damaged file": (["shot.yaml", "--set", "scene.image=cut.exr"], ["scene.image", "cut.exr", "damaged"]),
    "no picture": (["shot.yaml", "--set", "scene.image=text.exr"], ["scene.image", "text.exr"]),
    "channel count": (["shot.yaml", "--set", "scene.image=two.exr"], ["two.exr", "2 channels"]),
    "NaN": (["shot.yaml", "--set", "scene.image=nan.exr"], ["nan.exr", "NaN in 1 of 2400 pixels", "x = 5, y = 3"]),
    "Inf": (["shot.yaml", "--set", "scene.image=inf.exr"], ["inf.exr", "Inf in 1 of 2400 pixels"]),
    "negative": (["shot.yaml", "--set", "scene.image=negative.exr"], ["negative.exr", "negative radiance", "negative: clip"]),
    "depth size": (
        ["shot.yaml", "--set", "scene.depth={image: small_depth.exr, unit: m}"],
        ["scene.depth", "small_depth.exr", "60x20", "60x40"],
    ),
    "depth zero": (["shot.yaml", "--set", "scene.depth={image: zero_depth.exr, unit: m}"], ["zero_depth.exr"]),
    "no unit": (["shot.yaml", "--set", "exposure.time=0.01"], ["exposure.time", "no unit", "0.01 s"]),
    "wrong unit": (["shot.yaml", "--set", "lens.focal_length=50 s"], ["lens.focal_length", "is a time", "50 mm"]),
    "unknown key": (["unknown.yaml"], ["unknown.yaml:5", "lens.focal_lenght", "did you mean `focal_length`"]),
    "YAML syntax": (["syntax.yaml"], ["syntax.yaml:"]),
    "no shot file": (["nothing.yaml"], ["nothing.yaml"]),
    "ISO": (["shot.yaml", "--set", "exposure.iso=150"], ["exposure.iso", "150", "125, 160, 200"]),
    "camera": (["shot.yaml", "--set", "camera=sony_a7s3"], ["sony_a7s3", "sony_a7s2"]),
    "shutter": (["shot.yaml", "--set", "exposure.time=0 s"], ["exposure.time", "1/125 s"]),
    "f-number": (["shot.yaml", "--set", "lens.f_number=f/0.4"], ["lens.f_number", "f/0.5"]),
    "focus": (["shot.yaml", "--set", "lens.focus_distance=4 cm"], ["lens.focus_distance", "0.05 m"]),
    "view": (["shot.yaml", "--set", "scene.field_of_view=5 deg"], ["scene.field_of_view", "lens of at least"]),
    "window": (["shot.yaml", "--set", "camera.window.width=9999"], ["camera.window", "9999", "4240 x 2832"]),
    "device": (["shot.yaml", "--device", "abacus"], ["abacus", "no OpenCL device matches"]),
    "memory": (
        ["shot.yaml", "--set", "camera={base: sony_a7s2, width: 63000, height: 63000, window: null}"],
        ["out of memory", "63000 x 63000", "GB", "camera.window"],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_bad_input_is_one_message_and_leaves_nothing(folder, capsys, monkeypatch, case):
    arguments, expected = CASES[case]
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        main(["simulate", *arguments, "--out", "frames"])
    message = capsys.readouterr().err
    assert ended.value.code == 1
    assert message.count("error:") == 1 and "Traceback" not in message
    for words in expected:
        assert words in message, message
    assert not (folder / "frames").exists() or not list((folder / "frames").iterdir())


@pytest.mark.parametrize("name", ["short.dng", "none.dng", "good.exr"])
def test_a_file_that_is_no_raw_is_one_message(folder, capsys, monkeypatch, name):
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        main(["develop", name, "--out", "picture.png"])
    message = capsys.readouterr().err
    assert ended.value.code == 1 and message.count("error:") == 1 and name in message
    assert not (folder / "picture.png").exists()


@pytest.mark.parametrize("out", ["good.exr", "good.exr/frames", "/proc/none"])
def test_a_folder_that_cannot_be_written_is_found_before_the_work(folder, capsys, monkeypatch, out):
    """Also for root, whom permissions do not stop."""
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        main(["simulate", "shot.yaml", "--out", out])
    message = capsys.readouterr().err
    assert ended.value.code == 1 and "cannot be written" in message and message.count("error:") == 1


def run(folder: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
    """A fresh process."""
    command = [sys.executable, "-m", "simulator", *arguments]
    variables = os.environ | {"PYTHONPATH": str(ROOT)} | environment
    return subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, timeout=120)


def test_no_opencl_at_all_says_how_to_install_one(folder):
    """The loader is sent to a folder of drivers that is not there; pip's PoCL is found the same way, so it is hidden too."""
    done = run(folder, "devices", OCL_ICD_VENDORS=str(folder / "none"))
    if done.returncode == 0:
        pytest.skip("this OpenCL loader does not read OCL_ICD_VENDORS")
    assert "no OpenCL" in done.stderr and "pip install" in done.stderr and "Traceback" not in done.stderr


def test_a_full_disk_is_one_message_and_leaves_no_part_of_the_set(folder, tmp_path):
    """A disk of 100 KiB: the frame's three files need more. Mounting one needs root."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=100k", "tmpfs", str(disk)], capture_output=True)
    if mounted.returncode != 0:
        pytest.skip("mounting a small disk needs root; test_files.py covers full disks without it")
    try:
        done = run(folder, "simulate", "shot.yaml", "--set", "camera.window.width=200", "--out", str(disk))
        assert done.returncode == 1 and "No space left" in done.stderr and done.stderr.count("error:") == 1
        assert not list(disk.iterdir())
    finally:
        subprocess.run(["umount", str(disk)], check=True)
