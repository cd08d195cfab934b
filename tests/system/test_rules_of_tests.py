"""Tests call production functions: none imports another test, reads a clock, or replaces or uses what is private."""

import ast
from collections.abc import Collection, Iterator
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parent.parent
FILES = sorted(TESTS.rglob("*.py"))
CLOCKS = {"perf_counter", "process_time", "monotonic", "thread_time", "time"}
CLOCKS |= {f"{name}_ns" for name in CLOCKS}
OWN = {"self", "cls"}
PUBLIC_ALL_THE_SAME = {"os._exit"}  # documented by Python


def imported_tests(tree: ast.AST) -> Iterator[str]:
    """Modules of tests and conftest that a file imports, also inside functions."""
    for node in ast.walk(tree):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module] if node.level == 0 else [node.module, *names]
        for name in names:
            if any(part == "conftest" or part.startswith("test_") for part in name.split(".")):
                yield name


def read_clocks(tree: ast.AST) -> Iterator[str]:
    """Calls of a clock."""
    imported = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.module == "time"
        for alias in node.names
        if alias.name in CLOCKS
    }
    for node in ast.walk(tree):
        if is_call_of(node, imported | CLOCKS) and ast.unparse(node.func) in imported | {f"time.{name}" for name in CLOCKS}:
            yield ast.unparse(node)


def private_names(tree: ast.AST) -> Iterator[str]:
    """Names with a leading underscore that a file takes from elsewhere, or replaces there."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names if is_private(alias.name))
        elif isinstance(node, ast.Attribute) and is_private(node.attr) and ast.unparse(node) not in PUBLIC_ALL_THE_SAME:
            if ast.unparse(node.value) not in OWN:
                yield ast.unparse(node)
        else:
            yield from (name for name in patched_attributes(node) if is_private(name.rpartition(".")[2]))


def patched_constants(tree: ast.AST) -> Iterator[str]:
    """Constants of modules that a file replaces, or entries of them; a tunable is an argument."""
    for node in ast.walk(tree):
        yield from (name for name in (*patched_attributes(node), *patched_mappings(node)) if name.rpartition(".")[2].isupper())


def patched_attributes(node: ast.AST) -> list[str]:
    """What `monkeypatch.setattr(module, "name", ...)` or `setattr("module.name", ...)` replaces."""
    if not is_call_of(node, ("setattr", "delattr", "patch")):
        return []
    return [part.value for part in node.args[:2] if isinstance(part, ast.Constant) and isinstance(part.value, str)][:1]


def patched_mappings(node: ast.AST) -> list[str]:
    """The mapping whose entry `monkeypatch.setitem` replaces."""
    return [ast.unparse(node.args[0])] if is_call_of(node, ("setitem", "delitem")) and node.args else []


def is_call_of(node: ast.AST, names: Collection[str]) -> bool:
    """Whether a node calls a function or method of one of these names."""
    called = node.func if isinstance(node, ast.Call) else None
    return isinstance(called, ast.Name) and called.id in names or isinstance(called, ast.Attribute) and called.attr in names


def is_private(name: str) -> bool:
    """Whether a name has one leading underscore, not two on either side as Python's own have."""
    return name.startswith("_") and not (name.startswith("__") and name.endswith("__"))


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("rule", "instead"),
    [
        (imported_tests, "what tests share stands in a module of its own"),
        (read_clocks, "assert what makes it quick, or count turns"),
        (private_names, "test through a public function"),
        (patched_constants, "give the function an argument"),
    ],
)
def test_files_of_tests_keep_the_rules(rule, instead):
    assert [f"{path.relative_to(TESTS)}: {found}" for path in FILES for found in rule(parsed(path))] == [], instead


@pytest.mark.parametrize(
    ("rule", "text"),
    [
        (imported_tests, "from conftest import device"),
        (imported_tests, "def f():\n    import test_errors"),
        (imported_tests, "from tests.optics.test_lens import lens"),
        (imported_tests, "from . import test_lens"),
        (read_clocks, "assert time.perf_counter() - start < 0.5"),
        (read_clocks, "from time import monotonic as now\nseconds = now() - start"),
        (private_names, "from simulator.raw.dng.writer import _raw_directory"),
        (private_names, "device._queue.finish()"),
        (private_names, "monkeypatch.setattr(dng, '_raw_directory', None)"),
        (private_names, "monkeypatch.setattr('simulator.raw.dng.writer._strip', None)"),
        (private_names, "monkeypatch.setitem(dng._KINDS, 'a', 1)"),
        (patched_constants, "monkeypatch.setattr('simulator.sensor.kernel.tiles.TILE_HEIGHT', 2)"),
        (patched_constants, "monkeypatch.setattr(tiles, 'TILE_HEIGHT', 2)"),
        (patched_constants, "monkeypatch.setitem(dng.CFA_COLOURS, 'RGGB', 2)"),
    ],
)
def test_what_breaks_a_rule_is_found(rule, text):
    assert len(list(rule(ast.parse(text)))) == 1


@pytest.mark.parametrize(
    "text",
    [
        "from simulator.errors import PhotositeError",
        "time.sleep(0.1)",
        "self._plane(0)",
        "module.__file__",
        "os._exit(0)",
        "monkeypatch.setattr(os, 'replace', refuse)",
        "monkeypatch.setattr('live.time.perf_counter', clock)",
        "monkeypatch.setenv('PHOTOSITE_DEBUG', '1')",
        "monkeypatch.setitem(sys.modules, 'matplotlib.figure', None)",
    ],
)
def test_what_keeps_the_rules_is_let_through(text):
    rules = (imported_tests, read_clocks, private_names, patched_constants)
    assert not [found for rule in rules for found in rule(ast.parse(text))]
