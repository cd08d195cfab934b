"""Photographs back to camera signal: every step against float64 and by hand, constants against the paper, bad files by name."""

from dataclasses import replace

import colour
import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.picture_files import put, random_codes
from helpers.randomness import accept, mean_p
from helpers.raw_frame import random_frame
from scipy import optimize, stats

from data_gen.sources import inverse_isp
from data_gen.sources.camera_view import camera_view
from data_gen.sources.photographs import Photographs
from data_gen.sources.source import CleanImage
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.raw.dng.writer import dng_bytes


@pytest.fixture(scope="module")
def camera():
    return load_camera("sony_a7s2")


def smoothstep(x):
    return x * x * (3.0 - 2.0 * x)


def read(source, name, seed=0):
    return source.read(name, np.random.default_rng(seed))


def test_constants_are_those_of_the_paper():
    """Brooks et al. 2019, section 3: gains 1.9-2.4 and 1.5-1.9, 1 / N(0.8, 0.1), gamma 2.2, t = 0.9."""
    assert (inverse_isp.RED_GAIN, inverse_isp.BLUE_GAIN) == ((1.9, 2.4), (1.5, 1.9))
    assert inverse_isp.BRIGHTNESS == (0.8, 0.1) and inverse_isp.GAMMA == 2.2 and inverse_isp.INFLECTION == 0.9
    # Three of the four are in dcraw's table, in 1/10000: Sony ILCE-7R, Olympus E-P5 and kin, Sony DSC-RX100M4.
    dcraw = [
        [4913, -541, -202, -6130, 13513, 2906, -1564, 2151, 7183],
        [8380, -2630, -639, -2887, 10725, 2496, -627, 1427, 5438],
        [6596, -2079, -562, -4782, 13016, 1933, -970, 1581, 5181],
    ]
    np.testing.assert_allclose(inverse_isp.XYZ_TO_CAMERA[1:].reshape(3, 9), np.array(dcraw) / 1e4, rtol=1e-12)
    nexus_6p = inverse_isp.XYZ_TO_CAMERA[0]  # its DNG files count in 1/128
    np.testing.assert_allclose(nexus_6p * 128, np.rint(nexus_6p * 128), atol=128 * 5.1e-5)
    white = colour.XYZ_to_xy([0.95047, 1.0, 1.08883])
    derived = colour.normalised_primary_matrix(colour.RGB_COLOURSPACES["sRGB"].primaries, white)
    np.testing.assert_allclose(inverse_isp.SRGB_TO_XYZ, derived, atol=2e-7)


def test_the_tone_curve_is_undone():
    x = np.linspace(0, 1, 1001)
    np.testing.assert_allclose(inverse_isp.inverse_smoothstep(smoothstep(x)), x, atol=1e-7)
    roots = [optimize.brentq(lambda t, y=y: smoothstep(t) - y, 0, 1, xtol=1e-14) for y in (0.1, 0.37, 0.5, 0.93)]
    np.testing.assert_allclose(inverse_isp.inverse_smoothstep(np.array([0.1, 0.37, 0.5, 0.93])), roots, atol=1e-12)


def test_the_gamma_is_undone():
    y = np.linspace(0, 1, 101)
    np.testing.assert_allclose(np.maximum(inverse_isp.expand_gamma(y), 0) ** (1 / 2.2), np.maximum(y, 1e-8), rtol=1e-12)


def test_the_matrix_is_a_convex_mixture_and_keeps_white():
    draw = np.random.default_rng(3)
    for _ in range(20):
        mixed = inverse_isp.mix_matrix(draw)
        shares, residual = optimize.nnls(inverse_isp.XYZ_TO_CAMERA.reshape(4, 9).T, mixed.ravel())
        assert residual < 1e-12 and shares.sum() == pytest.approx(1)
        np.testing.assert_allclose(inverse_isp.to_balanced_camera(mixed) @ np.ones(3), 1, rtol=1e-12)


def test_gains_and_brightness_have_their_distributions():
    draw = np.random.default_rng(4)
    white = np.array([inverse_isp.draw_white(draw) for _ in range(3000)])
    brightness = np.array([inverse_isp.draw_brightness(draw) for _ in range(3000)])
    accept(
        {
            "red": stats.kstest(1 / white[:, 0], stats.uniform(1.9, 0.5).cdf).pvalue,
            "blue": stats.kstest(1 / white[:, 2], stats.uniform(1.5, 0.4).cdf).pvalue,
            "brightness": stats.kstest(brightness, stats.norm(0.8, 0.1).cdf).pvalue,
            "mean": mean_p(brightness, 0.8, 0.01),
        }
    )
    assert (white[:, 1] == 1).all()


def test_gains_spare_what_is_saturated():
    means = np.array([1.0, 0.95, 0.9, 0.7])
    for gain in (0.4, 0.8, 0.5):
        # By hand: a = 1; a = (0.05 / 0.1)^2 = 0.25; a = 0; a = 0.
        np.testing.assert_allclose(inverse_isp.inverse_gain(means, gain), [1, 0.25 + 0.75 * gain, gain, gain], rtol=1e-9)
        grey = np.linspace(0, 1, 500)
        assert (np.diff(grey * inverse_isp.inverse_gain(grey, gain)) > 0).all()
    np.testing.assert_allclose(inverse_isp.inverse_gain(means, 1.2), 1.2)  # never darker


@pytest.mark.parametrize("light", ["D65", "A"])
def test_colours_become_what_the_camera_sees_in_that_light(camera, light):
    """Surfaces lit by D65, as sRGB, against the same surfaces integrated over the light and the camera's response.

    A 3 x 3 matrix cannot be exact: Delta E of a few for a ColorChecker. Grey must be.
    """
    from simulator.color.camera_matrices import chart_reflectances
    from simulator.color.spectra import WAVELENGTHS_NM, color_matching_functions, illuminant

    surfaces, observer = chart_reflectances(WAVELENGTHS_NM), color_matching_functions()
    xyz = surfaces * illuminant("D65") @ observer / (illuminant("D65") @ observer[:, 1])
    srgb = xyz @ np.linalg.inv(inverse_isp.SRGB_TO_XYZ).T
    curves = [np.interp(WAVELENGTHS_NM, camera.response.wavelengths_nm, c, 0, 0) for c in camera.response.quantum_efficiency.T]
    photons = np.stack(curves, axis=-1) * (illuminant(light) * WAVELENGTHS_NM)[:, None]
    seen = surfaces @ photons / photons.sum(axis=0)
    found = srgb @ inverse_isp.to_balanced_camera_in(camera, light).T
    assert np.sqrt(np.mean((found - seen) ** 2)) < 0.03
    np.testing.assert_allclose(found[18:], seen[18:], atol=0.01)  # the six neutral patches
    np.testing.assert_allclose(inverse_isp.to_balanced_camera_in(camera, light) @ np.ones(3), 1, atol=2e-4)


def test_the_way_to_the_camera_passes_d50_as_a_converter_does(camera):
    """ForwardMatrix times ours is sRGB to XYZ under D50, whose numbers B. Lindbloom lists (his D50 is 0.82521 in Z)."""
    from simulator.color.camera_matrices import forward_matrix

    srgb_to_d50 = [[0.4360747, 0.3850649, 0.1430804], [0.2225045, 0.7168786, 0.0606169], [0.0139322, 0.0971045, 0.7141733]]
    to_icc = np.array([0.9642 / 0.96422, 1.0, 0.8249 / 0.82521])[:, None]
    forward = forward_matrix(camera.response.wavelengths_nm, camera.response.quantum_efficiency, "A")
    found = forward @ inverse_isp.to_balanced_camera_in(camera, "A")
    np.testing.assert_allclose(found, to_icc * srgb_to_d50, atol=6e-5)


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("isp", ["camera", "brooks2019"])
def test_developing_the_signal_gives_the_photograph_back(tmp_path, camera, isp, dtype):
    """Forward by a second implementation in float64: balance, matrix, gamma, smoothstep; too dim for highlights to be kept."""
    source = Photographs(tmp_path, camera, inverse_isp=isp, illuminants=("A",) if isp == "camera" else ("D65",))
    codes = random_codes(dtype=dtype) // 4 + np.iinfo(dtype).max // 3  # greyish: no channel falls below 0
    put(tmp_path / "a.png", codes)
    picture, draw = read(source, "a.png", seed=5), np.random.default_rng(5)
    if isp == "camera":
        to_balanced, encode = inverse_isp.to_balanced_camera_in(camera, "A"), colour.models.eotf_inverse_sRGB
        assert picture.color_matrix == camera_view(camera, "A").color_matrix
    else:
        to_balanced, encode = inverse_isp.to_balanced_camera(inverse_isp.mix_matrix(draw)), lambda x: x ** (1 / 2.2)
        inverse_isp.draw_white(draw)
    brightness = inverse_isp.draw_brightness(draw)
    balanced = picture.signal.astype(np.float64) * picture.white_balance
    if isp == "camera":
        balanced /= camera_view(camera, "A").white[1]
    developed = smoothstep(encode(np.maximum(balanced / brightness @ np.linalg.inv(to_balanced).T, 0)))
    largest = np.iinfo(dtype).max
    np.testing.assert_allclose(developed * largest, codes, atol=largest * 2e-6)
    assert picture.signal.dtype == np.float32 and picture.cfa is None


def test_the_matrix_told_belongs_to_the_drawn_white(tmp_path, camera):
    """XYZ of D65 through the matrix is the white that the balance makes neutral, as in DNG."""
    put(tmp_path / "a.png", random_codes())
    picture = read(Photographs(tmp_path, camera, inverse_isp="brooks2019"), "a.png")
    white = np.array(picture.color_matrix) @ inverse_isp.SRGB_TO_XYZ.sum(axis=1)
    np.testing.assert_allclose(white * picture.white_balance, 1, rtol=1e-6)


@pytest.mark.parametrize("isp", ["camera", "brooks2019"])
def test_white_stays_saturated_and_black_dark(tmp_path, camera, isp):
    put(tmp_path / "a.png", np.repeat(np.array([[[0], [255]]], np.uint8), 3, axis=2))
    for seed in range(5):
        signal = read(Photographs(tmp_path, camera, inverse_isp=isp), "a.png", seed).signal
        np.testing.assert_allclose(np.minimum(signal[0, 1], 1), 1, atol=1e-3)  # the brightness may be above 1
        assert signal[0, 0].max() < 1e-6 and signal.min() >= 0


def test_downscaling_averages_light(tmp_path, camera):
    put(tmp_path / "a.png", random_codes(13, 17))
    whole = read(Photographs(tmp_path, camera), "a.png").signal.astype(np.float64)
    half = read(Photographs(tmp_path, camera, downscale=2), "a.png").signal
    assert half.shape == (6, 8, 3)
    np.testing.assert_allclose(half[2, 3], whole[4:6, 6:8].mean(axis=(0, 1)), rtol=1e-5)


@pytest.mark.parametrize("downscale", [1, 2, 3])
@pytest.mark.parametrize("isp", ["camera", "brooks2019"])
@pytest.mark.parametrize("channels", [1, 3])
def test_a_patch_has_the_bits_of_the_whole_picture(tmp_path, camera, isp, downscale, channels):
    put(tmp_path / "a.png", random_codes(83, 97, channels=channels))
    picture = read(Photographs(tmp_path, camera, inverse_isp=isp, downscale=downscale), "a.png")
    whole = CleanImage(picture.signal, None, picture.white_balance)
    assert picture.size == whole.size == (83 // downscale, 97 // downscale)
    for top, left, height, width in ((0, 0, *whole.size), (3, 5, 17, 11), (2, 2, 16, 8), (7, 0, 1, 27)):
        np.testing.assert_array_equal(picture.cut(top, left, height, width), whole.cut(top, left, height, width))
        for cfa in ("RGGB", "GBRG"):
            found = picture.mosaic(top, left, height, width, cfa)
            np.testing.assert_array_equal(found, whole.mosaic(top, left, height, width, cfa))


@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_picture_is_turned_upright(tmp_path, camera, orientation):
    """Exif 2.3, Orientation: which sides of the scene the first stored row and the first stored column show."""
    first_row = ["top", "top", "bottom", "bottom", "left", "right", "right", "left"][orientation - 1]
    first_column = ["left", "right", "right", "left", "top", "top", "bottom", "bottom"][orientation - 1]
    scene = {"top": 10, "bottom": 60, "left": 5, "right": 100}  # codes add up: a ramp down and one to the right
    rows = (scene[first_row], scene[{"top": "bottom", "bottom": "top", "left": "right", "right": "left"}[first_row]])
    columns = (scene[first_column], scene[{"top": "bottom", "bottom": "top", "left": "right", "right": "left"}[first_column]])
    stored = np.linspace(*rows, 8).reshape(-1, 1, 1) + np.linspace(*columns, 6).reshape(1, -1, 1)
    put(tmp_path / "a.tif", np.repeat(np.rint(stored), 3, axis=2).astype(np.uint8), Orientation=orientation)
    picture = read(Photographs(tmp_path, camera), "a.tif")
    signal = picture.signal.mean(axis=2)
    assert signal.shape == ((8, 6) if orientation < 5 else (6, 8))
    assert (np.diff(signal, axis=0) > 0).all() and (np.diff(signal, axis=1) > 0).all()


@pytest.mark.parametrize("model", ["CMYK", "LAB"])
def test_other_colours_than_srgb_are_refused(tmp_path, camera, model):
    image = pytest.importorskip("PIL.Image", reason="Pillow is missing, which writes such files")
    channels = {"CMYK": 4, "LAB": 3}[model]
    image.fromarray(random_codes(channels=channels), model).save(tmp_path / "a.tif")
    names = ["a.tif"]
    if model == "CMYK":
        image.fromarray(random_codes(channels=4), model).save(tmp_path / "b.jpg")
        names.append("b.jpg")
    for name in names:
        with pytest.raises(PhotositeError, match=rf"{name}: stores C\w+ colours, which are not sRGB; convert it"):
            read(Photographs(tmp_path, camera), name)


def test_alpha_is_left_out(tmp_path, camera):
    codes = random_codes(channels=4)
    put(tmp_path / "a.png", codes, **{"oiio:UnassociatedAlpha": 1})
    put(tmp_path / "b.png", codes[..., :3])
    source = Photographs(tmp_path, camera)
    np.testing.assert_array_equal(read(source, "a.png").signal, read(source, "b.png").signal)


def test_bad_files_are_refused_by_name(tmp_path, camera):
    source = Photographs(tmp_path, camera, extensions=(".png", ".tif", ".jpg"))
    put(tmp_path / "float.tif", random_codes().astype(np.float32))
    (tmp_path / "raw.tif").write_bytes(dng_bytes(random_frame()))
    (tmp_path / "text.png").write_text("no picture")
    for name in ("cut.png", "cut.jpg"):
        whole = put(tmp_path / name, random_codes(200, 300)).read_bytes()
        (tmp_path / name).write_bytes(whole[: len(whole) // 2])
    cases = {
        "float.tif": r"float\.tif: holds float32.*linear_images",
        "raw.tif": r"^photographs = .*raw\.tif: is a raw file of a camera.* run photosite develop \S*raw\.tif$",
        "text.png": r"text\.png: cannot be read",
        "cut.png": r"cut\.png: cannot be read",
        "cut.jpg": r"cut\.jpg: cannot be read",
        "gone.png": r"gone\.png: no such file",
    }
    for name, message in cases.items():
        with pytest.raises(PhotositeError, match=message):
            read(source, name)
    put(tmp_path / "small.png", random_codes(5, 5))
    with pytest.raises(PhotositeError, match=r"small\.png: smaller than the 8 x 8 pixels"):
        read(replace(source, downscale=8), "small.png")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"downscale": 0}, "downscale = 0"),
        ({"extensions": ("png",)}, "endings in lower case"),
        ({"extensions": ()}, "extensions"),
        ({"illuminants": ("D66",)}, "no such illuminant"),
        ({"inverse_isp": "brooks2019", "illuminants": ("A",)}, "leave them out"),
        ({"camera": small_camera(cfa="MONO")}, "linear_images for a monochrome one"),
    ],
)
def test_wrong_settings_are_refused(tmp_path, camera, changes, message):
    with pytest.raises(PhotositeError, match=message):
        replace(Photographs(tmp_path, camera), **changes)


@pytest.mark.parametrize("method", ["camera", "brooks2019"])
def test_a_grey_picture_is_of_neutral_surfaces(tmp_path, camera, method):
    codes = random_codes(20, 24, channels=1)
    put(tmp_path / "grey.png", codes)
    put(tmp_path / "rgb.png", np.repeat(codes.reshape(20, 24, 1), 3, axis=2))
    pictures = [read(Photographs(tmp_path, camera, method), name) for name in ("grey.png", "rgb.png")]
    np.testing.assert_array_equal(pictures[0].signal, pictures[1].signal)
    dark = pictures[0].signal[(codes.reshape(20, 24) < 200)] * np.array(pictures[0].white_balance)
    np.testing.assert_allclose(dark / dark[:, 1:2], 1.0, rtol=2e-3)
