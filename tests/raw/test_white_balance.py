"""White balance by illuminant and by grey patch, and the metric development, against NumPy."""

import dataclasses

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.dng_edits import linear_dng
from helpers.raw_frame import COLOR_MATRIX, random_frame
from helpers.scene_builders import band_scene

from simulator.color.colour_science import colour_science
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import DEMOSAICS, develop

BLACK, WHITE = 511, 16383
X_TRANS = "GGRGGB/GGBGGR/BRGRBG/GGBGGR/GGRGGB/RBGBRG"


def flat(red, green, blue, cfa="RGGB", **changes):
    """An even frame of these signals [DN above black]."""
    values = {"R": red, "G": green, "B": blue}
    block = np.array([values[letter] for letter in cfa]).reshape(2, 2)
    return random_frame(96, 128, cfa, dn=(BLACK + np.tile(block, (48, 64))).astype(np.uint16), **changes)


@pytest.mark.parametrize("name", ["A", "D50", "D65", "FL2"])
def test_a_white_surface_in_the_named_light_develops_grey(name):
    colour = colour_science()
    x, y = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][name]
    camera = COLOR_MATRIX @ [x / y, 1.0, (1 - x - y) / y]
    picture = develop(flat(*np.rint(4000 * camera / camera.max())), output="camera", white_balance=name)[48, 64] / 65535
    assert np.ptp(picture) / picture.mean() < 1.5e-3  # the published chromaticities are sums over 5 nm; codes are rounded
    wrong = develop(flat(4000, 2000, 1000), output="camera", white_balance=name)[48, 64] / 65535
    assert np.ptp(wrong) / wrong.mean() > 0.2


@pytest.mark.parametrize("cfa", ["RGGB", "GBRG"])
def test_a_grey_patch_becomes_grey_and_the_rest_goes_with_it(cfa):
    raw = flat(1000, 4000, 2000, cfa)
    dn = raw.dn.copy()
    dn[:24, :40] = flat(3000, 3000, 3000, cfa).dn[:24, :40]  # another patch, beside the one that is named
    raw = dataclasses.replace(raw, dn=dn)
    picture = develop(raw, output="camera", white_balance=(50, 31, 33, 41), demosaic="linear") / 65535
    np.testing.assert_allclose(picture[60:80, 60:120].mean(axis=(0, 1)), 4000 / (WHITE - BLACK), rtol=1e-3)
    np.testing.assert_allclose(picture[5:19, 5:35].mean(axis=(0, 1)), 3000 / (WHITE - BLACK) * np.array([4, 1, 2]), rtol=1e-3)


def uneven(letters):
    """Codes [DN] of photosites of these letters, none of which is as bright as another colour."""
    return (BLACK + np.select([letters == letter for letter in "RGB"], (1000, 4000, 2000))).astype(np.uint16)


@pytest.mark.parametrize("area", [(0, 0, 540, 560), (6, 6, 534, 554)])
def test_a_grey_patch_of_x_trans_becomes_grey_from_any_corner(area):
    raw = random_frame(540, 560, X_TRANS, active_area=area)
    rows, columns = (np.arange(side) % 6 for side in raw.dn.shape)
    letters = np.array([list(row) for row in X_TRANS.split("/")])[np.ix_(rows, columns)]
    for x, y in ((31, 50), (32, 54)):
        picture = develop(dataclasses.replace(raw, dn=uneven(letters)), output="camera", white_balance=(x, y, 7, 9))
        middle = picture[60:80, 60:120] / 65535
        np.testing.assert_allclose(middle.mean(axis=(0, 1)), 4000 / (WHITE - BLACK), rtol=2e-3)


def test_a_grey_patch_behind_a_wide_margin_of_x_trans_is_refused_since_the_pattern_is_not_told(tmp_path):
    """Other white balances need no pattern; the file is no damaged one."""
    raw = random_frame(540, 560, X_TRANS, active_area=(12, 24, 536, 556))
    with pytest.raises(PhotositeError, match=r"margins = \(12, 24\): .*a white balance that is no patch"):
        develop(raw, white_balance=(0, 0, 20, 20))
    assert develop(raw, white_balance=(2.0, 1.0, 1.5)).any()


def test_a_patch_without_one_of_the_colours_is_refused():
    raw = random_frame(540, 560, X_TRANS)
    with pytest.raises(PhotositeError, match="has no photosite of R, B; choose a larger one"):
        develop(raw, white_balance=(0, 0, 2, 2))


def test_a_grey_patch_of_a_linear_file_becomes_grey(tmp_path):
    samples = np.full((60, 80, 3), (1000, 4000, 2000), np.uint16) + np.uint16(256)
    samples[:20] = 9000
    (tmp_path / "linear.dng").write_bytes(linear_dng(samples, (256, 256, 256), WHITE))
    picture = develop(tmp_path / "linear.dng", output="camera", white_balance=(5, 31, 33, 21)) / 65535
    np.testing.assert_allclose(picture[40:] / picture[40:, :, :1], 1.0, rtol=1e-3)


@pytest.mark.parametrize("black", [0, 256, 4096])
def test_full_scale_of_a_linear_file_is_its_white_level_less_its_black(tmp_path, black):
    samples = np.full((60, 80, 3), 8000, np.uint16)
    samples[:20] = WHITE
    (tmp_path / "linear.dng").write_bytes(linear_dng(samples, (black,) * 3, WHITE))
    picture = develop(tmp_path / "linear.dng", output="camera", white_balance=(1.0, 1.0, 1.0)) / 65535
    np.testing.assert_allclose(picture[40:], (8000 - black) / (WHITE - black), rtol=1e-4)
    np.testing.assert_array_equal(picture[:20], 1.0)


WRONG = {
    "128 x 96 px": (100, 50, 29, 10),
    "overexposed": (0, 0, 8, 8),
    "no brighter than black": (20, 0, 8, 8),
    "give camera, daylight": (0, 0, 1, 8),
    "give camera, daylight, an illuminant, three": (np.nan, 0, 8, 8),
    "give camera, daylight, an illuminant": (np.inf, 10, 20, 20),
    "unknown; did you mean D65": "D66",
    "between 500 K": "99 K",
}


@pytest.mark.parametrize("message", WRONG)
def test_a_white_balance_that_cannot_be_is_one_clear_error(message):
    raw = flat(1000, 4000, 2000)
    raw.dn[:8, :8], raw.dn[:8, 20:28] = WHITE, BLACK
    with pytest.raises(PhotositeError, match=f"develop.white_balance = .*{message}"):
        develop(raw, white_balance=WRONG[message])


def test_white_balance_changes_nothing_in_a_mono_frame():
    raw = random_frame(96, 128, "MONO")
    for choice in ("A", (0, 0, 8, 8), (2.0, 1.0, 1.0)):
        np.testing.assert_array_equal(develop(raw, white_balance=choice), develop(raw))


def own_colour(picture, cfa):
    height, width = picture.shape[:2]
    colour = np.tile(np.array(["RGB".index(letter) for letter in cfa]).reshape(2, 2), (height // 2, width // 2))
    return np.take_along_axis(picture, colour[..., None], axis=2)[..., 0]


@pytest.mark.parametrize("cfa", ["RGGB", "BGGR", "GRBG", "GBRG"])
@pytest.mark.parametrize("demosaic", DEMOSAICS)
def test_metric_development_keeps_every_photosites_own_colour(cfa, demosaic):
    raw = random_frame(96, 128, cfa)
    picture = develop(raw, output="metric", demosaic=demosaic)
    assert picture.dtype == np.float32
    signal = (raw.dn.astype(np.float32) - np.float32(BLACK)) / np.float32(WHITE - BLACK)
    assert signal.min() < -0.02, "below black, too"
    np.testing.assert_array_equal(own_colour(picture, cfa), signal)


@pytest.mark.parametrize("cfa", ["RGGB", "BGGR", "GRBG", "GBRG"])
@pytest.mark.parametrize("demosaic", DEMOSAICS)
def test_metric_development_of_differing_black_levels_divides_by_each_photosites_own_range(cfa, demosaic):
    """The two greens as well: black is told by place."""
    raw = random_frame(96, 128, cfa, black_offsets_dn=(-400.0, -100.0, 250.0, 400.0))
    picture = develop(raw, output="metric", demosaic=demosaic)
    black = np.tile(np.array([[111, 411], [761, 911]], np.float32), (48, 64))
    signal = np.maximum(raw.dn - black, 0.0) / (np.float32(WHITE) - black)
    np.testing.assert_array_equal(own_colour(picture, cfa), signal)
    flat = dataclasses.replace(raw, dn=np.full_like(raw.dn, WHITE))
    np.testing.assert_allclose(develop(flat, output="metric", half_size=True), 1.0, atol=1e-3)


@pytest.mark.parametrize("black", [(256, 256, 256), (0, 110, 220)])
def test_metric_development_of_a_linear_file_has_the_levels_of_its_three_colours(tmp_path, black):
    """LibRaw tells four levels; the fourth belongs to no sample. Below black is kept where the three are the same."""
    samples = np.random.default_rng(3).integers(200, 16000, (60, 80, 3)).astype(np.uint16)
    (tmp_path / "linear.dng").write_bytes(linear_dng(samples, black, WHITE))
    picture = develop(tmp_path / "linear.dng", output="metric")
    least = 200 - 256 if len(set(black)) == 1 else 0
    signal = np.maximum(samples - np.array(black, np.float32), least)
    np.testing.assert_array_equal(picture, signal / (np.float32(WHITE) - np.array(black, np.float32)))


def test_metric_development_of_a_dark_frame_keeps_its_mean():
    dn = np.random.default_rng(1).normal(BLACK, 8.0, (400, 300)).round().astype(np.uint16)
    picture = develop(random_frame(400, 300, dn=dn), output="metric", demosaic="linear")
    # A half code is lost where LibRaw divides; clipping at black would give +3.2 DN.
    assert picture.mean() * (WHITE - BLACK) == pytest.approx(dn.mean() - BLACK, abs=0.5)


def test_metric_development_agrees_with_the_truth_twin():
    """A noise-free frame of even patches: own colours within the rounding to a code, patches within a thousandth."""
    patches = np.random.default_rng(4).uniform(0.1, 1.0, (3, 4, 3))
    scene = band_scene(np.kron(patches, np.ones((10, 10, 1))), interpolation="nearest")
    camera = small_camera(200, 150, "RGGB", black_level_dn=512.0, bit_depth=14)
    raw = simulate(Shot(scene, ThinLens(50.0, 4.0, 2.0, cos4=False), Exposure(3e-2), camera, truth=("rgb",)))
    assert 0.1 < raw.truth["rgb"].max() < 1.0
    picture = develop(raw, output="metric", demosaic="linear")
    half_code = 0.5001 / (raw.white_level_dn - raw.black_level_dn)
    assert np.abs(own_colour(picture - raw.truth["rgb"], "RGGB")).max() <= half_code
    inner = [array.reshape(3, 50, 4, 50, 3)[:, 8:-8, :, 8:-8] for array in (picture, raw.truth["rgb"])]
    assert np.abs(inner[0] - inner[1]).max() < 1e-3


def test_other_codes_develop_like_a_frame_that_holds_them():
    one, other = random_frame(seed=1), random_frame(seed=2)
    np.testing.assert_array_equal(develop(one, codes=other.dn), develop(other))
    with pytest.raises(PhotositeError, match=r"frame: codes are uint16 \(4, 4\), the mosaic uint16 \(96, 128\)"):
        develop(one, codes=np.zeros((4, 4), np.uint16))


@pytest.mark.parametrize("cfa", ["GBRG", "MONO"])
def test_other_codes_are_of_the_whole_frame_or_of_its_active_area(cfa):
    one, other = (random_frame(cfa=cfa, seed=seed, active_area=(2, 2, 94, 126)) for seed in (1, 2))
    expected = develop(other)
    for codes in (other.dn, other.dn[other.active]):
        np.testing.assert_array_equal(develop(one, codes=codes), expected)


def test_a_metric_picture_is_not_lightened():
    with pytest.raises(PhotositeError, match="develop.exposure_ev = 1: metric output is not lightened"):
        develop(random_frame(), output="metric", exposure_ev=1)
