"""Pages of stages and effects: one for each, all of one shape, with examples that load and links to code that is there."""

import importlib
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

from simulator.config import load_shot
from simulator.pipeline.planner import plan
from simulator.sensor.stages.registry import FUSED

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(
    page.relative_to(DOCS).with_suffix("").as_posix() for name in ("stages", "effects") for page in DOCS.glob(f"{name}/*.md")
)
HEADINGS = ["Formula", "In a shot file", "Cost", "How exact", "Code"]
GREY = "scene: {image: grey.npy, encoding: linear, luminance: 120 cd/m^2, depth: 2 m}"

pages = pytest.mark.parametrize("page", PAGES)


@pytest.fixture(scope="module")
def make_effects():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(DOCS))
        yield importlib.import_module("make_effects")


def text_of(page: str) -> str:
    return (DOCS / f"{page}.md").read_text(encoding="utf-8")


def blocks_of(page: str) -> list[str]:
    return re.findall(r"^```yaml\n(.*?)^```$", text_of(page), re.MULTILINE | re.DOTALL)


def test_every_stage_has_a_page_with_links_to_its_code():
    for stem in FUSED:
        assert {f"kernels/{stem}.h", f"simulator/sensor/stages/{stem}.py", f"tests/sensor/stages/test_{stem}.py"} <= {
            link.removeprefix("../../") for link in re.findall(r"\]\(([^)]+)\)", text_of(f"stages/{stem}"))
        }


@pages
def test_a_page_has_the_shape_of_all(page):
    """A paragraph for newcomers, a picture with its caption, then the parts in order; each part says something."""
    text = text_of(page)
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == HEADINGS
    title, words, picture, caption, *_ = text.split("\n\n")
    assert title.startswith("# ") and len(words.split()) > 15 and "`" not in words
    assert f"](../images/{page}.jpg)" in picture and re.fullmatch(r"\*[^*]+\.\*", caption)
    parts = dict(zip(HEADINGS, re.split(r"^## .*$", text, flags=re.MULTILINE)[1:], strict=True))
    assert "Source" in parts["Formula"] and "python -m pytest" in parts["How exact"]
    assert len(re.findall(r"^- (?:kernel|stage|module|test): ", parts["Code"], re.MULTILINE)) >= 3


def test_each_page_has_a_picture_that_the_script_takes(make_effects):
    assert sorted(make_effects.PICTURES) == PAGES
    assert [page for page in PAGES if not (DOCS / "images" / f"{page}.jpg").is_file()] == []
    assert {picture.scene for picture in make_effects.PICTURES.values()} == set(make_effects.SCENES)


@pages
def test_examples_in_yaml_load_and_can_be_planned(page, make_effects, tmp_path):
    make_effects.write_files(tmp_path)
    np.save(tmp_path / "grey.npy", np.full((342, 512), 0.5, np.float32))
    blocks = blocks_of(page)
    assert blocks
    for block in blocks:
        file = tmp_path / "shot.yaml"
        file.write_text(make_effects.shot_text(block, scene=GREY), encoding="utf-8")
        assert plan(load_shot(file)).passes


def test_commands_with_settings_load():
    """The shots of `photosite explain NAME --set ...`, once each."""
    found = {
        span
        for page in PAGES
        for span in re.findall(r"`(photosite (?:explain|simulate) [^`]+)`", text_of(page))
        if "--set" in span
    }
    assert len(found) > 20
    for span in sorted(found):
        words = shlex.split(span)
        settings = [word for before, word in zip(words, words[1:], strict=False) if before == "--set"]
        assert load_shot(words[2], settings).camera.model, span
