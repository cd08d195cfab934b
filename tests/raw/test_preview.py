"""A preview is the development of the frame's means: small, without its truth, of any size and pattern."""

import dataclasses

import numpy as np
import pytest
from helpers.raw_frame import random_frame

from simulator.errors import PhotositeError
from simulator.raw.development import develop
from simulator.raw.preview import PREVIEW_PX, preview


def means(codes: np.ndarray, side: int, rows: int, columns: int) -> np.ndarray:
    """Rounded float64 means of side x side codes of each place of a pattern, written with loops."""
    tall, wide = codes.shape[0] // (side * rows), codes.shape[1] // (side * columns)
    found = np.empty((tall * rows, wide * columns))
    for y in range(found.shape[0]):
        for x in range(found.shape[1]):
            top, left = y // rows * side * rows + y % rows, x // columns * side * columns + x % columns
            block = codes[top : top + side * rows : rows, left : left + side * columns : columns]
            found[y, x] = block.astype(np.float64).mean()
    return np.rint(found).astype(np.uint16)


def test_a_small_frame_is_developed_as_it_is():
    raw = random_frame()
    np.testing.assert_array_equal(preview(raw), develop(raw, bits=8, demosaic="linear"))


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG", "MONO"])
@pytest.mark.parametrize(("height", "width", "side"), [(130, 150, 2), (127, 301, 3)])
def test_a_large_frame_is_the_mean_of_its_codes_before_it_is_developed(cfa, height, width, side):
    raw = random_frame(height, width, cfa)
    small = dataclasses.replace(raw, dn=means(raw.dn, side, 2, 2))
    np.testing.assert_array_equal(preview(raw, most_px=52), develop(small, bits=8, demosaic="linear", half_size=True))


def test_a_larger_pattern_keeps_its_period():
    raw = random_frame(300, 420, "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG")
    small = dataclasses.replace(raw, dn=means(raw.dn, 3, 6, 6))
    np.testing.assert_array_equal(preview(raw, most_px=140), develop(small, bits=8, demosaic="linear"))


def test_optical_black_is_no_part_of_the_picture():
    raw = random_frame(96, 128)
    dark = dataclasses.replace(raw, active_area=(7, 12, 96, 128))
    seen = dataclasses.replace(raw, dn=raw.dn[8:, 12:])  # from a whole period on
    np.testing.assert_array_equal(preview(dark), preview(seen))


def test_what_a_file_stores_otherwise_is_shown_alike():
    raw = random_frame(64, 1200)
    other = dataclasses.replace(raw, linearization=np.arange(2**14, dtype=np.uint16), format=dataclasses.replace(raw.format))
    np.testing.assert_array_equal(preview(raw), preview(other))


@pytest.mark.parametrize(("height", "width"), [(600, 960), (961, 64), (2000, 3000)])
def test_no_side_is_longer_than_asked_for(height, width):
    assert 0 < max(preview(random_frame(height, width)).shape[:2]) <= PREVIEW_PX


def test_a_strip_has_no_preview():
    with pytest.raises(PhotositeError, match="preview = 5000 x 40 photosites: too narrow"):
        preview(random_frame(40, 5000))


def test_the_truth_is_not_computed():
    def fail() -> np.ndarray:
        raise AssertionError("the truth was computed")

    preview(random_frame(mean_electrons=fail, noise_free_dn=fail, resolved=fail))


def test_four_colours_have_no_preview():
    with pytest.raises(PhotositeError):
        preview(random_frame(cfa="RGWB", color_matrix=None, as_shot_neutral=(1.0,) * 4, noise_profile=((1e-4, 1e-7),) * 4))
