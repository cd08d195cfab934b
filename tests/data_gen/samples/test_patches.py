"""Patches: the colour filter keeps its phase through every crop, flip and transposition."""

import itertools

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from data_gen.sources.patches import AUGMENTATIONS, Augmentation, choose_crop, cut_patch
from data_gen.sources.source import CleanImage, apply_cfa
from simulator.errors import PhotositeError

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG")
SIZES = ((6, 8), (7, 8), (6, 9), (7, 9))
NEUTRAL = (1.0, 1.0, 1.0)


def numbered(height=20, width=23, channels=3) -> np.ndarray:
    """Every value differs from every other, so a value tells where it came from."""
    return np.arange(height * width * channels, dtype=np.float32).reshape(height, width, channels)


def by_hand(picture: np.ndarray, augmentation: Augmentation) -> np.ndarray:
    for wanted, turn in (
        (augmentation.transpose, lambda a: np.swapaxes(a, 0, 1)),
        (augmentation.flip_y, np.flipud),
        (augmentation.flip_x, np.fliplr),
    ):
        picture = turn(picture) if wanted else picture
    return picture


def photosites(planes: np.ndarray, cfa: str) -> np.ndarray:
    """A mosaic, one photosite after the other."""
    height, width = planes.shape[:2]
    return np.array([[planes[y, x, "RGB".index(cfa[2 * (y % 2) + x % 2])] for x in range(width)] for y in range(height)])


@pytest.mark.parametrize("cfa", CFAS)
def test_a_mosaic_holds_each_photosite_s_own_colour(cfa):
    np.testing.assert_array_equal(apply_cfa(numbered(7, 5), cfa), photosites(numbered(7, 5), cfa))


@pytest.mark.parametrize("augmentation", AUGMENTATIONS, ids=lambda each: each.name)
def test_an_augmented_mosaic_is_the_mosaic_of_the_augmented_planes(augmentation):
    planes = numbered()
    for own, wanted, size, place in itertools.product(CFAS, CFAS, SIZES, ((0.0, 0.0), (0.4, 0.7), (0.999, 0.999))):
        mosaic = CleanImage(apply_cfa(planes, own), own, NEUTRAL)
        crop = choose_crop(mosaic, size, wanted, place, augmentation)
        patch = cut_patch(mosaic, crop, wanted)
        window = planes[crop.top : crop.top + crop.height, crop.left : crop.left + crop.width]
        assert patch.shape == size
        np.testing.assert_array_equal(patch, photosites(by_hand(window, augmentation), wanted))


@pytest.mark.parametrize("augmentation", AUGMENTATIONS, ids=lambda each: each.name)
def test_planes_are_augmented_before_they_become_a_mosaic(augmentation):
    planes = numbered()
    for wanted, size in itertools.product(CFAS, SIZES):
        crop = choose_crop(CleanImage(planes, None, NEUTRAL), size, wanted, (0.3, 0.6), augmentation)
        window = planes[crop.top : crop.top + crop.height, crop.left : crop.left + crop.width]
        patch = cut_patch(CleanImage(planes, None, NEUTRAL), crop, wanted)
        np.testing.assert_array_equal(patch, photosites(by_hand(window, augmentation), wanted))


def test_the_eight_augmentations_differ_and_are_named():
    square = np.arange(9).reshape(3, 3)
    assert len({each.of(square).tobytes() for each in AUGMENTATIONS}) == 8 == len({each.name for each in AUGMENTATIONS})
    assert AUGMENTATIONS[0].name == "none" and Augmentation(True, False, True).name == "transpose+flip_x"


def test_a_monochrome_mosaic_may_begin_anywhere():
    picture = CleanImage(numbered()[..., 0], "MONO", NEUTRAL)
    tops = {choose_crop(picture, (6, 6), "MONO", (share, 0.5)).top for share in np.arange(15) / 15}
    assert tops == set(range(15))


@pytest.mark.parametrize("cfa", [None, "GRBG"])
def test_even_draws_give_every_place_equally_often(cfa):
    planes = numbered(17, 16)
    picture = CleanImage(planes if cfa is None else apply_cfa(planes, cfa), cfa, NEUTRAL)
    step = 1 if cfa is None else 2
    draws = np.random.default_rng(3).random((4000, 2))
    crops = [choose_crop(picture, (6, 7), "RGGB", tuple(draw), AUGMENTATIONS[3]) for draw in draws]
    p_values = {}
    for side, first, places in (("top", min(c.top for c in crops), 12), ("left", min(c.left for c in crops), 10)):
        counts = np.bincount([(getattr(crop, side) - first) // step for crop in crops])
        assert len(counts) == len(range(first, places, step))
        p_values[side] = stats.chisquare(counts).pvalue
    accept(p_values)


def test_the_last_place_lies_inside_for_a_share_just_below_one():
    crop = choose_crop(CleanImage(numbered(9, 9), None, NEUTRAL), (4, 4), "RGGB", (np.nextafter(1, 0),) * 2)
    assert (crop.top, crop.left) == (5, 5)


def test_a_picture_too_small_or_of_another_kind_is_refused_by_name():
    small = CleanImage(apply_cfa(numbered(8, 8), "RGGB"), "RGGB", NEUTRAL)
    assert choose_crop(small, (8, 8), "RGGB", name="a.dng").top == 0
    with pytest.raises(PhotositeError, match=r"a\.dng: 8 x 8 pixels are too few .* begins with BGGR"):
        choose_crop(small, (8, 8), "BGGR", name="a.dng")
    with pytest.raises(PhotositeError, match=r"b\.png: 20 x 20 pixels are too few for a patch of 24 x 16"):
        choose_crop(CleanImage(numbered(20, 20), None, NEUTRAL), (16, 24), "RGGB", name="b.png")
    with pytest.raises(PhotositeError, match="R, G, B planes, which a MONO sensor does not see"):
        choose_crop(CleanImage(numbered(), None, NEUTRAL), (4, 4), "MONO")
    with pytest.raises(PhotositeError, match="a MONO mosaic, which a RGGB sensor"):
        choose_crop(CleanImage(numbered()[..., 0], "MONO", NEUTRAL), (4, 4), "RGGB")
