"""Bad input ends in one message that names file, key, value and fix, a non-zero status, and nothing half-written."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.bad_input import SHOT
from helpers.picture_files import write_exr

from simulator.command_line.main import main

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A good shot beside pictures that are bad in every way."""
    here = tmp_path_factory.mktemp("bad input")
    good = np.random.default_rng(0).random((40, 60, 3))
    write_exr(here / "good.exr", good)
    (here / "cut.exr").write_bytes((here / "good.exr").read_bytes()[:9000])
    (here / "text.exr").write_text("no picture")
    write_exr(here / "two.exr", good[..., :2])
    np.save(here / "five.npy", np.concatenate([good, good[..., :2]], axis=2))
    for name, value in (("nan", np.nan), ("inf", np.inf), ("negative", -1.0)):
        bad = good.copy()
        bad[3, 5, 1] = value
        write_exr(here / f"{name}.exr", bad)
    write_exr(here / "small_depth.exr", good[:20, :, :1] + 1.0)
    write_exr(here / "zero_depth.exr", np.zeros((40, 60, 1)))
    (here / "shot.yaml").write_text(SHOT)
    (here / "missing.yaml").write_text(SHOT.replace("good.exr", "none.exr"))
    (here / "missing_sweep.yaml").write_text(
        SHOT.replace("good.exr", "none.exr") + "sweep: {vary: {exposure.iso: [100, 200]}}\n"
    )
    (here / "unknown.yaml").write_text(SHOT.replace("focal_length", "focal_lenght"))
    (here / "syntax.yaml").write_text(SHOT + "  - [")
    (here / "short.dng").write_bytes(b"II*\0" + bytes(200))
    return here


CASES = {  # arguments of `photosite simulate`, and what the message must hold
    "missing file": (["shot.yaml", "--set", "scene.image=none.exr"], ["scene.image", "none.exr", "no such file"]),
    "missing file in the shot": (["missing.yaml"], ["missing.yaml:2: scene.image = ", "none.exr: no such file"]),
    "missing file of a sweep": (["missing_sweep.yaml"], ["missing_sweep.yaml:2", "none.exr"]),
    "damaged file": (["shot.yaml", "--set", "scene.image=cut.exr"], ["scene.image", "cut.exr", "damaged"]),
    "no picture": (["shot.yaml", "--set", "scene.image=text.exr"], ["scene.image", "text.exr"]),
    "2 channels": (["shot.yaml", "--set", "scene.image=two.exr"], ["two.exr", "2 channels"]),
    "5 channels": (["shot.yaml", "--set", "scene.image=five.npy"], ["five.npy", "5 channels"]),
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
    "ISO": (["shot.yaml", "--set", "exposure.iso=1800"], ["exposure.iso", "1800", "50 to 1600 and 2000 to 25600", "iso_range"]),
    "camera": (["shot.yaml", "--set", "camera=sony_a7s3"], ["sony_a7s3", "sony_a7s2"]),
    "shutter": (["shot.yaml", "--set", "exposure.time=0 s"], ["exposure.time", "1/125 s"]),
    "f-number": (["shot.yaml", "--set", "lens.f_number=f/0.4"], ["lens.f_number", "f/0.5"]),
    "focus": (["shot.yaml", "--set", "lens.focus_distance=4 cm"], ["lens.focus_distance", "0.05 m"]),
    "view": (["shot.yaml", "--set", "scene.field_of_view=5 deg"], ["scene.field_of_view", "lens of at least"]),
    "window": (["shot.yaml", "--set", "camera.window.width=9999"], ["camera.window", "9999", "4240 x 2832"]),
    "small window": (["shot.yaml", "--set", "camera.window.height=4"], ["camera.height = 4 px", "22", "set camera.window"]),
    "device": (["shot.yaml", "--device", "abacus"], ["abacus", "no OpenCL device matches"]),
    "too large": (
        ["shot.yaml", "--set", "camera={base: sony_a7s2, width: 63000, height: 63000, window: null}"],
        ["63000 x 63000", "a DNG ends at 4 GiB", "camera.window"],
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
    assert not (folder / "frames").exists()


IN_PLACE_OF_FILES = {  # arguments of `photosite`; each name begins with `folder.` and is one
    "shot": ["simulate", "folder.yaml"],
    "study": ["study", "folder.yaml"],
    "camera": ["simulate", "shot.yaml", "--set", "camera=folder.yaml"],
    "data sheet": ["sheet", "folder.csv"],
    "response": ["simulate", "shot.yaml", "--set", "camera.response.file=folder.csv"],
    "picture": ["simulate", "shot.yaml", "--set", "scene.image=folder.exr"],
    "sweep": ["simulate", "shot.yaml", "--set", "sweep={vary: {scene.image: [folder.exr]}}"],
    "depth": ["simulate", "shot.yaml", "--set", "scene.depth={image: folder.exr, unit: m}"],
    "cube": ["simulate", "shot.yaml", "--set", "scene={spectral_cube: folder.img}"],
    "wavelengths": ["simulate", "shot.yaml", "--set", "scene={spectral_cube: five.npy, wavelengths: folder.txt}"],
    "deep": ["simulate", "shot.yaml", "--set", "scene={deep: folder.exr, luminance: 100 cd/m^2, depth: {unit: m}}"],
    "kernels": ["simulate", "shot.yaml", "--set", "lens.psf=folder.npy"],
    "prescription": ["simulate", "shot.yaml", "--set", "lens={prescription: folder.zmx, focus_distance: 2 m}"],
    "path": ["simulate", "shot.yaml", "--set", "motion={camera: {path: folder.csv}}"],
    "raw file": ["develop", "folder.dng"],
    "tags": ["resimulate", "folder.dng"],
}


@pytest.mark.parametrize("case", IN_PLACE_OF_FILES)
def test_a_folder_in_place_of_a_file_is_called_one(folder, capsys, monkeypatch, case):
    monkeypatch.chdir(folder)
    for suffix in ("yaml", "csv", "exr", "img", "txt", "npy", "zmx", "dng"):
        (folder / f"folder.{suffix}").mkdir(exist_ok=True)
    with pytest.raises(SystemExit) as ended:
        main(IN_PLACE_OF_FILES[case])
    message = capsys.readouterr().err
    assert ended.value.code == 1 and "folder." in message and "is a folder, not a file" in message, message


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
    assert ended.value.code == 1 and message.startswith(f"error: --out {out}: cannot be written: ")


def test_a_frame_that_is_cut_short_develops_to_one_message(folder, capsys, monkeypatch, tmp_path):
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit):
        main(["simulate", "shot.yaml", "--out", str(tmp_path)])
    frame = (tmp_path / "shot.dng").read_bytes()
    (tmp_path / "cut.dng").write_bytes(frame[: len(frame) * 3 // 4])
    with pytest.raises(SystemExit) as ended:
        main(["develop", str(tmp_path / "cut.dng")])
    message = capsys.readouterr().err
    assert ended.value.code == 1 and "cut.dng: damaged or cut short" in message and message.count("error:") == 1
    assert not (tmp_path / "cut.png").exists()


def test_explain_and_the_environment_tell_the_same_way(folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as ended:
        main(["explain", "missing.yaml"])
    assert ended.value.code == 1 and "missing.yaml:2: scene.image = " in capsys.readouterr().err
    done = run(folder, "simulate", "shot.yaml", "--out", "frames", PHOTOSITE_DEVICE="abacus")
    assert done.returncode == 1 and "no OpenCL device matches 'abacus'" in done.stderr and "Traceback" not in done.stderr
    assert not (folder / "frames").exists()


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


LIMITED = """
import resource, sys
from simulator.command_line.main import main

def ended(*arguments):
    try:
        main(list(arguments))
    except SystemExit as end:
        return end.code

assert not ended("simulate", "shot.yaml", "--out", "warm")  # builds the kernels: the compiler has files of its own
"""


def limited(folder: Path, program: str) -> list[str]:
    """Lines that a program printed on stderr, behind LIMITED, in a fresh process."""
    variables = os.environ | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", LIMITED + program]
    done = subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return [line for line in done.stderr.splitlines() if not line.startswith("device:")]


def test_every_writer_names_the_file_that_did_not_fit(folder, tmp_path):
    """The sizes: settings and raw file about 22,000 bytes, twin 25,700, so each limit stops another writer."""
    sweep = (folder / "shot.yaml").read_text() + "sweep: {vary: {exposure.iso: [100, 200]}}\n"
    (folder / "sweep.yaml").write_text(sweep)
    lines = limited(
        folder,
        f"""
for limit, file in ((4000, "shot.json"), (24000, "shot.truth.exr")):
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))
    assert ended("simulate", "shot.yaml", "--out", {str(tmp_path / "single")!r}) == 1
resource.setrlimit(resource.RLIMIT_FSIZE, (10, resource.RLIM_INFINITY))
assert ended("simulate", "sweep.yaml", "--out", {str(tmp_path / "sweep")!r}) == 1
assert ended("develop", "warm/shot.dng", "--out", {str(tmp_path / "a.png")!r}) == 1
assert ended("schema", "--out", {str(tmp_path / "schema.json")!r}) == 1
""",
    )
    expected = [
        "error: single/shot.json", "error: single/shot.truth.exr", "sweep_0000: failed: sweep/sweep_0000.yaml",
        "sweep_0001: failed: sweep/sweep_0001.yaml", "error: sweep/manifest.csv", "error: a.png", "error: schema.json",
    ]  # fmt: skip
    limit = ": cannot be written: File too large; "
    assert [line.replace(f"{tmp_path}/", "").partition(limit)[0] for line in lines] == expected
    assert not [path for path in tmp_path.rglob("*") if path.is_file()]


def test_a_picture_that_does_not_fit_into_memory_is_named(folder):
    """40 Mpixel of float32 take 480 MB; the process may have 200 MB more than it has."""
    np.save(folder / "large.npy", np.broadcast_to(np.float32(0.5), (5000, 8000, 3)))
    try:
        lines = limited(
            folder,
            """
used = int(open("/proc/self/statm").read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (used + 200 * 2**20, resource.RLIM_INFINITY))
assert ended("simulate", "shot.yaml", "--set", "scene.image=large.npy", "--out", "frames") == 1
""",
        )
    finally:
        (folder / "large.npy").unlink()
    assert len(lines) == 1 and "scene.image = " in lines[0] and "large.npy: does not fit into memory" in lines[0]
    assert not (folder / "frames").exists()
