"""The command: quick to answer, one line for an error, files where they were asked for."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest
from helpers.picture_files import put

import simulator
from simulator.color.color_tables import CONFIGS
from simulator.command_line.main import main

HEAVY = ("pyopencl", "matplotlib", "colour", "pydantic", "pint", "numpy", "OpenImageIO", "rawpy", "yaml", "scipy")
FLAT = str(CONFIGS / "shots" / "flat_field.yaml")
SMALL = ["--set", "camera.window={x: 0, y: 0, width: 64, height: 48}"]


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


def in_fresh_process(code: str) -> str:
    environment = os.environ | {"PYTHONPATH": str(CONFIGS.parent)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    return done.stdout


def test_help_is_quick_because_it_imports_the_command_alone():
    code = f"""
import sys
from simulator.command_line.main import main
try:
    main(["--help"])
except SystemExit as end:
    assert not end.code
print("HEAVY", [name for name in {HEAVY!r} if name in sys.modules])
print(*[name for name in sys.modules if name.startswith(("simulator", "data_gen"))])
"""
    *_, heavy, own = in_fresh_process(code).splitlines()
    assert heavy == "HEAVY []"
    commands = {f"simulator.command_line.{kind}_commands" for kind in ("frame", "plan", "study", "camera")}
    assert set(own.split()) == commands | {
        "simulator",
        "simulator.command_line",
        "simulator.command_line.arguments",
        "simulator.command_line.commands",
        "simulator.command_line.garbage",
        "simulator.command_line.main",
        "simulator.command_line.app",
        "simulator.errors",
    }


def test_importing_the_package_imports_nothing_heavy():
    code = f"import sys, simulator; print([name for name in {HEAVY!r} if name in sys.modules], simulator.__version__)"
    assert in_fresh_process(code).strip() == "[] 0.2.0"


# What the shot of a sharp flat field does without: packages, modules of Python, and our own of blur, rays and terminals.
UNUSED = (
    "matplotlib",
    "colour",
    "pint",
    "scipy",
    "rawpy",
    "skimage",
    "rich",
    "urllib.request",
    "numpy.random",
    "simulator.config.study_file",
    "simulator.measurement",
    "simulator.optics.geometry.layer_phases",
    "simulator.optics.geometry.motion_plan",
    "simulator.optics.kernel_planning",
    "simulator.optics.lamp_planning",
    "simulator.optics.motion_planning",
    "simulator.optics.passes.tile_plan",
    "simulator.optics.passes.reference_mosaic",
    "simulator.optics.passes.psf_mosaic",
    "simulator.optics.psf.field_psf",
    "simulator.optics.psf.psf_planning",
    "simulator.optics.ray_reference",
    "simulator.pipeline.psf_passes",
    "simulator.raw.development",
    "simulator.raw.raw_reader",
)


def test_a_shot_of_the_library_waits_for_nothing_that_it_does_not_need(tmp_path):
    """Its tables, units and noise are at hand; colour-science, SciPy and pint take longer to import than its frame takes."""
    code = f"""
import sys
from simulator.command_line.main import main
try:
    main(["simulate", {FLAT!r}, *{SMALL!r}, "--out", {str(tmp_path)!r}])
except SystemExit as end:
    assert not end.code
print("HEAVY", [name for name in {UNUSED!r} if name in sys.modules])
"""
    assert in_fresh_process(code).strip().endswith("HEAVY []")


def test_the_truth_twin_is_left_out_on_request(tmp_path, capsys):
    for options, ends in (((), [".dng", ".json", ".truth.exr"]), (("--no-truth",), [".dng", ".json"])):
        code, out, _ = run(capsys, "simulate", FLAT, *SMALL, "--out", str(tmp_path), *options)
        assert code == 0 and [f"flat_field{end}" for end in ends] == sorted(path.name for path in tmp_path.iterdir())
        assert sorted(out.split()) == [str(tmp_path / f"flat_field{end}") for end in ends]


def test_a_profile_adds_up_to_the_age_of_the_process(tmp_path):
    arguments = ["simulate", FLAT, *SMALL, "--out", str(tmp_path), "--profile"]
    code = f"from simulator.command_line.main import main\nmain({arguments!r})"
    # In a cache of its own no programs are remembered, so that none is built ahead.
    environment = os.environ | {"PYTHONPATH": str(CONFIGS.parent), "PHOTOSITE_CACHE": str(tmp_path / "cache")}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    kinds, total = done.stderr.strip().splitlines()[-1].removeprefix("time: ").split("; ")
    seconds = {kind: float(number) for kind, number, _ in (part.split() for part in kinds.split(", "))}
    assert list(seconds) == ["import", "build", "device", "files", "host"] and min(seconds.values()) > 0.0
    assert sum(seconds.values()) == pytest.approx(float(total.split()[0]), abs=0.003)  # each is rounded to a millisecond


def test_the_command_does_not_search_its_memory_at_the_end():
    """All of it is given back anyway, and the search takes as long as a small frame."""
    code = f"""
import atexit, gc
atexit.register(lambda: print("FROZEN", gc.get_freeze_count() > 0))  # called after what is registered later
from simulator.command_line.main import main
main(["simulate", {FLAT!r}, "--help"])
"""
    assert in_fresh_process(code).strip().endswith("FROZEN True")


def test_imports_of_a_command_are_not_searched():
    """Of a process that it has for itself; objects made later are."""
    code = """
import gc
from simulator.command_line.garbage import search_seldom, without_search
def made():
    before = gc.get_stats()[0]["collections"]
    with without_search():
        kept.append([[] for _ in range(50_000)])
    return gc.get_stats()[0]["collections"] - before
kept = []
found = [made() > 0, gc.get_freeze_count() > 0]
search_seldom()
print(*found, made(), gc.get_freeze_count() > 50_000, gc.isenabled(), made() > 0)
"""
    assert in_fresh_process(code).split() == ["True", "False", "0", "True", "True", "True"]


def test_the_packages_names_are_what_they_say():
    code = """
import simulator
print(*[getattr(simulator, name).__name__ for name in ("load_shot", "simulate", "develop", "save", "Raw", "Shot")])
"""
    assert in_fresh_process(code).split() == ["load_shot", "simulate", "develop", "save", "Raw", "Shot"]
    assert {"load_shot", "develop", "__version__"} <= set(dir(simulator))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = simulator.nothing


def test_python_dash_m_is_the_same_command():
    environment = os.environ | {"PYTHONPATH": str(CONFIGS.parent)}
    done = subprocess.run([sys.executable, "-m", "simulator", "--version"], capture_output=True, text=True, env=environment)
    assert done.stdout.strip() == f"photosite {simulator.__version__}"


@pytest.mark.parametrize("command", ["simulate", "resimulate", "develop", "devices", "explain", "schema", "calibrate"])
def test_every_command_has_help(capsys, command):
    code, out, _ = run(capsys, command, "--help")
    assert code == 0 and command in out


def test_a_shot_becomes_three_files_and_repeats_bit_for_bit(capsys, tmp_path):
    code, out, _ = run(capsys, "simulate", FLAT, *SMALL, "--set", "exposure.iso=1600", "--out", str(tmp_path / "a"))
    names = ["flat_field.dng", "flat_field.truth.exr", "flat_field.json"]
    assert code == 0 and out.splitlines() == [str(tmp_path / "a" / name) for name in names]
    sidecar = json.loads((tmp_path / "a" / "flat_field.json").read_text())
    assert sidecar["shot"]["exposure"]["iso"] == 1600
    # A sidecar is a shot file: it gives the same frame again.
    code, _, _ = run(capsys, "simulate", str(tmp_path / "a" / "flat_field.json"), "--out", str(tmp_path / "b"))
    assert code == 0
    assert (tmp_path / "a" / names[0]).read_bytes() == (tmp_path / "b" / names[0]).read_bytes()


def test_a_sweep_is_taken_and_then_skipped(capsys, tmp_path):
    shot = tmp_path / "s.yaml"
    text = (CONFIGS / "shots" / "flat_field.yaml").read_text()
    shot.write_text(text + "sweep: {vary: {exposure.iso: [100, 400]}}\n")
    for status in ("done", "skipped: already there"):
        code, out, _ = run(capsys, "simulate", str(shot), *SMALL, "--out", str(tmp_path / "out"))
        assert code == 0 and out.strip() == str(tmp_path / "out" / "manifest.csv")
        lines = (tmp_path / "out" / "manifest.csv").read_text().splitlines()
        assert [line.rsplit(",", 1)[1] for line in lines[1:]] == [status] * 2
    first, second = ((tmp_path / "out" / f"s_000{index}.dng").read_bytes() for index in range(2))
    assert first != second


def test_a_failed_sweep_ends_with_status_1(capsys, tmp_path):
    shot = tmp_path / "s.yaml"
    shot.write_text((CONFIGS / "shots" / "flat_field.yaml").read_text() + "sweep: {vary: {exposure.iso: [100, 400]}}\n")
    # LibRaw reads no frame of 4 x 4 photosites, so none is written.
    tiny = ["--set", "camera.window={x: 0, y: 0, width: 4, height: 4}"]
    code, _, err = run(capsys, "simulate", str(shot), *tiny, "--out", str(tmp_path / "out"))
    assert code == 1 and "2 of 2 points failed" in err
    assert "failed" in (tmp_path / "out" / "manifest.csv").read_text()


def test_develop_writes_a_picture(capsys, tmp_path):
    run(capsys, "simulate", FLAT, *SMALL, "--out", str(tmp_path))
    code, out, _ = run(capsys, "develop", str(tmp_path / "flat_field.dng"), "--half-size")
    assert code == 0 and out.strip() == str(tmp_path / "flat_field.png") and (tmp_path / "flat_field.png").stat().st_size > 100
    light = [tmp_path / f"light{ev}.exr" for ev in (0, 1)]
    for ev, picture in enumerate(light):
        linear = ["--output", "linear_srgb", "--half-size", "--exposure", str(ev), "--out", str(picture)]
        assert run(capsys, "develop", str(tmp_path / "flat_field.dng"), *linear)[0] == 0
    assert _mean(light[1]) == pytest.approx(2 * _mean(light[0]), rel=1e-3)
    metric = [str(tmp_path / "flat_field.dng"), "--output", "metric"]
    code, out, _ = run(capsys, "develop", *metric, "--white-balance", "0,0,8,8")
    assert code == 0 and out.strip() == str(tmp_path / "flat_field.exr")
    code, _, err = run(capsys, "develop", *metric, "--out", "clipped.png")
    assert code == 1 and err.startswith("error: --out clipped.png: metric output goes below 0")
    code, _, err = run(capsys, "develop", str(tmp_path / "flat_field.dng"), "--white-balance", "1,2")
    assert code == 1 and err.startswith("error: --white-balance 1,2: give")


def _mean(path) -> float:
    from OpenImageIO import ImageBuf

    return float(ImageBuf(str(path)).get_pixels().mean())


def test_explain_shows_plan_lens_and_white(capsys):
    code, out, _ = run(capsys, "explain", str(CONFIGS / "shots" / "color_checker.yaml"))
    assert code == 0
    assert "photon_shot_noise" in out and "dark_current" in out and "skipped" in out
    assert "51.282 mm" in out  # image distance 1 / (1/50 - 1/2000)
    assert "f/4.103" in out and "38.30 deg" in out  # 4 (1 + 50/1950); 2 atan(17.81 / 51.28)
    assert "0.3678 lx s" in out  # pi 120 / (1 + 64 (1 + 50/1950)^2) / 15
    assert "stops below clipping" in out
    assert "A grey patch, 18 % of white" in out and "0.06621 lx s" in out  # 18 % of 0.3678 lx s
    assert "photon shot %" in out and "time [s]" in out and "shutter gets shorter" in out
    assert "shutter stays" in run(capsys, "explain", FLAT, "--same-shutter", "--patch", "0.05")[1]


def test_explain_tells_of_an_hour_whose_dark_current_fills_the_wells(capsys):
    code, out, _ = run(
        capsys, "explain", FLAT, "--set", "exposure.time=1 h", "--set", "camera.stages.dark_current={rate: 100 e-/s}"
    )
    assert code == 0 and "dark current alone reaches white" in out


def test_explain_expects_the_electrons_that_the_frame_has(capsys):
    from simulator.pipeline.explain.grey_patch import grey_patch
    from simulator.pipeline.planner import plan

    shot = simulator.load_shot(FLAT, {"camera.window": {"x": 2088, "y": 1384, "width": 64, "height": 64}})
    raw = simulator.simulate(shot)
    red, green, blue = grey_patch(shot, plan(shot).optics.scene, 1.0).electrons
    means = raw.mean_electrons
    assert [means[0::2, 0::2].mean(), means[0::2, 1::2].mean(), means[1::2, 1::2].mean()] == pytest.approx(
        [red, green, blue], rel=1e-5
    )


def test_schema_is_json_on_screen_and_in_a_file(capsys, tmp_path):
    code, out, _ = run(capsys, "schema")
    assert code == 0 and json.loads(out)["properties"]["lens"]
    code, _, _ = run(capsys, "schema", "--out", str(tmp_path / "schema.json"))
    assert code == 0 and json.loads((tmp_path / "schema.json").read_text()) == json.loads(out)


def test_devices_lists_the_default(capsys):
    from simulator.device import devices

    code, out, _ = run(capsys, "devices")
    assert code == 0 and devices()[0].name in out


def test_devices_fails_where_the_default_builds_no_kernels(capsys, monkeypatch):
    from simulator.device import Device, devices
    from simulator.errors import PhotositeError

    def check(self):
        raise PhotositeError("its compiler knows nothing")

    monkeypatch.setattr(Device, "check", check)
    code, out, told = run(capsys, "devices")
    assert code == 1 and devices()[0].name in out and "its compiler knows nothing" in told


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["simulate", "none.yaml"], "none.yaml: no such file"),
        (["simulate", FLAT, "--set", "lens.f_number=f/0.1"], "--set lens.f_number=f/0.1: lens.f_number = f/0.1"),
        (["simulate", FLAT, "--out", "/dev/null/x"], "/dev/null/x"),
        (["simulate", FLAT, *SMALL, "--device", "no such device"], "no OpenCL device matches"),
        (["explain", "none.yaml"], "none.yaml: no such file"),
        (["explain", FLAT, "--patch", "18"], "patch = 18: give a reflectance"),
        (["develop", "none.dng"], "none.dng"),
        (["schema", "--out", "/dev/null/x.json"], "/dev/null/x.json"),
    ],
)
def test_an_error_is_told_on_stderr_with_status_1_and_no_traceback(capsys, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    code, _, err = run(capsys, *arguments)
    assert code == 1
    assert err.startswith("error: ") or "\nerror: " in err
    assert message in err and "Traceback" not in err
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_and_an_interrupt_have_their_own_ends(capsys, monkeypatch):
    import simulator.command_line.simulation as simulation

    def full(*_):
        raise OSError(28, "No space left on device", "frame.dng")

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(simulation, "simulate_shot", full)
    code, _, err = run(capsys, "simulate", FLAT, "--out", "/tmp")
    assert (code, err) == (1, "error: frame.dng: No space left on device\n")
    monkeypatch.setattr(simulation, "simulate_shot", interrupted)
    assert run(capsys, "simulate", FLAT, "--out", "/tmp")[0] == 130


def test_debug_shows_the_traceback(monkeypatch):
    from simulator.errors import PhotositeError

    monkeypatch.setenv("PHOTOSITE_DEBUG", "1")
    with pytest.raises(PhotositeError):
        main(["simulate", "none.yaml"])


def test_a_wrong_option_ends_with_status_2(capsys):
    assert run(capsys, "simulate", FLAT, "--foo")[0] == 2


@pytest.mark.parametrize("command", ["simulate", "explain"])
def test_a_prediction_above_the_tolerance_is_a_warning(capsys, tmp_path, command):
    """A picture with a step in depth: it does not show what the lens sees behind it. Written to the log; explain prints it."""
    picture = np.random.default_rng(1).uniform(0.1, 1.0, (48, 64, 4)).astype(np.float32)
    picture[..., 3] = np.where(np.arange(64) < 32, 1.0, 3.0)
    put(tmp_path / "picture.exr", picture, ("R", "G", "B", "Z"))
    (tmp_path / "shot.yaml").write_text(
        "scene: {image: picture.exr, depth: {channel: Z, unit: m}, luminance: 100 cd/m^2}\n"
        "lens: {focal_length: 50 mm, f_number: f/2, focus_distance: 2 m}\n"
        "exposure: {time: 10 ms}\ncamera: {base: ideal, window: {x: 700, y: 400, width: 64, height: 48}}\n",
        encoding="utf-8",
    )
    settings = ["--out", str(tmp_path)] if command == "simulate" else []
    code, out, log = run(capsys, command, str(tmp_path / "shot.yaml"), *settings)
    told = " ".join((log if command == "simulate" else out).split())
    assert code == 0 and "warning: tolerance = 0.1 is not met: the lens blur may be wrong by" in told
    assert "warning: lens blur: up to" in told and "by background behind edges" in told and "give the scene as layers" in told


def test_a_library_says_nothing_at_the_end(tmp_path):
    """OpenImageIO's bindings call objects that the interpreter did not collect leaks."""
    raw, picture = tmp_path / "flat.dng", tmp_path / "flat.png"
    camera = {"camera.window": {"x": 0, "y": 0, "width": 64, "height": 48}}
    simulator.save(simulator.simulate(simulator.load_shot(FLAT, camera | {"name": "flat"})), tmp_path)
    command = [sys.executable, "-m", "simulator", "develop", str(raw), "--out", str(picture)]
    environment = os.environ | {"PYTHONPATH": str(CONFIGS.parent)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert picture.is_file() and done.stderr == ""
