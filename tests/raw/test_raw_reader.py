"""Raw files read for measuring: planes, levels and exposure, for all patterns, and a message for what holds no mosaic."""

import numpy as np
import pytest
from helpers.dng_edits import STRIPES, with_tags
from helpers.raw_frame import COLOR_MATRIX, NEUTRAL, random_frame

from simulator.errors import PhotositeError
from simulator.raw.dng import tiff, writer
from simulator.raw.raw_reader import plane_places, read_raw_file

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG")
X_TRANS = "GGRGGB/GGBGGR/BRGRBG/GGBGGR/GGRGGB/RBGBRG"


@pytest.mark.parametrize("cfa", CFAS)
def test_planes_hold_each_colour_once(tmp_path, cfa):
    raw = random_frame(97, 131, cfa)
    writer.write_dng(raw, tmp_path / "a.dng")
    found = read_raw_file(tmp_path / "a.dng")
    assert (found.cfa, found.white_level_dn, found.iso) == (cfa, raw.white_level_dn, 400)
    assert found.exposure_time_s == pytest.approx(1 / 125)
    np.testing.assert_array_equal(found.mosaic, raw.dn)
    planes = found.planes()
    colours = np.array(list(cfa))[2 * (np.arange(96)[:, None] % 2) + np.arange(130) % 2]
    red_rows = (colours == "R").any(axis=1)[:, None]
    expected = {"R": colours == "R", "Gr": (colours == "G") & red_rows, "Gb": (colours == "G") & ~red_rows, "B": colours == "B"}
    assert list(planes) == ["R", "Gr", "Gb", "B"]
    for name, plane in planes.items():
        np.testing.assert_array_equal(plane.ravel(), raw.dn[:96, :130][expected[name]])


@pytest.mark.parametrize("cfa", CFAS)
def test_white_balance_and_matrix_are_those_of_the_file(tmp_path, cfa):
    writer.write_dng(random_frame(cfa=cfa), tmp_path / "a.dng")
    found = read_raw_file(tmp_path / "a.dng")
    assert found.white_balance == pytest.approx(1 / np.array(NEUTRAL), rel=1e-5)
    np.testing.assert_allclose(found.color_matrix, COLOR_MATRIX, atol=1e-4)  # LibRaw hands out its inverse in single precision


def test_a_monochrome_file_is_one_plane(tmp_path):
    raw = random_frame(97, 131, "MONO")
    writer.write_dng(raw, tmp_path / "a.dng")
    found = read_raw_file(tmp_path / "a.dng")
    assert found.white_balance is None and found.color_matrix is None
    assert list(found.planes()) == ["MONO"] and plane_places("MONO") == {"MONO": (0, 0)}
    np.testing.assert_array_equal(found.planes()["MONO"], raw.dn)


@pytest.mark.parametrize("cfa", CFAS)
def test_each_place_of_the_block_has_its_own_black_level(tmp_path, cfa):
    """LibRaw counts the two greens as colours 1 and 3; the levels must come back by place, whatever the pattern."""
    writer.write_dng(random_frame(cfa=cfa, black_level_dn=10, black_offsets_dn=(0, 10, 20, 30)), tmp_path / "a.dng")
    assert read_raw_file(tmp_path / "a.dng").black_level_dn.tolist() == [[10, 20], [30, 40]]


def test_the_pattern_is_that_of_the_visible_part(tmp_path):
    """DNG 1.4: the CFA pattern begins at the active area; LibRaw moves on to the next even corner."""
    raw = random_frame(cfa="RGGB")
    (tmp_path / "a.dng").write_bytes(with_tags(writer.dng_bytes(raw), {50829: tiff.long(1, 1, 95, 129)}))
    found = read_raw_file(tmp_path / "a.dng")
    assert found.cfa == "BGGR"
    np.testing.assert_array_equal(found.mosaic, raw.dn[2 : 2 + found.mosaic.shape[0], 2 : 2 + found.mosaic.shape[1]])


@pytest.mark.parametrize("area", [(2, 0, 96, 128), (3, 4, 95, 120), (6, 6, 96, 128), (1, 5, 90, 127)])
def test_a_pattern_of_six_by_six_is_that_of_the_visible_part_behind_any_margin(tmp_path, area):
    """Files of other programs begin the active area anywhere; rawpy counts the pattern from the corner of the whole frame."""
    raw = random_frame(cfa=X_TRANS)
    (tmp_path / "x.dng").write_bytes(with_tags(writer.dng_bytes(raw), {50829: tiff.long(*area)}))
    found = read_raw_file(tmp_path / "x.dng", any_pattern=True)
    top, left, bottom, right = area
    assert found.cfa == X_TRANS
    np.testing.assert_array_equal(found.mosaic, raw.dn[top:bottom, left:right])


def test_what_the_file_does_not_say_is_none(tmp_path):
    writer.write_dng(random_frame(exposure_time_s=0.0), tmp_path / "a.dng")
    assert read_raw_file(tmp_path / "a.dng").exposure_time_s is None


def test_files_that_hold_no_mosaic_are_refused_by_name(tmp_path):
    with pytest.raises(PhotositeError, match=r"absent\.dng: no such file"):
        read_raw_file(tmp_path / "absent.dng")
    (tmp_path / "text.dng").write_text("no raw file\n" * 1000)
    with pytest.raises(PhotositeError, match=r"text\.dng: .*give a DNG"):
        read_raw_file(tmp_path / "text.dng")
    content = writer.dng_bytes(random_frame())
    (tmp_path / "short.dng").write_bytes(content[: len(content) // 2])
    with pytest.raises(PhotositeError, match=r"short\.dng: damaged or cut short"):
        read_raw_file(tmp_path / "short.dng")


def test_a_pattern_that_is_not_bayer_is_refused(tmp_path):
    (tmp_path / "stripes.dng").write_bytes(with_tags(writer.dng_bytes(random_frame()), STRIPES))
    with pytest.raises(PhotositeError, match=r"stripes\.dng: 2 x 2 filter pattern"):
        read_raw_file(tmp_path / "stripes.dng")
