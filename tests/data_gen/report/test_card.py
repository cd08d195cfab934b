"""A data card counts what is there, and its code reads the data set."""

import contextlib
import io
import json
import os
from collections import Counter

import numpy as np
import pytest
from helpers.toy_samples import toy_sample
from helpers.toy_shards import write_toy_folder

from data_gen.report.card import About, write_card
from data_gen.report.sheet import linear_picture
from data_gen.report.snippets import SNIPPETS, snippet
from data_gen.samples.packing import pack
from data_gen.storage.manifest import read_manifest
from data_gen.storage.shards import Shard, write_shard
from data_gen.storage.summary import Summary, light_stops, merge_counts
from data_gen.storage.writers.writer import FORMATS, find_writer
from simulator.errors import PhotositeError

ABOUT = About("Toy ramps", "Ramps with noise.", "CC0-1.0", ("ramps of the tests",))


def test_counts_are_those_of_the_samples(tmp_path):
    write_toy_folder(tmp_path)
    write_card(tmp_path, ABOUT)
    card = json.loads((tmp_path / "card.json").read_text())
    samples = [toy_sample(index) for index in range(7)]
    assert card["iso"] == {"100": 3, "400": 2, "1600": 2} and list(card["iso"]) == ["100", "400", "1600"]
    assert card["camera"] == {"nikon_d850": 3, "sony_a7s2": 4}
    stops = Counter(str(int(np.floor(np.log2(sample.exposure_ratios[0])))) for sample in samples)
    assert card["ratio_stops"] == stops and card["shape"] == {"1 x 24 x 32": 7}
    assert (card["samples"], card["pictures"], card["problem_count"], card["licence"]) == (7, 7, 2, "CC0-1.0")
    text = (tmp_path / "card.md").read_text()
    for word in (
        "# Toy ramps",
        "CC0-1.0",
        "- ramps of the tests",
        "| 400 | 2 |",
        "card_samples.png",
        "shard-00000-of-00003.tar",
    ):
        assert word in text


def test_a_card_is_the_same_each_time_and_needs_a_complete_data_set(tmp_path):
    for folder in (tmp_path / "a", tmp_path / "b"):
        write_toy_folder(folder)
        write_card(folder, ABOUT, shown_samples=2)
    for name in ("card.json", "card.md", "card_samples.png", "card_histograms.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    write_toy_folder(tmp_path / "c", only=(0,))
    with pytest.raises(PhotositeError, match="manifest.json: is missing"):
        write_card(tmp_path / "c", ABOUT)


def test_without_matplotlib_the_card_says_so(tmp_path, monkeypatch):
    write_toy_folder(tmp_path)
    monkeypatch.setattr("data_gen.report.card.find_spec", lambda name: None)
    text = write_card(tmp_path, ABOUT).read_text()
    assert "No pictures: matplotlib was not installed." in text and ".png" not in text
    assert not list(tmp_path.glob("*.png"))


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_the_code_of_the_card_reads_the_first_sample(tmp_path, name, monkeypatch):
    assert set(SNIPPETS) == set(FORMATS)
    write_toy_folder(tmp_path, name)
    monkeypatch.chdir(tmp_path)
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(snippet(name, read_manifest(tmp_path)["shards"][0].name), {})
    camera, iso, *_, mean = out.getvalue().split()
    sample = toy_sample(0)
    wanted = sample.noisy_dn.mean()
    if name == "eld":
        signal = (pack(sample.noisy_dn[0], "RGGB", "rgbg") - 512.0) / 15871 * sample.exposure_ratios[0]
        wanted = 65535 * np.clip(signal, 0, 1).mean()
    assert (camera, int(iso)) == ("sony_a7s2", 100) and float(mean) == pytest.approx(wanted, rel=1e-4)
    assert os.getcwd() == str(tmp_path)


@pytest.mark.parametrize("name", ["lmdb", "dng"])
def test_the_code_reads_samples_of_ten_digits(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shard = Shard(0, 1, 10**9, 2)
    record = write_shard(tmp_path, shard, find_writer(name), map(toy_sample, shard.indices))
    with contextlib.redirect_stdout(io.StringIO()) as out:
        exec(snippet(name, record.name), {})
    assert float(out.getvalue().split()[-1]) == pytest.approx(toy_sample(10**9).noisy_dn.mean(), rel=1e-4)


def test_light_is_counted_in_stops_below_saturation():
    for signal, stops in ((1.0, 0), (0.75, -1), (0.5, -1), (0.49, -2), (2.0**-5, -5), (0.0, -16)):
        clean = np.full((1, 24, 32), 512 + signal * 15871, np.float32)
        assert light_stops(toy_sample(0, clean_dn=clean)) == stops


def test_counts_of_shards_add_up_and_numbers_sort_as_numbers():
    halves = [Summary(), Summary()]
    for index in range(9):
        halves[index % 2].add(toy_sample(index, frames=2))
    total = merge_counts(half.counts() for half in halves)
    assert total["iso"] == {"100": 3, "400": 3, "1600": 3} and list(total["iso"]) == ["100", "400", "1600"]
    assert sum(total["ratio_stops"].values()) == 18 and sum(total["source"].values()) == 9


def test_a_grey_surface_is_drawn_grey():
    grey = 512 + np.tile(np.array([[3000 / 2.1, 3000], [3000, 3000 / 1.57]]), (12, 16))
    picture = linear_picture(toy_sample(0), grey)
    np.testing.assert_allclose(picture, 3000 / 15871, rtol=1e-9)
    assert picture.shape == (12, 16, 3)


@pytest.mark.parametrize("over", [1.0, 3.0])
def test_a_saturated_surface_is_drawn_white(over):
    white = np.full((24, 32), 16383.0)  # every photosite, of whatever colour, at the white level
    np.testing.assert_allclose(linear_picture(toy_sample(0), white), 1.0, rtol=1e-9)
    grey = 512 + np.minimum(over * 15871 / np.array([[2.1, 1.0], [1.0, 1.57]]), 15871)
    np.testing.assert_allclose(linear_picture(toy_sample(0), np.tile(grey, (12, 16))), 1.0, rtol=1e-9)
