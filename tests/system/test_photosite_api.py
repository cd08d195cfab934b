"""The public face: its names, their types, shots of arrays, one signature of progress, and examples that work anywhere."""

import ast
import dataclasses
import json
import os
import re
import runpy
import shlex
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import typer
from helpers.study_folder import write_study_folder

import photosite
import simulator
from data_gen.command_line import app, main
from data_gen.recipe.dataset_config import load_data_set
from photosite import (
    ChartScene,
    Exposure,
    ImageScene,
    PhotositeError,
    Scene,
    Seeds,
    Shot,
    SpectralCubeScene,
    ThinLens,
    load_camera,
    load_shot,
    load_sweep,
    resimulate,
    save,
    scene_from_rgb,
    scene_from_spectra,
    simulate,
)
from simulator import homes_of
from simulator.command_line.new import TEMPLATES
from simulator.config import named_file
from simulator.progress import Steps, silent
from simulator.studies import load_study

ROOT = Path(__file__).parents[2]
HEAVY = ("pyopencl", "matplotlib", "colour", "pydantic", "pint", "numpy", "OpenImageIO", "rawpy", "yaml", "scipy", "torch")
STUBS = [ROOT / "simulator" / "__init__.pyi", *sorted((ROOT / "photosite").glob("*.pyi"))]
WINDOW = "camera.window={x: 1800, y: 1200, width: 48, height: 32}"


@pytest.fixture(scope="module")
def camera():
    return load_camera("sony_a7s2", [WINDOW])


def shot_of(scene, camera) -> Shot:
    return Shot(scene, ThinLens(50.0, 4.0, 2.0), Exposure(1 / 100, 400), camera, Seeds(frame=3), name="array")


@pytest.mark.parametrize("stub", STUBS, ids=lambda path: "/".join(path.parts[-2:]))
def test_the_names_of_a_program_are_those_of_a_type_checker(stub):
    homes = homes_of(str(stub.with_suffix(".py")))
    typed = {}
    for node in ast.parse(stub.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ImportFrom):
            typed |= {alias.asname: node.module for alias in node.names if alias.asname == alias.name}
    assert homes == typed and homes
    name = ".".join(stub.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
    module = __import__(name, fromlist=["*"]) if name != "photosite.torch" else None
    for each in homes if module else ():
        value = getattr(module, each)
        assert each in module.__all__ and each in dir(module) and value is getattr(module, each)
        assert isinstance(value, type(photosite)) or callable(value) or each in ("Lens", "Progress")


def test_the_simulators_own_names_are_the_same_objects():
    assert set(simulator.__all__) < set(photosite.__all__)
    assert all(getattr(simulator, name) is getattr(photosite, name) for name in simulator.__all__)
    assert photosite.__version__ == simulator.__version__
    with pytest.raises(AttributeError, match="module 'photosite' has no attribute 'nothing'"):
        _ = photosite.nothing


def test_importing_the_public_face_imports_nothing_heavy():
    code = f"import sys, photosite; dir(photosite); print([name for name in {HEAVY!r} if name in sys.modules])"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.strip() == "[]"


def test_the_page_says_what_every_name_is_for():
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    modules = {"dataset", "measurement", "stages", "torch"}
    missing = [name for name in photosite.__all__ if not re.search(rf"`(photosite\.)?{name}(\(\))?`", page)]
    assert missing == [] and modules < set(photosite.__all__)


def test_the_example_of_the_page_runs_as_written(tmp_path, monkeypatch, capsys):
    page = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    names: dict[str, object] = {}
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(code, "docs/python.md", "exec"), names)
    assert {path.name for path in (tmp_path / "frames").iterdir()} == {"shot.dng", "shot.truth.exr", "shot.json"}
    assert names["picture"].shape == (400, 600, 3) and "(400, 600, 3)" in capsys.readouterr().out


def test_the_readmes_python_runs_as_written(tmp_path, monkeypatch):
    page = (ROOT / "README.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    small = {"exposure.iso": 12800, "camera.window": {"x": 1800, "y": 1200, "width": 48, "height": 32}}
    assert '{"exposure.iso": 12800}' in code
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace('{"exposure.iso": 12800}', repr(small)), "README.md", "exec"), {})
    assert (tmp_path / "frames" / "color_checker.json").is_file()


def test_the_users_script_runs(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(ROOT / "examples" / "first_shot.py"), run_name="__main__")
    assert "ISO 25600" in capsys.readouterr().out
    assert {path.suffix for path in (tmp_path / "first_shot").iterdir()} == {".dng", ".exr", ".json", ".png"}


def test_a_scene_of_an_array_is_that_of_the_file_with_the_same_numbers(tmp_path):
    generator = np.random.default_rng(1)
    rgb, depth_m = generator.random((20, 30, 3), np.float32), generator.uniform(1.0, 5.0, (20, 30)).astype(np.float32)
    np.save(tmp_path / "rgb.npy", rgb)
    np.save(tmp_path / "depth.npy", depth_m)
    depth = photosite.DepthImage(tmp_path / "depth.npy")
    for of in ("white", "mean"):
        wanted = ImageScene(tmp_path / "rgb.npy", 80.0, of, "A", depth_m=depth, field_of_view_deg=40.0).load()
        found = scene_from_rgb(
            rgb, luminance_cd_m2=80.0, luminance_of=of, illuminant="A", depth_m=depth_m, field_of_view_deg=40.0
        )
        assert_same(found, wanted)
    codes = generator.integers(0, 256, (20, 30), np.uint8)
    np.save(tmp_path / "grey.npy", codes)
    assert_same(
        scene_from_rgb(codes, luminance_cd_m2=80.0, depth_m=3.0), ImageScene(tmp_path / "grey.npy", 80.0, depth_m=3.0).load()
    )


@pytest.mark.parametrize("own_nm", [(500.0, 450.0, 550.0), (450.0, 500.0, 610.0)])
@pytest.mark.parametrize("quantity", ["radiance", "reflectance"])
def test_a_scene_of_spectra_is_that_of_the_file_with_the_same_numbers(tmp_path, own_nm, quantity):
    cube = np.random.default_rng(2).random((10, 12, 3))
    np.save(tmp_path / "cube.npy", cube)
    np.save(tmp_path / "nm.npy", np.array(own_nm))
    wanted = SpectralCubeScene(tmp_path / "cube.npy", tmp_path / "nm.npy", quantity, 50.0).load()
    assert_same(scene_from_spectra(cube, own_nm, quantity=quantity, luminance_cd_m2=50.0), wanted)


def assert_same(found: Scene, wanted: Scene) -> None:
    for field in dataclasses.fields(Scene):
        if field.name != "notes" and field.compare:
            np.testing.assert_array_equal(getattr(found, field.name), getattr(wanted, field.name), err_msg=field.name)
    assert found.planes.dtype == np.float32


def test_an_array_is_copied_and_bad_ones_are_one_clear_error():
    rgb = np.full((4, 6, 3), 0.5, np.float32)
    rgb[0, 0] = -1e-4
    scene = scene_from_rgb(rgb, luminance_cd_m2=100.0, negative="clip")
    assert rgb.min() < 0 <= scene.planes.min()
    good = np.full((4, 6, 3), 0.5)
    holes = np.full((4, 6), 2.0)
    holes[1, 2] = np.nan
    nan = good.copy()
    nan[3, 5, 1] = np.nan
    for told, call in {
        "rgb = array: negative radiance in 1 of 24 pixels": lambda: scene_from_rgb(rgb, luminance_cd_m2=1.0),
        "rgb = array: NaN in 1 of 24 pixels": lambda: scene_from_rgb(nan, luminance_cd_m2=1.0),
        r"rgb = array of shape \(4, 6, 2\)": lambda: scene_from_rgb(good[..., :2], luminance_cd_m2=1.0),
        r"rgb = array of float64 of shape \(0, 6, 3\)": lambda: scene_from_rgb(good[:0], luminance_cd_m2=1.0),
        "scene.luminance = 0": lambda: scene_from_rgb(good, luminance_cd_m2=0.0),
        "scene.illuminant = D56": lambda: scene_from_rgb(good, luminance_cd_m2=1.0, illuminant="D56"),
        "scene.depth = 0.0 m": lambda: scene_from_rgb(good, luminance_cd_m2=1.0, depth_m=0.0),
        r"depth_m = array of shape \(6, 4\)": lambda: scene_from_rgb(good, luminance_cd_m2=1.0, depth_m=holes.T),
        "depth_m = array: depth is NaN": lambda: scene_from_rgb(good, luminance_cd_m2=1.0, depth_m=holes),
        r"wavelengths_nm = array of shape \(2,\)": lambda: scene_from_spectra(good, [450, 500]),
        "cube = array: negative in 1": lambda: scene_from_spectra(rgb, [450, 500, 550]),
        "scene.luminance = nothing": lambda: scene_from_spectra(good, [450, 500, 550], quantity="reflectance"),
    }.items():
        with pytest.raises(PhotositeError, match=told):
            call()


def test_a_shot_of_arrays_is_saved_and_says_that_no_file_holds_it(tmp_path, camera):
    raw = simulate(shot_of(scene_from_rgb(np.full((32, 48), 0.4), luminance_cd_m2=100.0, depth_m=2.0), camera))
    files = save(raw, tmp_path)
    sidecar = json.loads(files.sidecar.read_text(encoding="utf-8"))
    assert sidecar["notes"] == ["the scene was an array of 32 x 48 pixels with 1 bands, which no file holds"]
    with pytest.raises(PhotositeError, match=r"array\.dng: holds no shot, because it was simulated from objects in Python"):
        resimulate(files.dng)
    with pytest.raises(PhotositeError, match=r"array\.json.*the shot was made of objects in Python and stands in no file"):
        load_shot(files.sidecar)


def test_a_shot_takes_a_scene_or_what_loads_one(camera):
    chart = ChartScene("grey_ramp", 100.0)
    first, second = (simulate(shot_of(scene, camera)) for scene in (chart, chart.load()))
    np.testing.assert_array_equal(first.dn, second.dn)


def test_a_loaded_shot_whose_scene_becomes_an_array_forgets_its_file():
    loaded = load_shot("flat_field")
    assert loaded.resolved["scene"]["chart"] == "flat_field"
    other = dataclasses.replace(loaded, scene=scene_from_rgb(np.ones((2, 3)), luminance_cd_m2=100.0))
    assert other.resolved == {}


def test_work_tells_its_share_from_0_to_1(camera):
    seen = []
    simulate(shot_of(ChartScene("flat_field", 100.0), camera), progress=lambda what, share: seen.append((what, share)))
    shares = [share for _, share in seen]
    assert (
        shares[0] == 0.0 and shares[-1] == 1.0 and shares == sorted(shares) and all(isinstance(what, str) for what, _ in seen)
    )


def test_steps_count_and_nothing_to_do_is_done():
    seen = []
    steps = Steps(lambda what, share: seen.append((what, share)), 4)
    steps.add("frames")
    steps.add("frames", 3)
    Steps(lambda what, share: seen.append((what, share)), 0).add("shards", 0)
    silent("nobody", 1.0)
    assert seen == [("frames, 1 of 4", 0.25), ("frames, 4 of 4", 1.0), ("shards, 0 of 0", 1.0)]


def test_a_name_is_a_file_that_comes_along_unless_one_lies_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_shot("color_checker").name == "color_checker" and len(load_sweep("iso_sweep")) == 9
    assert load_data_set("led_prior").count == 1000
    text = (ROOT / "configs" / "shots" / "flat_field.yaml").read_text(encoding="utf-8")
    (tmp_path / "color_checker").write_text(text, encoding="utf-8")
    assert load_shot("color_checker").scene.chart == "flat_field"
    for path in ("./grey_ramp", "grey_ramp.yaml", "shots/grey_ramp", tmp_path / "grey_ramp"):
        with pytest.raises(PhotositeError, match="grey_ramp.*: no such file; give the path"):
            load_shot(path)
    with pytest.raises(PhotositeError, match=r"^color_cheker: .*did you mean `color_checker`\? \(known: .*\bcolor_checker, "):
        load_shot("color_cheker")
    with pytest.raises(PhotositeError, match=r"^led: .*did you mean `led_prior`\?"):
        load_data_set("led")


def examples() -> list[list[str]]:
    """Arguments of every example in the help of a command, in the order of the commands."""
    infos = [app.info, *app.registered_commands]
    infos += [command for group in app.registered_groups for command in group.typer_instance.registered_commands]
    texts = [info.epilog for info in infos if isinstance(info.epilog, str)]
    lines = [line for text in texts for line in text[text.rindex(": photosite ") + 2 :].split("; ")]
    found = [shlex.split(line) for line in lines]
    return sorted((example[1:] for example in found), key=lambda example: [*MAKERS, example[0]].index(example[0]))


MAKERS = ("simulate", "validate")  # commands whose files other examples read
TAKEN = ["validate", "simulate", "study", "resimulate", "develop", "inspect", "explain", "calibrate", "schema", "dataset"]
TAKEN += ["plot", "compare", "report", "lens", "new", "mtf", "measure", "explore", "sheet"]


def test_every_command_that_takes_something_has_an_example():
    assert {example[0] for example in examples()} == set(TAKEN)


@pytest.mark.parametrize("arguments", examples(), ids=lambda arguments: "-".join(arguments[:2]))
def test_what_an_example_names_comes_along_or_is_made_by_another(arguments):
    command, rest = typer.main.get_command(app), list(arguments)
    while hasattr(command, "commands"):
        command = command.commands[rest.pop(0)]
    values = command.make_context(command.name, rest).params  # knows every option
    if values.get("shot") is not None:
        settings = values["settings"] or ()
        assert load_shot(values["shot"], settings).resolved["scene"]["chart"]
    elif arguments[0] in ("lens", "new"):
        assert "focal_length" in values or (TEMPLATES / f"{values['kind']}.yaml").is_file()
    elif "camera" in values:
        assert set(values["iso"] if isinstance(values["iso"], list) else [values["iso"]]) <= set(
            load_camera(values["camera"]).isos
        )
    elif "subject" in values or "subjects" in values:
        assert all(load_camera(one).isos for one in values.get("subjects") or [values["subject"]])
    elif "config" in values:
        assert named_file("datasets", values["config"]).is_file() and load_data_set(values["config"]).count
    elif "study" in values:
        assert named_file("studies", values["study"]).is_file() and len(load_study(values["study"]))
    elif "raw" in values:
        folder, name = values["raw"].parts
        made = [example for example in examples() if example[0] == "simulate" and example[-2:] == ["--out", folder]]
        assert name in {f"{example[1]}.dng" for example in made}
    elif "files" in values:
        (folder,) = values["files"]
        assert any(example[:2] == ["validate", "noise"] and example[-1] == str(folder.parent) for example in examples())
        assert folder.name == "frames" and ("base" not in values or load_camera(values["base"]))
    elif "folder" in values:
        assert any(example[0] == "study" and str(values["folder"]) in example for example in examples())
    else:
        assert arguments[0] == "schema"


@pytest.mark.slow
def test_every_example_runs_in_an_empty_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for arguments in examples():
        if arguments[0] == "explore":  # serves until Ctrl-C; tests/explore does that
            continue
        if arguments[0] == "report":  # the example of a study takes no frame
            write_study_folder(Path(arguments[1]))
        with pytest.raises(SystemExit) as ended:
            main(arguments)
        assert not ended.value.code, f"photosite {shlex.join(arguments)}: {capsys.readouterr().err}"
    assert {path.name for path in tmp_path.iterdir()} >= {"frames", "again", "picture.png", "noise", "emva", "mine.yaml"}
