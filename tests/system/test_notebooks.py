"""The notebooks of the book run as they stand, and print what they are committed with."""

import importlib
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))
LARGEST_BYTES = 300_000
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?")


@pytest.fixture
def make_notebooks(monkeypatch):
    for package in ("nbclient", "ipykernel", "matplotlib"):
        pytest.importorskip(package, reason="notebooks are executed by nbclient and ipykernel, and draw with matplotlib")
    monkeypatch.syspath_prepend(ROOT / "docs")
    return importlib.import_module("make_notebooks")


def same_text(one: str, other: str) -> bool:
    """Whether two texts differ in nothing but numbers, and those by no more than one unit of the last digit written."""
    if NUMBER.sub("#", one) != NUMBER.sub("#", other):
        return False
    pairs = zip(NUMBER.findall(one), NUMBER.findall(other), strict=True)
    return all(abs(float(a) - float(b)) <= 1.001 * 10.0 ** -len(a.partition(".")[2]) for a, b in pairs)


def test_texts_are_compared_to_the_last_digit():
    assert same_text("K 1.529 DN, 3 of 4", "K 1.530 DN, 3 of 4")
    assert not same_text("K 1.529 DN", "K 1.531 DN") and not same_text("K 1.529 DN", "K 1.529 e-")


def test_there_are_notebooks():
    assert len(NOTEBOOKS) >= 2


@pytest.mark.slow
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_what_it_is_committed_with(path, make_notebooks):
    committed = make_notebooks.nbformat.read(path, as_version=4)
    found, wanted = make_notebooks.printed(make_notebooks.executed(path)), make_notebooks.printed(committed)
    assert any(wanted) and len(found) == len(wanted)
    for new, old in zip(found, wanted, strict=True):
        assert same_text(new, old), f"committed:\n{old}\nprinted:\n{new}\nrun `make notebooks` and look"


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_small_and_holds_no_path_of_a_machine(path, make_notebooks):
    text = path.read_text(encoding="utf-8")
    assert len(text.encode()) < LARGEST_BYTES and not re.search(r"/(?:home|root|tmp|work)/", text)
    notebook = make_notebooks.nbformat.read(path, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert not [one for cell in code for one in cell.outputs if one.output_type == "error" or one.get("name") == "stderr"]
    drawn = [cell for cell in code if any("image/png" in one.get("data", {}) for one in cell.outputs)]
    assert all(cell.metadata["mystnb"]["image"]["alt"] for cell in drawn)
