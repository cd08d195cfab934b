"""An error is data: file, line, key, value and rule arrive where it is caught, and no program reads its text."""

import ast
import copy
import os
import pickle
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from data_gen.generate import Generator
from data_gen.recipe.dataset_config import DataSet
from data_gen.sources.collections import open_collection
from data_gen.sources.data_set import DataSetSamples
from data_gen.sources.exposed_scene import renamed_key
from data_gen.sources.shots import Shots
from simulator.command_line.simulation import simulate_file
from simulator.config import load_camera, load_file, load_shot, load_sweep, locate_errors
from simulator.errors import FIELDS, PhotositeError, check_file, reading, require
from simulator.raw.dng.xmp import SettingsChanged
from simulator.studies.sweep_runner import run_sweep

ROOT = Path(__file__).parents[2]
SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens:
  focal_length: 50 mm
  f_number: f/4
  focus_distance: 2 m
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
"""
DATA_SET = """\
count: 1
crop: [16, 24]
pictures: {leaves: {procedural: [dead_leaves]}, photos: {photographs: pictures}}
noise: {cameras: {sony_a7s2: {iso: 1600}}}
"""
FULL = {"file": "a.yaml", "line": 3, "via": "sweep", "part": "s_0001", "key": "lens.f_number", "value": 0, "within": ("out",)}


@pytest.fixture
def shot_file(tmp_path):
    """Write the shot with one text in place of another; returns its path."""

    def write(old: str = "", new: str = "", sweep: dict | None = None) -> Path:
        path = tmp_path / "shot.yaml"
        more = "" if sweep is None else yaml.safe_dump({"sweep": sweep})
        path.write_text((SHOT.replace(old, new) if old else SHOT) + more, encoding="utf-8")
        return path

    return write


def caught(action) -> PhotositeError:
    with pytest.raises(PhotositeError) as failure:
        action()
    return failure.value


def facts(error: PhotositeError) -> tuple:
    return str(error.file), error.line, error.key, str(error.value)


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({}, "give more"),
        ({"key": "lens.f_number"}, "lens.f_number: give more"),
        ({"key": "lens.f_number", "value": 0}, "lens.f_number = 0: give more"),
        ({"key": "--out", "value": Path("x")}, "--out x: give more"),
        ({"key": "lens.f_number", "joint": " "}, "lens.f_number give more"),
        ({"file": Path("a.yaml")}, "a.yaml: give more"),
        ({"file": "a.yaml", "line": 3}, "a.yaml:3: give more"),
        ({"file": "a.yaml", "key": "lens", "value": 1}, "a.yaml: lens = 1: give more"),
        ({"part": "sample 3"}, "sample 3: give more"),
        ({"part": "s_0001", "key": "white_level", "value": "0 DN"}, "s_0001: white_level = 0 DN: give more"),
        (FULL, "out: a.yaml:3 (sweep): s_0001: lens.f_number = 0: give more"),
    ],
)
def test_the_text_is_made_of_the_fields_that_are_there(fields, text):
    error = PhotositeError("give more", **fields)
    assert str(error) == f"{error}" == text


def test_fields_that_are_not_given_are_none():
    error = PhotositeError("give more")
    assert (error.file, error.line, error.via, error.part, error.key, error.value, error.within) == (None,) * 6 + ((),)
    assert error.rule == "give more"


@pytest.mark.parametrize("again", [copy.copy, copy.deepcopy, lambda error: pickle.loads(pickle.dumps(error))])
@pytest.mark.parametrize("kind", [PhotositeError, SettingsChanged])
def test_a_copy_and_a_pickle_hold_the_same(kind, again):
    error = kind("give more", **FULL)
    there = again(error)
    assert type(there) is kind and str(there) == str(error)
    assert [getattr(there, name) for name in FIELDS] == [getattr(error, name) for name in FIELDS]
    assert pickle.loads(pickle.dumps(again(kind("give more")))).file is None


def test_require_names_key_and_value_and_shows_none_as_a_value():
    require(True, "lens.f_number", 0, "give more")
    assert str(caught(lambda: require(False, "lens.f_number", None, "give more"))) == "lens.f_number = None: give more"
    error = caught(lambda: require(False, "cells", 2, "give an odd number", file="psf.npz"))
    assert (error.file, error.key, error.value, error.rule) == ("psf.npz", "cells", 2, "give an odd number")


def test_a_place_that_is_learned_later_makes_a_new_error():
    error = PhotositeError("give more", key="lens.f_number", value=0)
    placed = error.with_file("a.yaml", 3, "sweep")
    assert error.file is None and error.names_a_value and not placed.names_a_value
    assert str(placed) == "a.yaml:3 (sweep): lens.f_number = 0: give more"
    assert type(SettingsChanged("changed").with_file("a.dng")) is SettingsChanged


def test_an_error_keeps_the_file_at_fault_within_the_file_that_names_it():
    error = PhotositeError("no such file", file="psf.npz").with_file("a.yaml", 3)
    assert (error.file, error.line, error.within) == ("psf.npz", None, ("a.yaml:3",))
    assert str(error.inside("s_0001")) == "s_0001: a.yaml:3: psf.npz: no such file"


def test_a_part_stands_behind_the_file_and_before_what_is_known_already():
    assert str(PhotositeError("give more", key="lens").with_file("a.yaml", part="s_0001")) == "a.yaml: s_0001: lens: give more"
    error = PhotositeError("give more", file="b.yaml", part="s_0002").with_file("a.yaml", part="s_0001")
    assert str(error) == "a.yaml: s_0001: b.yaml: s_0002: give more" and error.file == "b.yaml"


@pytest.mark.parametrize("key", [None, "blur of the scene", "settings[0].stages", "wavelengths of a.exr"])
def test_only_a_dotted_key_can_be_looked_up_in_a_file(key):
    assert not PhotositeError("give more", key=key, value=0).names_a_value


def test_an_f_number_below_zero_carries_file_line_key_value_and_rule(shot_file):
    path = shot_file("f/4", "f/-2")
    error = caught(lambda: load_shot(path))
    assert facts(error) == (str(path), 4, "lens.f_number", "f/-2")
    path = shot_file("f_number: f/4", "f_number: -2")
    error = caught(lambda: load_shot(path))
    assert facts(error) == (str(path), 4, "lens.f_number", "f/-2")
    assert str(error) == f"{path}:4: lens.f_number = f/-2: {error.rule}" and error.rule


def test_a_missing_an_unknown_and_an_empty_key_are_named(shot_file):
    path = shot_file("  f_number: f/4\n", "")
    error = caught(lambda: load_shot(path))
    assert facts(error) == (str(path), 2, "lens.f_number", "None")
    assert str(error).startswith(f"{path}:2: lens.f_number is missing: ")
    error = caught(lambda: load_shot(shot_file("f_number:", "f_numbr:")))
    assert facts(error) == (str(path), 4, "lens.f_numbr", "None") and "did you mean `f_number`?" in error.rule
    error = caught(lambda: load_shot(shot_file("f/4", "")))
    assert facts(error) == (str(path), 4, "lens.f_number", "None")
    assert str(error).startswith(f"{path}:4: lens.f_number is empty: ")


def test_a_setting_is_its_own_place(shot_file):
    error = caught(lambda: load_shot(shot_file(), ["lens.focal_length=-2 mm"]))
    assert (error.file, error.line, error.key) == ("--set lens.focal_length=-2 mm", None, "lens.focal_length")
    error = caught(lambda: load_shot(shot_file(), ["lens"]))
    assert (error.file, error.key) == ("--set lens", None)
    error = caught(lambda: load_shot(shot_file(), {"lens.blades": None}))
    assert (error.file, error.key) == ("--set lens.blades=None", "lens.blades")
    assert str(error) == "--set lens.blades=None: lens.blades is not there, so nothing is removed; leave it out"


def test_broken_yaml_and_a_file_that_is_not_there_are_named(shot_file, tmp_path):
    error = caught(lambda: load_shot(shot_file("f_number: f/4", "f_number: [")))
    assert error.file == str(tmp_path / "shot.yaml") and error.line > 4 and error.rule.startswith("broken YAML: ")
    error = caught(lambda: load_shot(tmp_path / "none.yaml"))
    assert (error.file, error.line) == (tmp_path / "none.yaml", None) and error.rule.startswith("no such file")
    error = caught(lambda: load_camera("sony_a7s"))
    assert (error.file, error.key, error.value) == ("sony_a7s", "camera", "sony_a7s")


def test_a_value_of_a_sweep_carries_the_line_of_the_sweep(shot_file):
    path = shot_file(sweep={"vary": {"lens.f_number": ["f/2", "-3"]}})
    error = caught(lambda: load_sweep(path))
    assert error.file == str(path) and error.via == "sweep" and error.key == "lens.f_number"
    assert str(error).startswith(f"{path}:{error.line} (sweep): lens.f_number = ")
    assert "lens.f_number" in path.read_text().splitlines()[error.line - 1]


def test_a_later_step_is_placed_by_its_key(shot_file):
    path = shot_file()

    def later(**fields):
        with locate_errors(path):
            raise PhotositeError("give more", **fields)

    assert facts(caught(lambda: later(key="exposure.iso", value=100))) == (str(path), 6, "exposure.iso", "100")
    assert caught(lambda: later(key="exposure.iso")).file is None
    assert caught(lambda: later(key="exposure.iso", value=100, part="a frame")).file is None


def test_three_failed_points_end_with_the_fields_of_the_last(shot_file, tmp_path):
    path = shot_file(sweep={"vary": {"exposure.iso": [100, 200, 400]}})

    def take(shot, _folder):
        raise PhotositeError("too low", key="lens.f_number", value=f"f/{shot.lens.f_number:g}")

    rows = []
    error = caught(lambda: run_sweep(load_sweep(path), tmp_path / "out", take=take, report=rows.append))
    assert facts(error) == (str(path), 4, "lens.f_number", "f/4") and error.within == ("shot_0002",)
    assert str(error) == f"shot_0002: {path}:4: lens.f_number = f/4: too low (3 failures in a row: stopped)"
    assert [row.status for row in rows] == [f"failed: {path}:4: lens.f_number = f/4: too low"] * 3
    assert [row.error.line for row in pickle.loads(pickle.dumps(rows))] == [4] * 3


def test_an_output_that_cannot_be_written_is_told_of_the_option(shot_file, tmp_path):
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "out"
    error = caught(lambda: simulate_file(shot_file(), [], out, None, redo=False, truth=True))
    assert (error.file, error.key, error.value) == (None, "--out", out)
    assert str(error).startswith(f"--out {out}: cannot be written: ")


def test_a_wrong_collection_is_told_by_its_key(tmp_path):
    def config(text: str) -> DataSet:
        (tmp_path / "set.yaml").write_text(text, encoding="utf-8")
        return load_file(DataSet, tmp_path / "set.yaml")

    error = caught(lambda: config(DATA_SET.replace("[dead_leaves]", "[dead_leaves], count: 0")))
    assert facts(error) == (str(tmp_path / "set.yaml"), 3, "pictures.leaves.count", "0")

    def narrow(camera):
        require(False, "downscale", 0, "give 1 to 64")

    error = caught(lambda: open_collection({"photos": narrow}, "photos", load_camera("sony_a7s2")))
    assert (error.key, error.value) == ("pictures.photos.downscale", 0)
    assert str(error) == "pictures.photos.downscale = 0: give 1 to 64"

    def refuses(camera):
        raise PhotositeError("no camera will do")

    assert (
        str(caught(lambda: open_collection({"photos": refuses}, "photos", load_camera("sony_a7s2"))))
        == "pictures.photos: no camera will do"
    )


def test_a_source_of_a_data_set_carries_its_folder(tmp_path, device):
    error = caught(lambda: DataSetSamples(tmp_path).names())
    assert (error.file, error.key, error.value) == (None, "data_set", tmp_path)
    assert str(error).startswith(f"data_set = {tmp_path}: holds no data set: ") and str(error).endswith("--out` made")
    (tmp_path / "set.yaml").write_text(DATA_SET, encoding="utf-8")
    config = load_file(DataSet, tmp_path / "set.yaml", ["picture_weights={leaves: 0}", "on_problem=refuse"])
    error = caught(lambda: list(Generator(config, device).samples([0])))
    assert (error.key, error.value) == ("photographs", tmp_path / "pictures") and error.rule.startswith("no such folder")


def test_a_shot_of_a_data_set_carries_its_file_and_name(shot_file):
    path = shot_file("f_number: f/4", "f_number: f/4\n  vignetting: [{distance: 20 mm, diameter: 1 mm}]")
    error = caught(lambda: load_shot(path))
    source = Shots(path)
    source.__dict__["_names"] = ("shot",)
    again = caught(lambda: source.read("shot", None))
    assert (again.file, again.line, again.key, again.rule) == (error.file, error.line, error.key, error.rule)
    assert str(again) == f"{path}: shot: {error}"


def test_a_key_of_the_shot_file_becomes_that_of_the_data_set():
    def told(**fields):
        with renamed_key("spectral_cubes", "scene.spectral_cube"):
            raise PhotositeError("give more", **fields)

    assert str(caught(lambda: told(key="scene.spectral_cube", value="a.exr"))) == "spectral_cubes = a.exr: give more"
    assert str(caught(lambda: told(key="scene.wavelengths", value="a.txt"))) == "scene.wavelengths = a.txt: give more"


# What a whole text may be given to: it is printed, or kept for people.
KEEPERS = ("print", "tell", "echo", "escape", "append", "setdefault", "Problem", "PhotositeError")
# Where the text is made, and where it is printed.
# Where text is made: of lines on a terminal, of records of failed points on a disk, of what a browser is told.
EDGE = ("simulator/errors.py", "simulator/command_line/main.py")
EDGE += ("simulator/studies/study_point.py", "simulator/studies/study_run.py", "simulator/explore/server.py")


def readings(code: str) -> list[int]:
    """Lines that look into the text of a PhotositeError, or edit it."""
    found, tree = set(), ast.parse(code)
    for scope in (tree, *(node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))):
        nodes = list(_inside(scope))
        errors = _error_names(nodes)
        texts = _text_names(nodes, errors)
        found |= {node.lineno for node in nodes if _reads(node, errors, texts)}
    return sorted(found)


def _inside(scope: ast.AST) -> Iterator[ast.AST]:
    """Nodes of a module or function; names mean something else in the functions of a module."""
    for node in ast.iter_child_nodes(scope):
        if not isinstance(node, ast.FunctionDef):
            yield node
            yield from _inside(node)


def _names_the_class(node: ast.AST | None) -> bool:
    return node is not None and any(getattr(each, "id", None) == "PhotositeError" for each in ast.walk(node))


def _error_names(nodes: list[ast.AST]) -> set[str]:
    """Names that hold an error: caught, given as an argument, or another name of one of these."""
    names = set()
    for node in nodes:
        if isinstance(node, ast.ExceptHandler) and node.name and _names_the_class(node.type):
            names.add(node.name)
        if isinstance(node, ast.arg) and _names_the_class(node.annotation):
            names.add(node.arg)
    for node in nodes:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Name) and node.value.id in names:
            names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return names


def _is_text(node: ast.AST, errors: set[str], texts: set[str] = frozenset()) -> bool:
    """Whether an expression is the text of an error, alone or with words around it."""
    if isinstance(node, ast.Name):
        return node.id in texts
    if isinstance(node, ast.Call) and getattr(node.func, "id", None) in ("str", "repr", "format"):
        return any(isinstance(argument, ast.Name) and argument.id in errors for argument in node.args)
    if isinstance(node, ast.JoinedStr):
        return any(isinstance(part, ast.FormattedValue) and getattr(part.value, "id", None) in errors for part in node.values)
    return isinstance(node, ast.Attribute) and node.attr == "args" and getattr(node.value, "id", None) in errors


def _text_names(nodes: list[ast.AST], errors: set[str]) -> set[str]:
    texts = set()
    for node in nodes:
        if isinstance(node, ast.Assign) and _is_text(node.value, errors):
            texts |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return texts


def _reads(node: ast.AST, errors: set[str], texts: set[str]) -> bool:
    def is_text(each: ast.AST) -> bool:
        return _is_text(each, errors, texts)

    if isinstance(node, ast.Attribute):
        return is_text(node.value) or _is_text(node, errors)
    if isinstance(node, ast.Subscript):
        return is_text(node.value)
    if isinstance(node, ast.Compare):
        return any(map(is_text, (node.left, *node.comparators)))
    if isinstance(node, ast.Call):
        called = getattr(node.func, "attr", getattr(node.func, "id", None))
        return called not in KEEPERS and any(map(is_text, node.args))
    return False


CAUGHT = "try:\n    act()\nexcept (OSError, PhotositeError) as error:\n    "


@pytest.mark.parametrize(
    "line",
    [
        "told = str(error).replace('a', 'b')",
        "told = str(error)[3:]",
        "told = f'{error}'.partition(' = ')",
        "told = 'lens' in str(error)",
        "told = re.match('a', str(error))",
        "text = str(error); told = text.removeprefix('a')",
        "other = error; told = str(other) == 'a'",
        "told = error.args[0]",
        "told = key_of(str(error))",
    ],
)
def test_a_look_into_a_message_is_found(line):
    assert readings(CAUGHT + line) == [4]
    assert readings(f"def told(error: PhotositeError):\n    {line}") == [2]


@pytest.mark.parametrize(
    "line", ["print(str(error))", "raise error.replace(key='a')", "print(f'{error}; go on')", "say(error.rule)"]
)
def test_printing_and_keeping_a_message_is_none(line):
    assert readings(CAUGHT + line) == []
    assert readings(f"{CAUGHT.replace('PhotositeError', 'ValueError')}told = str(error).split()") == []


def test_no_program_reads_a_message():
    found = {}
    for folder in ("simulator", "data_gen", "examples", "benchmarks", "docs"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            name = file.relative_to(ROOT).as_posix()
            if name not in EDGE and (lines := readings(file.read_text(encoding="utf-8"))):
                found[name] = lines
    assert found == {}


@pytest.mark.parametrize(
    ("raised", "told"),
    [
        (KeyError("a"), "cannot be read ('a')"),
        (ValueError(), "cannot be read (ValueError)"),
        (OSError(5, "Input/output error"), "cannot be read (Input/output error)"),
        (UnicodeDecodeError("utf-8", b"\xff", 0, 1, "invalid"), "cannot be read (text in it is damaged)"),
        (UnicodeEncodeError("utf-8", "\udcff", 0, 1, "invalid"), "cannot be read (its path is no UTF-8 text: rename it)"),
        (RecursionError(), "cannot be read (nested too deeply)"),
        (RuntimeError("one\ntwo\x1b"), "cannot be read (one)"),
        (AssertionError("\x1b[2J"), r"cannot be read (\x1b[2J)"),
    ],
)
@pytest.mark.parametrize(("key", "start"), [(None, "a.exr: "), ("scene.image", "scene.image = a.exr: ")])
def test_what_a_library_raises_while_it_reads_names_file_and_fix(raised, told, key, start):
    with pytest.raises(PhotositeError) as found, reading("a.exr", "export it again", key=key):
        raise raised
    assert str(found.value) == f"{start}{told}; export it again" and found.value.__cause__ is raised


def test_an_array_larger_than_the_memory_is_told_from_damage():
    with pytest.raises(PhotositeError, match=r"^a\.npy: does not fit into memory \(8 TiB\); scale it down"):
        with reading("a.npy", "export it again"):
            raise MemoryError("8 TiB")


@pytest.mark.parametrize("raised", [PhotositeError("no", key="a", value=1), KeyboardInterrupt(), SystemExit(2)])
def test_what_is_no_failure_of_a_library_passes_the_door(raised):
    with pytest.raises(type(raised)) as found, reading("a.exr", "export it again"):
        raise raised
    assert found.value is raised


def test_a_message_steers_no_terminal():
    error = PhotositeError("no such channel\x1b[2J;\nuse é", file="\udcff.exr")
    assert str(error) == "\\udcff.exr: no such channel\\x1b[2J;\nuse é"


READERS = {f"{name}.load" for name in ("np", "numpy")} | {
    "rawpy.imread",
    "json.loads",
    "yaml.compose",
    "ElementTree.fromstring",
}
READERS |= {f"{name}.ImageInput.open" for name in ("oiio", "OpenImageIO")}
BEHIND_THE_DOOR = ("data_gen/storage/writers/", "data_gen/samples/record.py")  # data_gen/storage/reading.py calls them in it


def test_whatever_reads_with_a_library_does_it_inside_the_door():
    """Calls of a library's function that reads stand in modules that use `reading`."""
    found = []
    for folder in ("simulator", "data_gen"):
        for file in sorted((ROOT / folder).rglob("*.py")):
            text, name = file.read_text(encoding="utf-8"), file.relative_to(ROOT).as_posix()
            calls = {ast.unparse(node.func) for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)}
            if calls & READERS and "reading" not in calls and not name.startswith(BEHIND_THE_DOOR):
                found.append(name)
    assert found == []


def test_a_path_that_names_no_file_says_why(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    found = {"none": "no such file", ".": "is a folder, not a file", "pipe": "is no plain file"}
    for name, why in found.items():
        with pytest.raises(PhotositeError) as caught:
            check_file(tmp_path / name)
        assert str(caught.value) == f"{tmp_path / name}: {why}; check the path"
        with pytest.raises(PhotositeError) as caught:
            check_file(tmp_path / name, "lens.psf")
        assert str(caught.value) == f"lens.psf = {tmp_path / name}: {why}; check the path"
    (tmp_path / "file").touch()
    check_file(tmp_path / "file")
