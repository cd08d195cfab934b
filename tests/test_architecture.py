"""The house stays a house: imports run one way, and every stage has its header, module, test and line."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

from simulator.device import KERNELS
from simulator.fused import stage_order
from simulator.sensor import FUSED

ROOT = Path(__file__).parent.parent
TESTS = ROOT / "tests"

# Left may not import right. A package stands for all its modules; the facade simulator/__init__.py imports nothing at the top.
ORDER = [
    {"errors", "units", "colour_data", "progress"},
    {"raw_format", "stage", "input_files", "step"},
    {"device", "stopwatch"},
    {"spectra", "color", "color_correction", "lens_aberrations", "distortion"},
    {"sensor", "exposure", "scene", "fused", "tiles", "layout", "code_variance"},
    {"sensing"},
    {"noise_free", "sensor_plan"},
    {"capture", "readout"},
    {"lens", "projection", "camera_planes", "psf_convolution", "interleaved_columns"},
    {"defocus", "point_spread", "veiling_glare"},
    {"optics_plan"},
    {"blur", "tile_plan"},
    {"spreading"},
    {"shot", "frame"},
    {"psf_steps", "plan_steps", "passes"},
    {"planner"},
    {"grey_patch", "noise_budget", "sensitivity", "truth_maps", "frame_metadata"},
    {"pipeline"},
    {"config", "raw", "raw_file", "white_balance", "development", "resimulation"},
    {"measurement"},
    {"validation"},
    {"calibration"},
    {"command_line"},
    {"data_gen"},
]
ONLY = {
    "colour": {"colour_data"},
    "pyopencl": {"device"},
    "yaml": {"config"},
    "rawpy": {"development", "raw_file", "white_balance"},
    "typer": {"command_line", "data_gen"},
    "torch": {"data_gen"},
}


def room(path: Path) -> str:
    """Name in ORDER of a source file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return "data_gen" if parts[0] == "data_gen" else parts[1]


def imports(path: Path) -> set[str]:
    """Dotted names of everything a file imports, also inside functions."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return found


SOURCES = [p for folder in ("simulator", "data_gen") for p in sorted((ROOT / folder).rglob("*.py"))]
ROOMS = [path for path in SOURCES if path not in (ROOT / "simulator/__init__.py", ROOT / "simulator/__main__.py")]


def level(name: str) -> int:
    return next(index for index, rooms in enumerate(ORDER) if name in rooms)


@pytest.mark.parametrize("path", ROOMS, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_run_one_way(path):
    own = level(room(path))
    for name in imports(path):
        parts = name.split(".")
        if parts[0] == "data_gen":
            assert own == level("data_gen"), f"{name} lies to the right"
        if parts[0] == "simulator" and len(parts) > 1 and parts[1] in set().union(*ORDER):
            assert level(parts[1]) <= own, f"{name} lies to the right"
        if parts[0] in ONLY:
            assert room(path) in ONLY[parts[0]], f"{name} belongs to {ONLY[parts[0]]}"


def test_only_one_module_needs_pytorch_and_nobody_imports_it():
    assert [path.name for path in ROOMS if {"torch", "data_gen.torch"} & imports(path)] == ["torch.py"]


def test_every_room_has_its_place():
    assert {room(path) for path in ROOMS} == set().union(*ORDER)


@pytest.mark.parametrize("stem", sorted(FUSED))
def test_a_stage_has_header_module_test_and_line(stem):
    assert (KERNELS / f"{stem}.h").is_file()
    assert (TESTS / f"test_{stem}.py").is_file()
    module = FUSED[stem].__module__.split(".")
    assert module[-1] == stem
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
    told = set(re.findall(r"^//   (\w+) +(frame|body) ", (KERNELS / "chance.h").read_text(encoding="utf-8"), re.MULTILINE))
    drawn = set(re.findall(r"block_of\([^()]*?(\w*STREAM\w*), (frame|body)_seed", "\n".join(pages)))
    for page in pages:
        for stream in re.findall(r"const struct words counter = \{[^}]*?(\w+_STREAM)\}", page):
            drawn |= {(stream, key) for key in re.findall(r"philox\(counter, (frame|body)_seed", page)}
    assert drawn == told


def compared_with_a_literal(path: Path) -> list[int]:
    """Lines that compare a stage's stem with a text or look it up among texts."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else []
        if any(isinstance(side, ast.Attribute) and side.attr == "stem" for side in sides):
            texts = (ast.Constant, ast.Tuple, ast.List, ast.Set)
            found += [node.lineno for side in sides if isinstance(side, texts)]
    return found


@pytest.mark.parametrize("path", [p for p in ROOMS if "sensor" not in p.parts], ids=lambda path: str(path.relative_to(ROOT)))
def test_what_a_stage_is_like_is_declared_by_the_stage_not_asked_by_its_name(path):
    assert not compared_with_a_literal(path)


@pytest.mark.parametrize("path", sorted(KERNELS.glob("*.cl")), ids=lambda path: path.name)
def test_a_pass_has_a_test_and_says_what_its_buffers_are(path):
    assert (TESTS / f"test_{path.stem}.py").is_file()
    text = path.read_text(encoding="utf-8")
    header = "".join(line for line in text.splitlines(keepends=True) if line.startswith("//"))
    for arguments in re.findall(r"kernel void \w+\(([^)]*)\)", text):
        for name in re.findall(r"\*(?:restrict )?(\w+)", arguments):
            assert re.search(rf"\b{name}\b", header), f"{path.name}: the comment does not say what {name} is"


@pytest.mark.parametrize("path", sorted(KERNELS.glob("*.[ch]*")), ids=lambda path: path.name)
def test_kernels_are_plain_opencl_c(path):
    text = path.read_text(encoding="utf-8")
    for word in ("native_", "half_", "cl_khr", "printf", "float4", "double", "fast-relaxed"):
        assert word not in text, f"{path.name} uses {word}"
    assert len(text.splitlines()) <= 110


def test_pyproject_sets_one_linter_and_two_type_checkers_that_look_at_the_same_code():
    tools = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]
    assert set(tools) == {"ruff", "mypy", "pyright"}
    assert tools["mypy"]["files"] == tools["pyright"]["include"]
    unchecked = next(part["module"] for part in tools["mypy"]["overrides"] if part.get("ignore_errors"))
    paths = [name.removesuffix(".*").replace(".", "/") for name in unchecked]
    assert [path.removesuffix(".py") for path in tools["pyright"]["ignore"]] == paths
    assert all((ROOT / path).is_dir() or (ROOT / f"{path}.py").is_file() for path in paths)


@pytest.mark.parametrize("path", sorted((ROOT / "photosite").glob("*.py")), ids=lambda path: path.name)
def test_the_public_face_only_names_what_others_hold(path):
    assert {name.split(".")[0] for name in imports(path)} <= {"simulator", "data_gen"}
