"""Raw files as clean pictures: levels by place, pattern, white balance; what cannot be used is refused."""

import numpy as np
import pytest
from helpers.dng_edits import STRIPES, with_tags
from helpers.raw_frame import COLOR_MATRIX, NEUTRAL, random_frame

from data_gen.sources.patches import AUGMENTATIONS, choose_crop, cut_patch
from data_gen.sources.raw_files import RawFiles
from simulator.errors import PhotositeError
from simulator.raw.dng import writer


def read(folder, name):
    return RawFiles(folder).read(name, np.random.default_rng(0))


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG", "MONO"])
def test_signal_is_the_share_of_the_range_above_black(tmp_path, cfa):
    raw = random_frame(cfa=cfa, black_level_dn=500)
    writer.write_dng(raw, tmp_path / "a.dng")
    picture = read(tmp_path, "a.dng")
    expected = np.maximum((raw.dn.astype(np.float64) - 500) / (raw.white_level_dn - 500), 0)
    np.testing.assert_allclose(picture.signal, expected, rtol=1e-6)
    assert picture.cfa == cfa and picture.signal.dtype == np.float32
    assert picture.signal.min() == 0 and (raw.dn < 500).any()
    assert picture.white_balance == pytest.approx((1, 1, 1) if cfa == "MONO" else 1 / np.array(NEUTRAL), rel=1e-5)
    if cfa != "MONO":
        np.testing.assert_allclose(
            picture.color_matrix, COLOR_MATRIX, atol=1e-4
        )  # LibRaw hands out its inverse in single precision


def test_each_place_has_its_own_black_level(tmp_path):
    raw = random_frame(cfa="GRBG", black_level_dn=500, black_offsets_dn=(0, 10, 20, 30))
    writer.write_dng(raw, tmp_path / "a.dng")
    black = 500 + np.tile([[0, 10], [20, 30]], (48, 64))
    # One white level for all places: LibRaw takes DNG's largest.
    expected = np.maximum((raw.dn.astype(np.float64) - black) / (raw.white_level_dn - black), 0)
    np.testing.assert_allclose(read(tmp_path, "a.dng").signal, expected, rtol=1e-6)


def test_a_turned_patch_keeps_the_colours_of_the_file(tmp_path):
    """A frame in which each colour has a level of its own: every patch in every phase shows it."""
    levels = {"R": 2000, "G": 6000, "B": 4000}
    tile = np.array([levels[letter] for letter in "GBRG"], dtype=np.uint16).reshape(2, 2)
    writer.write_dng(random_frame(cfa="GBRG", dn=np.tile(tile, (48, 64)), black_level_dn=0), tmp_path / "a.dng")
    picture = read(tmp_path, "a.dng")
    for cfa in ("RGGB", "BGGR"):
        for augmentation in AUGMENTATIONS:
            patch = cut_patch(picture, choose_crop(picture, (20, 20), cfa, (0.5, 0.5), augmentation), cfa)
            expected = np.tile(np.reshape([levels[letter] for letter in cfa], (2, 2)), (10, 10)) / 16383
            np.testing.assert_allclose(patch, expected, rtol=1e-6)


def test_a_file_without_white_balance_takes_that_of_daylight(tmp_path):
    neutral, matrices = {50728}, {50721, 50722}
    content = writer.dng_bytes(random_frame())
    (tmp_path / "a.dng").write_bytes(with_tags(content, {}, neutral, raw_directory=False))
    white = COLOR_MATRIX @ [0.95047, 1.0, 1.08883]
    assert read(tmp_path, "a.dng").white_balance == pytest.approx(white[1] / white, rel=1e-3)
    (tmp_path / "a.dng").write_bytes(with_tags(content, {}, neutral | matrices, raw_directory=False))
    with pytest.raises(PhotositeError, match=r"a\.dng: tells neither white balance nor colour matrix"):
        read(tmp_path, "a.dng")


def test_files_that_cannot_be_used_are_refused_by_name(tmp_path):
    (tmp_path / "text.dng").write_text("no raw file\n" * 1000)
    with pytest.raises(PhotositeError, match=r"text\.dng: .*give a DNG"):
        read(tmp_path, "text.dng")
    content = writer.dng_bytes(random_frame())
    (tmp_path / "short.dng").write_bytes(content[: len(content) // 2])
    with pytest.raises(PhotositeError, match=r"short\.dng: damaged or cut short"):
        read(tmp_path, "short.dng")
    (tmp_path / "stripes.dng").write_bytes(with_tags(content, STRIPES))
    with pytest.raises(PhotositeError, match=r"stripes\.dng: 2 x 2 filter pattern.*only 2 x 2 Bayer"):
        read(tmp_path, "stripes.dng")


def test_names_are_the_raw_files_of_the_folder(tmp_path):
    for name in ("b.dng", "a.NEF", "a.txt", "x/c.arw"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_bytes(b"")
    assert RawFiles(tmp_path).names() == ("a.NEF", "b.dng", "x/c.arw")
    with pytest.raises(PhotositeError, match="endings in lower case"):
        RawFiles(tmp_path, extensions=("DNG",))
