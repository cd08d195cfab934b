import dataclasses
import datetime
import io
import itertools
import math
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.fresh_reader import libraw_codes
from helpers.raw_frame import COLOR_MATRIX, NEUTRAL, random_frame
from hypothesis import example, given
from hypothesis import strategies as st

from simulator.errors import PhotositeError
from simulator.raw.dng.tiff import nearest_fraction
from simulator.raw.dng.writer import dng_bytes, write_dng

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
SIZES = ((96, 128), (97, 131), (22, 23), (300, 22))
DEPTHS = (8, 10, 12, 14, 16)
# LibRaw numbers the colours R 0, G in red rows 1, B 2, G in blue rows 3.
LIBRAW_PATTERNS = {
    "RGGB": [[0, 1], [3, 2]],
    "BGGR": [[2, 3], [1, 0]],
    "GRBG": [[1, 0], [2, 3]],
    "GBRG": [[3, 2], [0, 1]],
}


def tags(directory):
    return {tag.code: (tag.dtype.name, tag.count, tag.value) for tag in directory.tags.values()}


def read_tags(raw):
    """IFD 0, SubIFD and Exif IFD as an independent reader sees them: number -> (type, count, value)."""
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        main = file.pages[0]
        return tags(main), tags(main.pages[0]), main.tags[34665].value, main.asarray(), main.pages[0].asarray()


def test_a_fresh_libraw_reads_back_every_code_for_all_patterns_sizes_and_depths(tmp_path):
    frames = {}
    for seed, (cfa, size, depth) in enumerate(itertools.product(CFAS, SIZES, DEPTHS)):
        path = tmp_path / f"{cfa}_{size[0]}_{depth}.dng"
        frames[str(path)] = random_frame(*size, cfa, depth, seed)
        write_dng(frames[str(path)], path)
    found = libraw_codes(frames, tmp_path)
    assert len(found) == len(CFAS) * len(SIZES) * len(DEPTHS)
    for path, raw in frames.items():
        np.testing.assert_array_equal(found[path], raw.dn, err_msg=path)


@pytest.mark.parametrize("cfa", CFAS)
def test_libraw_finds_pattern_levels_white_balance_and_exposure(cfa):
    raw = random_frame(cfa=cfa)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert frame.black_level_per_channel == [511] * 4
        assert frame.white_level == 16383
        assert (frame.other.iso_speed, frame.other.focal_length) == (400, 50)
        assert frame.other.shutter_speed == pytest.approx(0.008, rel=1e-6)
        assert frame.other.aperture == pytest.approx(2.8, rel=1e-6)
        if cfa == "MONO":
            assert frame.num_colors == 1
            return
        assert frame.raw_pattern.tolist() == LIBRAW_PATTERNS[cfa]
        assert frame.camera_whitebalance == pytest.approx([2, 1, 1.6, 0], rel=1e-6)
        # LibRaw keeps the inverse of (XYZ -> camera) (sRGB -> XYZ), rows scaled so that white is (1, 1, 1).
        srgb_to_xyz = np.array([[0.412453, 0.357580, 0.180423], [0.212671, 0.715160, 0.072169], [0.019334, 0.119193, 0.950227]])
        to_camera = COLOR_MATRIX @ srgb_to_xyz
        expected = np.linalg.inv(to_camera / to_camera.sum(axis=1, keepdims=True))
        np.testing.assert_allclose(frame.color_matrix[:, :3], expected, atol=1e-4)


def test_every_tag_of_ifd_0_has_the_type_count_and_value_of_the_standard():
    main, *_ = read_tags(random_frame())
    assert main[254] == ("LONG", 1, 1)
    assert main[258] == ("SHORT", 3, (8, 8, 8))
    assert main[262] == ("SHORT", 1, 2)
    assert main[271][2] == "Photosite" and main[272][2] == "Test Body"
    assert main[274] == ("SHORT", 1, 1)
    assert main[305][2].startswith("Photosite ")
    assert main[330][:2] == ("LONG", 1)
    assert main[50706] == ("BYTE", 4, bytes([1, 4, 0, 0]))
    assert main[50707] == ("BYTE", 4, bytes([1, 1, 0, 0]))
    assert main[50708][2] == "Photosite Test Body"
    assert main[50778] == ("SHORT", 1, 21)
    kind, count, value = main[50721]
    assert (kind, count) == ("SRATIONAL", 9)
    np.testing.assert_allclose(np.divide(value[::2], value[1::2]), COLOR_MATRIX.ravel(), rtol=0, atol=5e-7)
    kind, count, value = main[50728]
    assert (kind, count) == ("RATIONAL", 3)
    np.testing.assert_allclose(np.divide(value[::2], value[1::2]), NEUTRAL, rtol=1e-6)


def test_every_tag_of_the_raw_directory_has_the_type_count_and_value_of_the_standard():
    _, raw_tags, *_ = read_tags(random_frame(97, 131, "GRBG"))
    expected = {
        254: ("LONG", 1, 0),
        256: ("LONG", 1, 131),
        257: ("LONG", 1, 97),
        258: ("SHORT", 1, 16),
        259: ("SHORT", 1, 1),
        262: ("SHORT", 1, 32803),
        277: ("SHORT", 1, 1),
        278: ("LONG", 1, 97),
        279: ("LONG", 1, (2 * 97 * 131,)),
        33421: ("SHORT", 2, (2, 2)),
        33422: ("BYTE", 4, bytes([1, 0, 2, 1])),
        50710: ("BYTE", 3, bytes([0, 1, 2])),
        50711: ("SHORT", 1, 1),
        50713: ("SHORT", 2, (2, 2)),
        50714: ("SHORT", 4, (511, 511, 511, 511)),
        50717: ("SHORT", 1, 16383),
        50719: ("LONG", 2, (8, 8)),
        50720: ("LONG", 2, (115, 81)),
        51041: ("DOUBLE", 6, (2e-4, 3e-7, 2.5e-4, 4e-7, 3e-4, 5e-7)),
    }
    assert {code: raw_tags[code] for code in expected} == expected


def test_a_mono_frame_is_linear_raw_with_no_colour_tags():
    main, raw_tags, *_ = read_tags(random_frame(cfa="MONO"))
    assert raw_tags[262] == ("SHORT", 1, 34892)
    assert raw_tags[50714] == ("SHORT", 1, 511)
    assert raw_tags[51041] == ("DOUBLE", 2, (2e-4, 3e-7))
    assert not {33421, 33422, 50710, 50711} & set(raw_tags)
    assert not {50721, 50728, 50778} & set(main)


def test_a_fractional_black_level_is_kept():
    _, raw_tags, *_ = read_tags(random_frame(black_level_dn=512.75))
    assert raw_tags[50714] == ("RATIONAL", 4, (2051, 4) * 4)


def test_the_smallest_frame_still_has_a_crop_inside_it():
    _, raw_tags, *_ = read_tags(random_frame(22, 23))
    assert raw_tags[50719][2] == (2, 2) and raw_tags[50720][2] == (19, 18)


def test_exif_tells_how_the_picture_was_taken():
    raw = random_frame(date_time="2020-02-29 12:34:56")
    _, _, exif, *_ = read_tags(raw)
    assert exif["ExposureTime"] == (1, 125)
    assert exif["FNumber"] == (14, 5)
    assert exif["FocalLength"] == (50, 1)
    assert exif["FocalLengthIn35mmFilm"] == 75
    assert exif["SubjectDistance"] == (5, 2)
    assert exif["ISOSpeedRatings"] == 400
    assert exif["LensModel"] == "50mm f/1.8 thin lens"
    assert exif["DateTimeOriginal"] == "2020:02:29 12:34:56"
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert frame.other.timestamp == datetime.datetime(2020, 2, 29, 12, 34, 56)


def test_exif_leaves_out_the_date_when_the_shot_has_none_so_two_runs_agree():
    _, _, exif, *_ = read_tags(random_frame())
    assert "DateTimeOriginal" not in exif
    assert dng_bytes(random_frame()) == dng_bytes(random_frame())


def test_infinite_focus_is_the_numerator_exif_reserves_for_it():
    _, _, exif, *_ = read_tags(random_frame(focus_distance_m=math.inf))
    assert exif["SubjectDistance"] == (0xFFFFFFFF, 1)


def test_exif_tells_a_lens_of_one_focal_length_whose_widest_aperture_nobody_said():
    _, _, exif, *_ = read_tags(random_frame(focal_length_mm=32.5))
    assert exif["LensSpecification"] == (65, 2, 65, 2, 0, 0, 0, 0)
    with rawpy.imread(io.BytesIO(dng_bytes(random_frame()))) as frame:
        assert (frame.lens.min_focal, frame.lens.max_focal) == (50, 50)
    _, _, exif, *_ = read_tags(random_frame(focal_length_mm=0.0))
    assert "LensSpecification" not in exif


def test_an_iso_beyond_16_bits_goes_into_the_32_bit_tag():
    _, _, exif, *_ = read_tags(random_frame(iso=409600))
    assert (exif["ISOSpeedRatings"], exif["SensitivityType"], exif["RecommendedExposureIndex"]) == (65535, 2, 409600)


def test_an_iso_beyond_32_bits_has_the_16_bit_tag_alone():
    _, _, exif, *_ = read_tags(random_frame(iso=2**32 - 1))
    assert (exif["ISOSpeedRatings"], exif["SensitivityType"], exif["RecommendedExposureIndex"]) == (65535, 2, 2**32 - 1)
    _, _, exif, *_ = read_tags(random_frame(iso=2**32))
    assert exif["ISOSpeedRatings"] == 65535 and not {"SensitivityType", "RecommendedExposureIndex"} & set(exif)


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_exiftool_validates_without_a_warning(tmp_path):
    frames = [random_frame(*size, cfa) for cfa in CFAS for size in SIZES]
    frames += [
        random_frame(iso=409600, focus_distance_m=math.inf, black_level_dn=512.75),
        random_frame(make="Fürst", model="µ100", date_time="2020-02-29 12:34:56"),
        random_frame(make="", model="", lens_model=""),
    ]
    paths = [str(tmp_path / f"{number:02}.dng") for number in range(len(frames))]
    for raw, path in zip(frames, paths, strict=True):
        write_dng(raw, path)
    done = subprocess.run(["exiftool", "-validate", "-warning", "-error", "-a", "-q", *paths], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("========")]
    assert done.stderr == ""
    assert lines == ["Validate                        : OK"] * len(frames)


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_exiftool_reads_names_beyond_ascii(tmp_path):
    write_dng(random_frame(make="Fürst", model="µ100"), tmp_path / "a.dng")
    done = subprocess.run(["exiftool", "-s3", "-Make", "-Model", tmp_path / "a.dng"], capture_output=True, encoding="utf-8")
    assert done.stdout.split() == ["Fürst", "µ100"]


@pytest.mark.parametrize("cfa", CFAS)
def test_the_thumbnail_shows_the_frame_white_balanced(cfa):
    # Left half black, right half a white surface of signal 0.25: 0.25^(1/2.2) * 255 = 135.8.
    raw = random_frame(600, 800, cfa, black_level_dn=383)
    neutral = dict(zip("RGB", NEUTRAL, strict=True))
    cell = np.array([[neutral.get(letter, 1.0) for letter in (cfa if cfa != "MONO" else "WWWW")]]).reshape(2, 2)
    signal = np.tile(cell, (300, 400)) * (np.arange(800) >= 400) * 0.25
    raw = dataclasses.replace(raw, dn=np.rint(383 + 16000 * signal).astype(np.uint16))
    *_, picture, mosaic = read_tags(raw)
    assert picture.shape[2] == 3 and 128 < max(picture.shape) <= 256
    assert picture.shape[1] / picture.shape[0] == pytest.approx(800 / 600, abs=0.02)
    np.testing.assert_array_equal(picture[:, : picture.shape[1] // 2 - 1], 0)
    np.testing.assert_array_equal(picture[:, picture.shape[1] // 2 + 1 :], 136)
    np.testing.assert_array_equal(mosaic, raw.dn)


@pytest.mark.parametrize(("make", "model"), [("SONY", "ILCE-7M3"), ("NIKON CORPORATION", "NIKON D850"), ("FUJIFILM", "X-T3")])
def test_a_known_camera_name_changes_neither_codes_nor_levels(make, model):
    # LibRaw keeps tables by camera name; they must not reach a file that says all itself.
    raw = random_frame(make=make, model=model)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        np.testing.assert_array_equal(frame.raw_image_visible, raw.dn)
        assert (frame.white_level, frame.black_level_per_channel) == (16383, [511] * 4)
        assert frame.raw_pattern.tolist() == [[0, 1], [3, 2]]


REFUSED = {
    "camera.height = 21 px": dict(height=21),
    "camera.width = 20 px": dict(width=20),
    "uint16 \\(height, width\\)": dict(dn=np.zeros((64, 64), np.int32)),
    "4 GiB; use a smaller window": dict(dn=np.broadcast_to(np.uint16(0), (47000, 47000))),
    "camera.width = 64002 px.*64000": dict(dn=np.broadcast_to(np.uint16(0), (24, 64002))),
    "as_shot_neutral = .*three values above 0": dict(as_shot_neutral=(0.5, 0.0, 1.0)),
    "color_matrix = None": dict(color_matrix=None),
    "cannot hold a NUL": dict(lens_model="a\0b"),
    "holds half a character": dict(lens_model="a\ud83d"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_a_frame_that_no_dng_can_hold_is_one_clear_error_and_no_file(tmp_path, message):
    with pytest.raises(PhotositeError, match=message):
        write_dng(random_frame(**REFUSED[message]), tmp_path / "a.dng")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("size", [(22, 64000), (64000, 22)])
def test_the_largest_side_is_read_back(size):
    raw = random_frame(*size)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        np.testing.assert_array_equal(frame.raw_image_visible, raw.dn)
    *_, picture, _ = read_tags(raw)
    assert min(picture.shape[:2]) == 1 and 250 < max(picture.shape[:2]) <= 256


@example(1.7e-6)
@example(3.3e-8)
@given(st.floats(1e-8, 4e9))
def test_a_fraction_fits_32_bits_and_is_as_near_as_a_part_in_a_million(value):
    numerator, denominator = nearest_fraction(value)
    assert 0 < numerator < 2**32 and 0 < denominator < 2**32
    assert numerator / denominator == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(("value", "pair"), [(1 / 125, (1, 125)), (1 / 3, (1, 3)), (2.8, (14, 5)), (30, (30, 1)), (0, (0, 1))])
def test_a_fraction_is_the_one_a_photographer_writes(value, pair):
    assert nearest_fraction(value) == pair


@pytest.mark.parametrize(("value", "pair"), [(1e-12, (0, 1)), (2e-10, (1, 2**32 - 1)), (2.4e-10, (1, 4166666667))])
def test_a_fraction_below_the_least_of_32_bits_is_the_nearer_of_that_and_0(value, pair):
    numerator, denominator = nearest_fraction(value)
    assert (numerator, denominator) == pytest.approx(pair, rel=1e-6)


@pytest.mark.parametrize("seconds", [1e-300, 1e-10, 2.3e-10, 2.4e-10])
def test_a_time_too_short_for_exif_is_left_out_of_it(seconds):
    """The least number of a RATIONAL is 1 / (2^32 - 1); LibRaw gives 0 where there is none."""
    with rawpy.imread(io.BytesIO(dng_bytes(random_frame(exposure_time_s=seconds)))) as frame:
        read_s = frame.other.shutter_speed
    assert read_s == (0.0 if seconds < 1 / (2**32 - 1) else pytest.approx(seconds, rel=1e-6))


def test_a_window_cut_from_a_larger_array_is_written_as_it_looks():
    whole = random_frame(200, 300)
    window = dataclasses.replace(whole, dn=whole.dn[2:102, 4:204])
    with rawpy.imread(io.BytesIO(dng_bytes(window))) as frame:
        np.testing.assert_array_equal(frame.raw_image_visible, window.dn)
