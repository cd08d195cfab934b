"""The pages name files, modules, commands and targets of make that exist, and their Python compiles."""

import ast
import re
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer

import data_gen.command_line  # adds `dataset` to the commands
from data_gen.recipe.dataset_config import load_data_set
from photosite import load_shot

ROOT = Path(__file__).parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))]
MADE = {line.strip("/") for line in (ROOT / ".gitignore").read_text(encoding="utf-8").splitlines()}  # such as gallery/
FOLDERS = [path.name for path in ROOT.iterdir() if path.is_dir() and not path.name.startswith(".") and path.name not in MADE]
HOUSES = ("simulator", "data_gen", "photosite")
FENCED = re.compile(r"^ *```.*?^ *```$", re.MULTILINE | re.DOTALL)  # a block of code
MADE_UP = {"stray_light", "NAME"}  # by CONTRIBUTING, which shows how to add them

pages = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def spans_of(page: Path) -> list[str]:
    """Return what stands between backticks in the text of a page, blocks left out."""
    return re.findall(r"`([^`]+)`", re.sub(FENCED, "", text_of(page)))


def commands_on(page: Path, program: str) -> list[list[str]]:
    """Return the words behind the name of a program, of each command in the text and the blocks of a page."""
    lines = [line for block in re.findall(FENCED, text_of(page)) for line in block.splitlines()]
    written = [line.partition("#")[0].split() for line in [*lines, *spans_of(page)]]
    return [words[1:] for words in written if len(words) > 1 and words[0] == program]


def is_made_up(name: str) -> bool:
    return any(word in name for word in MADE_UP)


def python_blocks(page: Path) -> list[str]:
    """Return the blocks of Python of a page, without those of CONTRIBUTING's list, which a test of its own carries out."""
    return re.findall(r"^```python\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


def names_of(file: Path) -> set[str]:
    """Return the names that a module defines or imports, and those of the stub beside it."""
    found = set()
    for source in filter(Path.is_file, (file, file.with_suffix(".pyi"))):
        for node in ast.parse(source.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                found.add(node.name)
            elif isinstance(node, ast.Import | ast.ImportFrom):
                found |= {alias.asname or alias.name for alias in node.names}
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                found |= {target.id for target in targets if isinstance(target, ast.Name)}
    return found


def has_name(dotted: str) -> bool:
    """Whether a dotted name is that of a folder, of a module, or of something in one, whose own attributes do not count."""
    place = ROOT
    for word in dotted.split("."):
        if (place / word).is_dir():
            place /= word
        elif (place / f"{word}.py").is_file():
            place = place / f"{word}.py"
        else:
            return word in names_of(place if place.is_file() else place / "__init__.py")
    return True


@pages
def test_paths_on_a_page_exist(page):
    words = [word for span in spans_of(page) for word in span.split()]
    paths = [word for word in words if re.fullmatch(r"[\w./*-]+", word) and word.split("/")[0] in FOLDERS and "/" in word]
    files = [word for word in words if re.fullmatch(r"\w+\.(py|cl|h)", word)]
    assert [path for path in paths if not is_made_up(path) and not list(ROOT.glob(path.rstrip("/")))] == []
    known = {path.name for folder in FOLDERS for suffix in ("py", "cl", "h") for path in (ROOT / folder).rglob(f"*.{suffix}")}
    assert [file for file in files if file not in known and not is_made_up(file)] == []


def anchors_of(page: Path) -> set[str]:
    """Return the anchors of a page: those that GitHub gives to headings, and those written as HTML."""
    headings = re.findall(r"^#+ (.*)$", text_of(page), re.MULTILINE)
    written = re.findall(r'<a (?:id|name)="([^"]+)"', text_of(page))
    return {*written, *(re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings)}


@pages
def test_links_on_a_page_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)\s]+)\)", text_of(page)):
        if not link.startswith("http"):
            path, _, anchor = link.partition("#")
            target = page.parent / path if path else page
            assert target.exists(), link
            assert not anchor or anchor in anchors_of(target), link


@pages
def test_dotted_names_on_a_page_exist(page):
    text = " ".join([*spans_of(page), *python_blocks(page)])
    names = re.findall(rf"(?<![\w./])(?:{'|'.join(HOUSES)})(?:\.[A-Za-z_]\w*)+", text)
    assert [name for name in names if not is_made_up(name) and not has_name(name)] == []


@pages
def test_python_on_a_page_compiles_and_imports_what_exists(page):
    for block in python_blocks(page):
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in HOUSES:
                assert [alias.name for alias in node.names if not has_name(f"{node.module}.{alias.name}")] == []


@pages
def test_commands_on_a_page_exist_with_their_options(page):
    for words in commands_on(page, "photosite"):
        command = typer.main.get_command(data_gen.command_line.app)
        names = iter(words)
        while hasattr(command, "commands") and (name := next(names, None)) is not None:
            if name.startswith("--"):
                break  # an option of the program itself
            assert name in command.commands, words
            command = command.commands[name]
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        assert [word for word in words if word.startswith("--") and word not in known] == [], words


@pages
def test_targets_of_make_on_a_page_exist(page):
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert [words[0] for words in commands_on(page, "make") if words[0] not in targets] == []


def test_the_scene_kind_of_the_page_on_extending_runs_as_written():
    """Its 40 bars over the width are counted in the truth of the window, which the example takes."""
    (code,) = python_blocks(ROOT / "docs" / "extending.md")
    names: dict[str, Any] = {}
    exec(compile(code, "docs/extending.md", "exec"), names)
    raw = names["raw"]
    green = raw.mean_electrons[::2, 1::2]
    column = 1800 + 1 + 2 * np.arange(green.shape[1]) + 0.5  # centres of the photosites
    wave = np.sin(2 * np.pi * 40 * column / 4240)  # 40 over the sensor's width
    assert raw.dn.shape == (64, 96)
    assert np.corrcoef(green.mean(axis=0), wave)[0, 1] > 0.999


def yaml_blocks(page: Path) -> list[str]:
    """Return the blocks of YAML of a page."""
    return re.findall(r"^```yaml\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


def has_keys(block: str, *keys: str) -> bool:
    """Whether a block of YAML has all of these keys at its top."""
    return all(re.search(rf"^{key}:", block, re.MULTILINE) for key in keys)


def test_shots_on_the_pages_load(tmp_path):
    """Blocks of YAML that hold a whole shot; their pictures are not read."""
    found = [
        (page, block) for page in PAGES for block in yaml_blocks(page) if has_keys(block, "scene", "lens", "exposure", "camera")
    ]
    assert {"README.md", "shot_file.md", "coming_from.md"} <= {page.name for page, _ in found}
    for number, (page, block) in enumerate(found):
        file = tmp_path / f"{page.stem}_{number}.yaml"
        file.write_text(block, encoding="utf-8")
        assert load_shot(str(file)).camera.model


def test_data_sets_on_the_pages_load(tmp_path):
    """Every block of the pages on data sets loads, each with what it lacks to be a whole file; pictures are not read."""
    lacking = {
        "count": "count: 50\n",
        "crop": "crop: [64, 64]\n",
        "noise": "noise: {cameras: {sony_a7s2: {}}}\n",
        "pictures": "pictures: {drawn: {procedural: [text], count: 2}}\n",
    }
    loaded = Counter()
    for page in PAGES:
        if page.name not in ("dataset.md", "clean_pictures.md"):
            continue
        for block in yaml_blocks(page):
            whole = block + "".join(line for key, line in lacking.items() if not has_keys(block, key))
            (tmp_path / "pairs.yaml").write_text(whole, encoding="utf-8")
            load_data_set(tmp_path / "pairs.yaml")
            loaded[page.name] += 1
    assert loaded == {"dataset.md": 4, "clean_pictures.md": 1}


def toctree_of(page: Path) -> list[str]:
    """Return the names of the pages in the tables of contents of a page, in order; lines are `name` or `Title <name>`."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [line.partition("<")[2].rstrip(">") or line for line in lines]


def linked_from(page: Path) -> set[Path]:
    """Return the pages that the text of a page links to."""
    links = re.findall(r"\]\(([^)\s]+\.md)(?:#[^)]*)?\)", text_of(page))
    return {(page.parent / link).resolve() for link in links if "://" not in link}


def test_every_page_stands_once_in_the_contents_of_the_book():
    docs = ROOT / "docs"
    pages = {
        page.relative_to(docs).with_suffix("").as_posix(): page for end in ("md", "ipynb") for page in docs.rglob(f"*.{end}")
    }
    listed = sorted(name for page in pages.values() if page.suffix == ".md" for name in toctree_of(page))
    assert listed == sorted(name for name in pages if name != "index")
    reached, ahead = set(), ["index"]
    while ahead:
        reached.add(name := ahead.pop())
        ahead += toctree_of(pages[name]) if pages[name].suffix == ".md" else []
    assert reached == {"index", *listed}


def test_every_page_is_reached_by_links_from_the_readme():
    copies = {ROOT / "docs" / "contributing.md", ROOT / "docs" / "changelog.md"}  # for the book, of files above it
    reached: set[Path] = set()
    ahead = {ROOT / "README.md"}
    while ahead:
        reached |= ahead
        ahead = {linked for page in ahead for linked in linked_from(page)} - reached
    assert sorted(page.name for page in {*(ROOT / "docs").rglob("*.md")} - copies - reached) == []


def tables_of(text: str) -> list[list[str]]:
    """Return the rows of each Markdown table outside blocks of code, its heading first, the line of dashes left out."""
    found = re.findall(r"(?:^ *\|.*\n?)+", re.sub(FENCED, "", text), re.MULTILINE)
    return [[row.strip() for row in table.splitlines() if not re.fullmatch(r"[|:\s-]+", row)] for table in found]


def rows_told_twice(text: str) -> list[str]:
    """Return the rows that a table has twice, or whose keys, in backticks in the first column, another row of it explains."""
    found = []
    for heading, *rows in tables_of(text):
        keys = [key for row in rows for key in re.findall(r"`([A-Za-z][^`]*)`", row.split("|")[1])]
        if heading.split("|")[1].strip() in ("key", "folder", "tag"):
            found += [key for key in dict.fromkeys(keys) if keys.count(key) > 1]
        found += [row for row in dict.fromkeys(rows) if rows.count(row) > 1]
    return found


@pages
def test_no_table_tells_a_row_twice(page):
    assert rows_told_twice(text_of(page)) == []


def test_rows_told_twice_are_found():
    table = "| key | meaning |\n|---|---|\n| `a`, `b` | one |\n| `c` | two |\n"
    assert rows_told_twice(table) == [] == rows_told_twice(f"{table}\n{table}")
    assert rows_told_twice(f"{table}| `c` | two |\n") == ["c", "| `c` | two |"]
    assert rows_told_twice(f"{table}| `b` | other |\n") == ["b"]
