"""Names of files in a data set, and the look at all of them before the work begins."""

import os
import unicodedata

import numpy as np
import pytest
from helpers.picture_files import put, random_codes

from data_gen.sources.check import check_sources
from data_gen.sources.folder import picture_names
from data_gen.sources.patches import AUGMENTATIONS
from data_gen.sources.photographs import Photographs
from data_gen.sources.source import CleanImage
from simulator.config import load_camera
from simulator.errors import PhotositeError

ENDINGS = (".png", ".jpg")


def touch(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"")


def test_names_are_relative_paths_sorted_by_bytes(tmp_path):
    touch(tmp_path, "b/1.png", "a.png", "B.PNG", "b.png", "é.jpg", "b/c/2.png", "notes.txt", ".hidden.png", ".git/x.png")
    names = picture_names(tmp_path, ENDINGS, "photographs")
    assert names == ("B.PNG", "a.png", "b.png", "b/1.png", "b/c/2.png", "é.jpg")
    assert list(names) == sorted(names, key=lambda name: name.encode())


def test_a_link_to_a_folder_is_not_followed(tmp_path):
    touch(tmp_path, "a/1.png")
    os.symlink(tmp_path, tmp_path / "a" / "again")
    assert picture_names(tmp_path, ENDINGS, "photographs") == ("a/1.png",)


def test_names_that_cannot_be_told_apart_are_refused(tmp_path):
    touch(tmp_path, *(unicodedata.normalize(form, "é.png") for form in ("NFC", "NFD")))
    with pytest.raises(PhotositeError, match="a second file has this name"):
        picture_names(tmp_path, ENDINGS, "photographs")


def test_a_name_that_is_no_utf8_is_refused(tmp_path):
    try:
        with open(os.fsencode(tmp_path) + b"/bad\xff.png", "wb"):
            pass
    except OSError:
        pytest.skip("this file system takes UTF-8 names only")
    with pytest.raises(PhotositeError, match=r"bad\\xff\.png: the name is no UTF-8"):
        picture_names(tmp_path, ENDINGS, "photographs")


def test_an_empty_or_missing_folder_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="holds no file that ends in .png, .jpg"):
        picture_names(tmp_path, ENDINGS, "photographs")
    with pytest.raises(PhotositeError, match="photographs = .*absent: no such folder"):
        picture_names(tmp_path / "absent", ENDINGS, "photographs")


def test_all_bad_pictures_are_listed_with_counts_and_good_ones_are_not(tmp_path):
    camera = load_camera("sony_a7s2")
    for index in range(4):
        put(tmp_path / "a" / f"good_{index}.png", random_codes(34, 40, seed=index))
    put(tmp_path / "a" / "small.png", random_codes(20, 20))
    put(tmp_path / "a" / "grey.png", random_codes(34, 40, channels=1))
    put(tmp_path / "a" / "floats.tif", random_codes(34, 40).astype(np.float32))
    (tmp_path / "a" / "broken.png").write_bytes(b"\x89PNG\r\n")
    put(tmp_path / "b" / "good_1.png", random_codes(34, 40))
    sources = [Photographs(tmp_path / "a", camera), Photographs(tmp_path / "b", camera), Photographs(tmp_path / "c", camera)]
    seen = []
    report = check_sources(sources, (24, 32), ("RGGB", "BGGR"), progress=lambda what, share: seen.append((what, share)))
    assert report.pictures == 9 and seen[0] == ("pictures looked at, 1 of 9", 1 / 9) and seen[-1][1] == 1.0
    assert {(p.source, p.name, p.kind) for p in report.problems} == {
        (2, "", "not listed"),
        (0, "broken.png", "unreadable"),
        (0, "floats.tif", "unreadable"),
        (0, "small.png", "too small"),
        (1, "good_1.png", "duplicate name"),
    }
    assert report.counts() == {"not listed": 1, "unreadable": 2, "too small": 1, "duplicate name": 1}
    with pytest.raises(PhotositeError, match=r"9 pictures, of which cannot be used: 1 not listed, 2 unreadable"):
        report.refuse()


def test_a_mosaic_must_hold_the_patch_in_one_of_the_ways_it_may_be_turned():
    class One:
        def __init__(self, height, width):
            self.signal = np.zeros((height, width), np.float32)

        def names(self):
            return ("one",)

        def read(self, name, draw):
            return CleanImage(self.signal, "RGGB", (1.0, 1.0, 1.0))

    assert check_sources([One(16, 16)], (16, 16), ("RGGB",), [AUGMENTATIONS[0]]).problems == ()
    assert check_sources([One(17, 17)], (16, 16), ("RGGB", "BGGR")).problems == ()
    assert check_sources([One(16, 16)], (16, 16), ("RGGB",)).problems == ()  # a flip needs a row more, a transposition none
    assert check_sources([One(16, 16)], (16, 16), ("RGGB",), AUGMENTATIONS[1:3]).counts() == {"too small": 1}
    assert check_sources([One(16, 16)], (16, 16), ("BGGR",)).problems == ()  # turned by 180 degrees
    check_sources([One(17, 17)], (16, 16), ("RGGB",)).refuse()
