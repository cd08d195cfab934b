"""The script of the gallery: each picture of a topic has a title, and the index page shows every topic."""

import importlib
from pathlib import Path

import pytest

from data_gen.sources.gallery_scenes import TOPICS
from simulator.color.color_tables import CONFIGS
from simulator.config.document import parse_document

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture
def make_gallery(monkeypatch):
    pytest.importorskip("matplotlib", reason="the demo extra matplotlib is not installed")
    monkeypatch.syspath_prepend(str(DOCS))
    return importlib.import_module("make_gallery")


def test_each_point_of_a_topic_has_a_title(make_gallery):
    assert set(make_gallery.TITLES) == set(TOPICS) and set(make_gallery.DETAILS) < set(TOPICS)
    for name, titles in make_gallery.TITLES.items():
        path = CONFIGS / "shots" / f"{name}.yaml"
        sweep = parse_document(path.read_text(encoding="utf-8"), path.name, path.parent, is_ours=True).data.get("sweep")
        lengths = {1} if sweep is None else {len(values) for values in sweep["vary"].values()}
        assert lengths == {len(titles)}


def test_the_index_page_shows_every_topic_with_its_commands(make_gallery):
    page = make_gallery.index_page(list(TOPICS))
    for name in TOPICS:
        assert f'<h2 id="{name}">' in page and f'<img src="{name}.jpg"' in page
        assert f"photosite simulate gallery/{name}.yaml --out gallery" in page
    assert "`" not in page and "](" not in page


def test_an_unknown_topic_is_named(make_gallery, monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["make_gallery.py", "selfie"])
    with pytest.raises(SystemExit):
        make_gallery.main()
    assert "no topic selfie; give some of bare_sensor_pinhole_lens" in capsys.readouterr().err
