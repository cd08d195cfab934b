"""The house stays a house: imports run one way, and every stage has its header, module, test and line."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

from simulator import homes_of
from simulator.device.kernel_source import KERNELS, kernel_source
from simulator.sensor.kernel.kernel_program import stage_order
from simulator.sensor.stages.registry import FUSED

ROOT = Path(__file__).parents[2]
TESTS = ROOT / "tests"
HOUSES = ("simulator", "data_gen")

# What stands in a folder, from top to bottom: each may import what stands below it. A folder without a line here has no
# folders inside, and its files may import each other, though not in a circle.
ORDER = {
    "": ("data_gen", "simulator"),
    "simulator": (
        "__main__",
        "command_line",
        "explore",
        "studies",
        "displays",
        "measurement",
        "config",
        "pipeline",
        "raw",
        "optics",
        "exposure",
        "scene",
        "sensor",
        "color",
        "device",
        "progress",
        "atomic_files",
        "units",
        "displayed",
        "errors",
        "__init__",
    ),
    "simulator/studies": (
        "report",
        "study_run",
        "study_estimate",
        "study_result",
        "study_table",
        "study_point",
        "study_preview",
        "study_folder",
        "cluster",
        "sweep_runner",
        "resimulation",
    ),
    "simulator/measurement": (
        "curves",
        "quantities",
        "shutter_check",
        "emva1288",
        "noise_check",
        "calibration",
        "report",
        "statistics",
    ),
    "simulator/pipeline": (
        "simulate",
        "time_budget",
        "device_rates",
        "execution",
        "frame_metadata",
        "frame_strips",
        "motion_truth",
        "truth_maps",
        "explain",
        "light_reuse",
        "planner",
        "allotment",
        "metered_shot",
        "light_cache",
        "plan_steps",
        "psf_steps",
        "time_steps",
        "step",
        "passes",
        "psf_passes",
        "planned_pass",
        "error_budget",
        "stopwatch",
        "input_files",
        "scene_loading",
        "time_fit",
        "motion_span",
        "shot",
    ),
    "simulator/raw": (
        "save",
        "preview",
        "development",
        "truth_exr",
        "dng",
        "image_files",
        "plain_exr",
        "raw_reader",
        "raw_image",
        "late_field",
        "white_balance",
        "filter_pattern",
        "raw_format",
        "canonical_json",
        "disk_arrays",
        "software",
    ),
    "simulator/optics": (
        "passes",
        "optics_planning",
        "motion_planning",
        "path_planning",
        "lamp_planning",
        "kernel_planning",
        "blur_planning",
        "optics_plan",
        "ray_reference",
        "psf",
        "defocus",
        "veiling_glare",
        "geometry",
        "lens",
        "pupil",
        "error_term",
    ),
    "simulator/sensor": (
        "frame_stack",
        "hdr_passes",
        "hdr_variance",
        "iso_speed",
        "hdr_plan",
        "readout",
        "sensor_plan",
        "code_variance",
        "kernel",
        "camera",
        "stages",
        "seeds",
    ),
    "data_gen": (
        "__main__",
        "command_line",
        "dataset_command",
        "torch",
        "run",
        "report",
        "generate",
        "moving_frames",
        "recipe",
        "sources",
        "storage",
        "samples",
    ),
    "simulator/device": ("programs_ahead", "device", "huge_pages", "kernel_source", "threads"),
    "data_gen/storage": ("reading", "manifest", "shards", "summary", "writers"),
}
MOST_ARGUMENTS = 12  # of a kernel; more go into a struct
# Packages that only these rooms or files may import.
ONLY = {
    "colour": ("simulator/color/colour_science",),
    "pyopencl": ("simulator/device/device",),
    "yaml": ("simulator/config",),
    "rawpy": ("simulator/raw",),
    "typer": ("simulator/command_line", "data_gen"),
    "torch": ("data_gen/torch",),
}

SOURCES = [path for house in HOUSES for path in sorted((ROOT / house).rglob("*.py"))]


def place(path: Path) -> str:
    """Path of a source file below the top of the tree, without its suffix."""
    return path.relative_to(ROOT).with_suffix("").as_posix()


PLACES = {place(path): path for path in SOURCES}


def file_of(dotted: str) -> str | None:
    """Place of a module or of a package's __init__; None where there is none."""
    name = dotted.replace(".", "/")
    return next((found for found in (name, f"{name}/__init__") if found in PLACES), None)


HOMES = homes_of(str(ROOT / "simulator" / "__init__.py"))  # of names that are imported when they are first used


@cache
def parsed(path: Path) -> ast.Module:
    """Syntax tree of a file."""
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def imports(path: Path) -> set[str]:
    """Dotted names of everything a file imports, also inside functions: modules, and names of modules."""
    found = set()
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert not node.level, f"{place(path)}:{node.lineno}: a relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def imported_files(path: Path) -> set[str]:
    """Places of our files that a file imports."""
    found = set()
    for name in imports(path):
        module, _, last = name.rpartition(".")
        if module == "simulator" and last in HOMES:
            module, name = HOMES[last], HOMES[last]
        found.add(file_of(name) or file_of(module))
    return found - {None, place(path)}


@pytest.fixture(scope="module")
def arrows() -> dict[str, set[str]]:
    """Places of our files that each file imports."""
    return {name: imported_files(path) for name, path in PLACES.items()}


def rank(folder: str, name: str) -> int:
    """Where a file or folder stands in a folder's order, 0 on top; a package's __init__ stands on top of what it holds."""
    order = ORDER[folder]
    return -1 if name == "__init__" and name not in order else order.index(name)


def runs_up(one: str, other: str) -> bool:
    """Whether an import of `other` by `one` runs upwards in the folder where their ways part."""
    own, its = one.split("/"), other.split("/")
    shared = next(index for index, (a, b) in enumerate(zip(own, its, strict=False)) if a != b)
    folder = "/".join(own[:shared])
    return folder in ORDER and rank(folder, its[shared]) <= rank(folder, own[shared])


def test_imports_run_one_way(arrows):
    assert [(name, other) for name in sorted(PLACES) for other in sorted(arrows[name]) if runs_up(name, other)] == []


def test_no_file_imports_itself_through_others(arrows):
    left = {name: set(others) for name, others in arrows.items()}
    while ends := {name for name, others in left.items() if not others}:
        left = {name: others - ends for name, others in left.items() if name not in ends}
    assert sorted(left) == []  # circles, and what stands above them


def test_packages_stay_in_their_rooms():
    rooms = [(name, one, ONLY.get(one.partition(".")[0], (name,))) for name, path in PLACES.items() for one in imports(path)]
    astray = [
        f"{name}: {imported} belongs to {allowed}"
        for name, imported, allowed in rooms
        if not any(f"{name}/".startswith(f"{room}/") for room in allowed)
    ]
    assert astray == []


def test_only_one_module_needs_pytorch_and_nobody_imports_it(arrows):
    assert [name for name, others in arrows.items() if "data_gen/torch" in others] == []
    assert [name for name, path in PLACES.items() if any(n.partition(".")[0] == "torch" for n in imports(path))] in (
        [],
        ["data_gen/torch"],
    )


def inside(folder: str) -> set[str]:
    """Names of the files and folders of Python in a folder."""
    start = f"{folder}/" if folder else ""
    return {name.removeprefix(start).split("/")[0] for name in PLACES if name.startswith(start)}


def test_every_room_and_file_has_its_place():
    for folder, order in ORDER.items():
        if folder.split("/")[0] in ("", *HOUSES):
            expected = (set(order) & set(HOUSES)) if folder == "" else set(order) | {"__init__"}
            assert inside(folder) == expected, folder
    parents = {"/".join(name.split("/")[:-2]) for name in PLACES if name.count("/") > 1}
    assert parents <= set(ORDER), "a folder that holds folders needs an order"


def test_the_simulator_has_few_doors():
    names = inside("simulator") - {"__init__", "__main__"}
    folders = {name for name in names if (ROOT / "simulator" / name).is_dir()}
    assert len(folders) <= 14
    assert len(names - folders) <= 5


@pytest.mark.parametrize("name", sorted(name for name in PLACES if name.endswith("/__init__") and name != "simulator/__init__"))
def test_a_package_only_hands_on(name):
    for node in parsed(PLACES[name]).body:
        docstring = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
        names = isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__"
        lazy = isinstance(node, ast.Assign) and ast.unparse(node.value) == "lazy_names(__name__, __file__)"
        assert docstring or names or lazy or isinstance(node, ast.Import | ast.ImportFrom), f"{name}:{node.lineno}"


def has_one_test(stem: str) -> bool:
    return len(list(TESTS.rglob(f"test_{stem}.py"))) == 1


@pytest.mark.parametrize("stem", sorted(FUSED))
def test_a_stage_has_header_module_test_and_line(stem):
    assert (KERNELS / f"{stem}.h").is_file()
    assert has_one_test(stem)
    assert FUSED[stem].__module__ == f"simulator.sensor.stages.{stem}"
    assert stem in stage_order()
    page = (KERNELS / "sensor.cl").read_text(encoding="utf-8")
    assert f'#include "{stem}.h"' in page


def test_the_truth_passes_through_the_stages_that_change_the_mean_in_their_order():
    page = (KERNELS / "truth.cl").read_text(encoding="utf-8")
    called = re.findall(r"^ *if \((\w+)\)", page, re.MULTILINE)
    assert called == [stem.upper() for stem in stage_order() if FUSED[stem].changes_mean]


def test_every_stream_of_random_words_stands_in_the_table_with_its_keys():
    """A block of philox() takes counter and key from its arguments; block_of() from its own."""
    pages = [path.read_text(encoding="utf-8") for path in sorted(KERNELS.glob("*.[ch]*"))]
    told = set(
        re.findall(r"^//   (\w+) +(frame|body) ", (KERNELS / "random_numbers.h").read_text(encoding="utf-8"), re.MULTILINE)
    )
    drawn = set(re.findall(r"block_of\([^()]*?(\w*STREAM\w*), (frame|body)_seed", "\n".join(pages)))
    for page in pages:
        for stream in re.findall(r"const struct words counter = \{[^}]*?(\w+_STREAM)\}", page):
            drawn |= {(stream, key) for key in re.findall(r"philox\(counter, (frame|body)_seed", page)}
    assert drawn == told


def compared_with_a_literal(path: Path) -> list[int]:
    """Lines that compare a stage's stem with a text or look it up among texts."""
    found = []
    for node in ast.walk(parsed(path)):
        sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
        if any(isinstance(side, ast.Attribute) and side.attr == "stem" for side in sides):
            texts = (ast.Constant, ast.Tuple, ast.List, ast.Set)
            found += [node.lineno for side in sides if isinstance(side, texts)]
    return found


def test_what_a_stage_is_like_is_declared_by_the_stage_not_asked_by_its_name():
    elsewhere = [name for name in PLACES if not name.startswith("simulator/sensor/")]
    assert [name for name in elsewhere if compared_with_a_literal(PLACES[name])] == []


@pytest.mark.parametrize("path", sorted(KERNELS.glob("*.cl")), ids=lambda path: path.name)
def test_a_pass_has_a_test_and_says_what_its_buffers_are(path):
    assert has_one_test(path.stem)
    text = path.read_text(encoding="utf-8")
    header = "".join(line for line in text.splitlines(keepends=True) if line.startswith("//"))
    for arguments in re.findall(r"kernel void \w+\(([^)]*)\)", text):
        assert arguments.count(",") < MOST_ARGUMENTS, f"{path.name}: {arguments}"
        for name in re.findall(r"\*(?:restrict )?(\w+)", arguments):
            assert re.search(rf"\b{name}\b", header), f"{path.name}: the comment does not say what {name} is"
        for struct in re.findall(r"\bstruct (\w+)", arguments):
            body = re.search(rf"\bstruct {struct} \{{(.*?)\}};", kernel_source(path.name), re.DOTALL)[1]
            for line in filter(None, map(str.strip, body.splitlines())):
                assert re.search(r"; +// ", line), f"{path.name}: no comment says what this field of {struct} is: {line}"


@pytest.mark.parametrize("path", sorted(KERNELS.glob("*.[ch]*")), ids=lambda path: path.name)
def test_kernels_are_plain_opencl_c(path):
    text = path.read_text(encoding="utf-8")
    for word in ("native_", "half_", "cl_khr", "printf", "float4", "double", "fast-relaxed"):
        assert word not in text, f"{path.name} uses {word}"
    assert len(text.splitlines()) <= 110


def test_pyproject_sets_one_linter_and_two_type_checkers_that_look_at_all_code():
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    assert set(tools) == {"ruff", "mypy", "pyright"}
    assert tools["mypy"]["files"] == tools["pyright"]["include"]
    assert {"photosite", *HOUSES} <= set(tools["mypy"]["files"])
    assert not any(part.get("ignore_errors") for part in tools["mypy"]["overrides"])
    assert tools["pyright"]["ignore"] == ["data_gen/torch.py"]  # PyTorch is an extra


@pytest.mark.parametrize("path", sorted((ROOT / "photosite").glob("*.py")), ids=lambda path: path.name)
def test_the_public_face_only_names_what_others_hold(path):
    assert {name.split(".")[0] for name in imports(path)} <= {"simulator", "data_gen"}
