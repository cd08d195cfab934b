import dataclasses

import numpy as np
import OpenImageIO
import pytest
from helpers.raw_frame import COLOR_MATRIX, random_frame

from simulator.errors import PhotositeError
from simulator.raw.development import DEMOSAICS, PICTURE_SUFFIXES, develop, srgb_encoded, write_image
from simulator.raw.dng.writer import dng_bytes, write_dng

# Linear sRGB to XYZ under D65 (IEC 61966-2-1), and patches inside the sRGB gamut.
SRGB_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
PATCHES = np.array(
    [
        [[0.80, 0.80, 0.80], [0.18, 0.18, 0.18], [0.02, 0.02, 0.02], [0.60, 0.10, 0.05]],
        [[0.10, 0.40, 0.10], [0.05, 0.10, 0.50], [0.70, 0.50, 0.05], [0.30, 0.55, 0.60]],
    ]
)
PATCH_PX = 32
BLACK, WHITE = 512, 16383
CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")


def chart(cfa="RGGB", **changes):
    """Patches as a camera with COLOR_MATRIX records them under D65, without noise; signal 1 is the white level."""
    to_camera = COLOR_MATRIX @ SRGB_TO_XYZ
    neutral = to_camera.sum(axis=1) / to_camera.sum(axis=1).max()
    signal = (PATCHES @ to_camera.T) / to_camera.sum(axis=1).max()
    if cfa == "MONO":
        signal, cfa_index = PATCHES.mean(axis=2, keepdims=True), np.zeros((2, 2), int)
        neutral = (1.0,)
    else:
        cfa_index = np.array(["RGB".index(letter) for letter in cfa]).reshape(2, 2)
    planes = signal.repeat(PATCH_PX, axis=0).repeat(PATCH_PX, axis=1)
    height, width = planes.shape[:2]
    colour = np.tile(cfa_index, (height // 2, width // 2))
    mosaic = np.take_along_axis(planes, colour[..., None], axis=2)[..., 0]
    dn = np.rint(BLACK + (WHITE - BLACK) * mosaic).astype(np.uint16)
    fields = dict(dn=dn, black_level_dn=BLACK, white_level_dn=WHITE, as_shot_neutral=tuple(neutral))
    return random_frame(height, width, cfa, **(fields | changes))


def patch_values(picture):
    """Mean of each patch's inner half, as a share of full scale."""
    side = picture.shape[0] // 2
    cells = picture.reshape(2, side, 4, side, 3)[:, side // 4 : -side // 4, :, side // 4 : -side // 4]
    return cells.mean(axis=(1, 3)) / np.iinfo(picture.dtype).max


@pytest.mark.parametrize("cfa", CFAS[:4])
@pytest.mark.parametrize("options", [{}, {"half_size": True}, {"demosaic": "linear"}])
def test_linear_development_gives_the_scene_within_a_thousandth(cfa, options):
    # The camera has more noise-free codes than a thousandth: what remains is LibRaw's 16-bit rounding.
    np.testing.assert_allclose(patch_values(develop(chart(cfa), output="linear_srgb", **options)), PATCHES, atol=1e-3)


def test_the_brightest_pixel_does_not_change_the_others():
    # By default LibRaw scales a picture whose largest code is above 3/4 of white by that code.
    plain = chart()
    bright = plain.dn.copy()
    bright[:4, :4] = WHITE
    one = develop(plain, output="linear_srgb", demosaic="linear")
    other = develop(dataclasses.replace(plain, dn=bright), output="linear_srgb", demosaic="linear")
    np.testing.assert_array_equal(one[8:], other[8:])


def test_srgb_output_is_the_standards_curve_not_the_video_one():
    # IEC 61966-2-1: 0.18 -> 0.4613561, 0.002 -> 0.02584. BT.709 would give 0.409 for 0.18.
    assert srgb_encoded(np.array([0.0, 0.002, 0.18, 1.0])) == pytest.approx([0.0, 0.02584, 0.4613561, 1.0], abs=1e-6)
    for bits, atol in ((16, 1.5e-3), (8, 3e-3)):
        values = patch_values(develop(chart(), output="srgb", bits=bits))
        assert values[0, 1] == pytest.approx([0.46136] * 3, abs=atol)


def test_xyz_output_is_the_scene_in_xyz():
    np.testing.assert_allclose(patch_values(develop(chart(), output="xyz")), PATCHES @ SRGB_TO_XYZ.T, atol=1.5e-3)


def test_camera_output_with_equal_multipliers_is_the_raw_signal():
    raw = chart()
    half = develop(raw, output="camera", white_balance=(1, 1, 1), half_size=True)
    signal = (raw.dn.astype(np.float64) - BLACK) / (WHITE - BLACK) * 65535
    for channel, sites in enumerate((signal[::2, ::2], (signal[::2, 1::2] + signal[1::2, ::2]) / 2, signal[1::2, 1::2])):
        np.testing.assert_allclose(half[..., channel], sites, rtol=0, atol=1.01)  # LibRaw cuts fractions off


def test_white_balance_multipliers_scale_their_channel():
    flat = chart(dn=np.full((64, 128), 512 + 4000, np.uint16))
    values = develop(flat, output="camera", white_balance=(2, 1, 1.5))[32, 64] / 65535
    assert values == pytest.approx(4000 / (WHITE - BLACK) * np.array([2, 1, 1.5]), abs=1e-4)


def test_daylight_white_balance_is_that_of_d65_whatever_the_file_says():
    expected = patch_values(develop(chart(), output="linear_srgb"))
    warm = chart(as_shot_neutral=(1.0, 0.6, 0.3))
    np.testing.assert_allclose(patch_values(develop(warm, output="linear_srgb", white_balance="daylight")), expected, atol=1e-3)
    assert np.abs(patch_values(develop(warm, output="linear_srgb")) - expected).max() > 0.05


def test_exposure_compensation_doubles_per_ev_and_clips_at_white():
    values = patch_values(develop(chart(), output="linear_srgb", exposure_ev=1.0))
    np.testing.assert_allclose(values, np.minimum(2 * PATCHES, 1.0), atol=2e-3)


def test_a_mono_frame_develops_to_three_equal_planes():
    raw = chart("MONO")
    picture = develop(raw, output="linear_srgb")
    assert picture.shape == (64, 128, 3)
    np.testing.assert_allclose(picture[..., 1], (raw.dn.astype(float) - BLACK) / (WHITE - BLACK) * 65535, rtol=0, atol=1.01)
    np.testing.assert_array_equal(picture[..., :1].repeat(3, axis=2), picture)


@pytest.mark.parametrize("cfa", ["RGGB", "MONO"])
def test_half_size_keeps_an_odd_last_row_and_column(cfa):
    picture = develop(random_frame(97, 131, cfa), half_size=True)
    assert (picture.shape, picture.dtype) == ((49, 66, 3), np.uint16)
    assert develop(random_frame(97, 131, cfa), bits=8).shape == (97, 131, 3)
    assert develop(random_frame(97, 131, cfa), bits=8).dtype == np.uint8


def test_half_size_of_a_mono_frame_is_the_mean_of_each_2x2_cell():
    dn = np.full((24, 25), BLACK, np.uint16)
    dn[:2, :2] = [[BLACK + 100, BLACK + 200], [BLACK + 300, BLACK + 400]]
    dn[:2, 24] = BLACK + 600
    raw = random_frame(24, 25, "MONO", dn=dn, black_level_dn=BLACK)
    row = develop(raw, output="linear_srgb", half_size=True)[0, :, 0] * ((WHITE - BLACK) / 65535)
    assert row == pytest.approx([250] + [0] * 11 + [600], abs=0.5)


@pytest.mark.parametrize("demosaic", DEMOSAICS)
def test_every_demosaic_named_works_and_keeps_a_flat_field_flat(demosaic):
    flat = chart(dn=np.full((64, 128), 4512, np.uint16))
    picture = develop(flat, output="camera", white_balance=(1, 1, 1), demosaic=demosaic)[16:-16, 16:-16]
    assert np.ptp(picture) <= 1 and picture.mean() == pytest.approx(4000 / (WHITE - BLACK) * 65535, abs=1.5)


def test_a_file_develops_like_the_frame_it_holds(tmp_path):
    write_dng(chart(), tmp_path / "a.dng")
    np.testing.assert_array_equal(develop(tmp_path / "a.dng"), develop(chart()))
    np.testing.assert_array_equal(develop(str(tmp_path / "a.dng")), develop(chart()))


def test_files_that_are_missing_or_no_raw_are_one_clear_error(tmp_path):
    (tmp_path / "text.dng").write_text("not a raw file, but long enough to be looked at" * 99)
    for name, message in (("none.dng", "no such file"), ("text.dng", "not a raw file"), (".", "is a folder, not a file")):
        with pytest.raises(PhotositeError, match=message):
            develop(tmp_path / name)


def test_a_file_cut_short_is_one_clear_error_wherever_it_ends(tmp_path):
    content = dng_bytes(chart())
    for length in (len(content) - 1, len(content) - 5000, len(content) // 2, 3000, 700, 300, 100, 8, 0):
        (tmp_path / "cut.dng").write_bytes(content[:length])
        with pytest.raises(PhotositeError, match=r"cut\.dng: (damaged or cut short|not a raw file)"):
            develop(tmp_path / "cut.dng")


WRONG = {
    "develop.output = 'sRGB': unknown; did you mean srgb": dict(output="sRGB"),
    "develop.demosaic = 'vgn': unknown; did you mean vng.*aahd": dict(demosaic="vgn"),
    "develop.white_balance = 'camrea': unknown; did you mean camera": dict(white_balance="camrea"),
    r"develop.white_balance = \(1, 0, 1\): give": dict(white_balance=(1, 0, 1)),
    "develop.bits = 12: give 8 or 16": dict(bits=12),
    "develop.exposure_ev = nan": dict(exposure_ev=float("nan")),
}


@pytest.mark.parametrize("message", WRONG)
def test_a_wrong_choice_names_key_value_and_the_nearest_right_one(message):
    with pytest.raises(PhotositeError, match=message):
        develop(chart(), **WRONG[message])


def test_a_mono_frame_has_no_xyz():
    with pytest.raises(PhotositeError, match="MONO sensor measures no colour"):
        develop(chart("MONO"), output="xyz")


def read(path):
    source = OpenImageIO.ImageInput.open(str(path))
    return source.read_image(source.spec().format), str(source.spec().format)


RANDOM = np.random.default_rng(3).random((20, 30, 3))


@pytest.mark.parametrize(
    ("name", "pixels", "kind", "expected"),
    [
        ("a.png", (RANDOM * 65535).astype(np.uint16), "uint16", None),
        ("a.png", (RANDOM * 255).astype(np.uint8), "uint8", None),
        ("a.PNG", RANDOM, "uint16", np.rint(RANDOM * 65535)),
        ("a.tif", (RANDOM * 65535).astype(np.uint16), "uint16", None),
        ("a.tiff", RANDOM.astype(np.float32), "float", None),
        ("a.exr", RANDOM.astype(np.float32), "float", None),
        ("a.exr", (RANDOM * 65535).astype(np.uint16), "float", ((RANDOM * 65535).astype(np.uint16) / 65535).astype(np.float32)),
        ("grey.png", (RANDOM[..., 0] * 255).astype(np.uint8), "uint8", (RANDOM[..., :1] * 255).astype(np.uint8)),
    ],
)
def test_a_picture_is_read_back_bit_for_bit(tmp_path, name, pixels, kind, expected):
    write_image(tmp_path / name, pixels)
    found, found_kind = read(tmp_path / name)
    assert found_kind == kind
    np.testing.assert_array_equal(found, pixels if expected is None else expected)


def test_a_jpeg_is_8_bit_and_near_the_picture(tmp_path):
    smooth = np.linspace(0, 65535, 64 * 64).reshape(64, 64, 1).repeat(3, axis=2).astype(np.uint16)
    write_image(tmp_path / "a.jpg", smooth)
    found, kind = read(tmp_path / "a.jpg")
    assert kind == "uint8"
    assert np.abs(found - smooth / 257).max() < 3


def test_floats_out_of_range_are_clipped_where_the_format_ends_at_1(tmp_path):
    write_image(tmp_path / "a.png", np.array([[-0.5, 0.0, 1.0, 7.0]]))
    assert read(tmp_path / "a.png")[0].ravel().tolist() == [0, 0, 65535, 65535]
    write_image(tmp_path / "a.exr", np.array([[-0.5, 0.0, 1.0, 7.0]]))
    assert read(tmp_path / "a.exr")[0].ravel().tolist() == [-0.5, 0.0, 1.0, 7.0]


@pytest.mark.parametrize(
    ("name", "pixels", "message"),
    [
        ("a.bmp", RANDOM, f"unknown kind of picture '.bmp'; use one of {', '.join(PICTURE_SUFFIXES)}"),
        ("noend", RANDOM, "unknown kind of picture ''"),
        ("a.png", np.full((4, 4, 3), np.nan), "NaN or infinite"),
        ("a.png", np.zeros((4, 4, 2)), "is no picture"),
        ("a.png", np.zeros((0, 4, 3)), "is no picture"),
        ("a.png", np.zeros((4, 4, 3), np.int32), "is no picture"),
    ],
)
def test_what_is_no_picture_is_refused_and_no_file_made(tmp_path, name, pixels, message):
    with pytest.raises(PhotositeError, match=message):
        write_image(tmp_path / name, pixels)
    assert list(tmp_path.iterdir()) == []
