"""Pictures become radiance: numbers by hand, luminance by colour-science, one clear message for every bad file."""

from pathlib import Path

import colour
import numpy as np
import OpenImageIO as oiio
import pytest
from helpers.photometry import luminance_of_pixels
from helpers.picture_files import write

from simulator.color.spectra import illuminant
from simulator.errors import PhotositeError
from simulator.scene.arrays import scene_from_rgb
from simulator.scene.depth import DepthChannel, DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer

SHARED_EXR = Path(__file__).parents[3] / "shared" / "data" / "openexr-images"


def picture(channels=3, height=4, width=5, dtype=np.float32):
    return np.random.default_rng(1).random((height, width, channels)).astype(dtype)


@pytest.mark.parametrize("light", ["D65", "A", "3200 K"])
@pytest.mark.parametrize("channels", [3, 1])
def test_white_anchor_gives_rgb_one_its_luminance(tmp_path, light, channels):
    file = write(tmp_path / "white.exr", np.ones((2, 2, channels), np.float32))
    scene = ImageScene(file, luminance_cd_m2=120.0, illuminant=light).load()
    assert luminance_of_pixels(scene) == pytest.approx(np.full((2, 2), 120.0), rel=1e-5)


def test_white_has_the_spectrum_of_the_illuminant(tmp_path):
    scene = ImageScene(write(tmp_path / "a.exr", picture()), luminance_cd_m2=1.0, illuminant="A").load()
    white = scene.spectra_w_m2_sr_nm.sum(axis=0)
    assert white / white[36] == pytest.approx(illuminant("A"), rel=1e-9)
    assert np.array_equal(scene.illuminant, illuminant("A"))


def test_mean_anchor_gives_the_picture_its_mean_luminance(tmp_path):
    file = write(tmp_path / "a.exr", picture())
    scene = ImageScene(file, luminance_cd_m2=35.0, luminance_of="mean").load()
    assert luminance_of_pixels(scene).mean() == pytest.approx(35.0, rel=1e-5)


def test_radiance_is_linear_in_the_file_and_keeps_highlights(tmp_path):
    pixels = np.array([[[0.5, 0.25, 0.125], [50.0, 25.0, 12.5]]], np.float32)
    scene = ImageScene(write(tmp_path / "a.exr", pixels), luminance_cd_m2=1.0).load()
    assert np.array_equal(scene.planes, pixels) and scene.planes.dtype == np.float32
    assert scene.wavelengths_nm.shape == (81,) and scene.spectra_w_m2_sr_nm.shape == (3, 81)
    assert not scene.notes


@pytest.mark.parametrize(("model", "suffix"), [("CMYK", "tif"), ("CMYK", "jpg"), ("LAB", "tif")])
def test_other_colours_than_rgb_are_refused_and_not_taken_for_them(tmp_path, model, suffix):
    image = pytest.importorskip("PIL.Image", reason="Pillow is missing, which writes such files")
    file = tmp_path / f"a.{suffix}"
    image.fromarray(np.full((8, 8, len(model)), 100, np.uint8), model).save(file)
    rule = rf"a\.{suffix}: stores C\w+ colours, which are not sRGB; convert it"
    with pytest.raises(PhotositeError, match=rf"scene\.image = .*{rule}"):
        ImageScene(file, 100.0).load()
    with pytest.raises(PhotositeError, match=rf"scene\.layers\.0\.image = .*{rule}"):
        LayeredScene((PictureLayer(file, 1.0),), 100.0).load()


@pytest.mark.parametrize(("mode", "suffix"), [("P", "tif"), ("P", "png"), ("YCbCr", "jpg"), ("L", "jpg")])
def test_colours_that_a_reader_decodes_to_rgb_or_grey_are_read(tmp_path, mode, suffix):
    """OpenImageIO reads palettes of TIFF one code too low."""
    image = pytest.importorskip("PIL.Image", reason="Pillow is missing, which writes such files")
    grey = image.fromarray(np.full((8, 8, 3), 128, np.uint8))
    (grey.quantize() if mode == "P" else grey.convert(mode)).save(tmp_path / f"a.{suffix}")
    scene = ImageScene(tmp_path / f"a.{suffix}", 100.0, encoding="linear").load()
    np.testing.assert_allclose(scene.planes, 128 / 255, atol=1e-6 if suffix == "png" else 1.01 / 255)


@pytest.mark.parametrize("ratio", [0.5, 1.002, 2.0])
def test_a_picture_of_pixels_that_are_not_square_is_refused(tmp_path, ratio):
    file = write(tmp_path / "a.exr", picture(), PixelAspectRatio=ratio)
    message = rf"image = .*a\.exr: its pixels are {ratio:g} times as wide as high \(pixelAspectRatio\); resample it to square"
    with pytest.raises(PhotositeError, match="scene." + message):
        ImageScene(file, 100.0).load()
    with pytest.raises(PhotositeError, match="scene.depth." + message):
        ImageScene(write(tmp_path / "b.exr", picture()), 100.0, depth_m=DepthImage(file)).load()


def test_pixels_that_are_square_within_a_thousandth_are_read(tmp_path):
    found = [ImageScene(write(tmp_path / "a.exr", picture(), PixelAspectRatio=one), 100.0).load() for one in (1.0, 1.0009)]
    np.testing.assert_array_equal(found[0].planes, found[1].planes)


def test_grey_stays_one_plane_and_equals_grey_rgb(tmp_path):
    grey = picture(1)
    one = ImageScene(write(tmp_path / "g.exr", grey), luminance_cd_m2=50.0).load()
    three = ImageScene(write(tmp_path / "rgb.exr", np.repeat(grey, 3, axis=2)), luminance_cd_m2=50.0).load()
    assert one.planes.shape == (4, 5, 1)
    assert one.planes @ one.spectra_w_m2_sr_nm == pytest.approx(three.planes @ three.spectra_w_m2_sr_nm, rel=1e-6)


@pytest.mark.parametrize(("suffix", "dtype"), [("png", np.uint8), ("png", np.uint16), ("tif", np.uint16)])
def test_integer_files_are_linearised_as_srgb_and_the_log_says_so(tmp_path, suffix, dtype):
    largest = np.iinfo(dtype).max
    codes = np.array([[[0], [largest // 100], [largest // 2], [largest]]], dtype).repeat(3, axis=2)
    scene = ImageScene(write(tmp_path / f"a.{suffix}", codes), luminance_cd_m2=1.0).load()
    low, middle = largest // 100 / largest, largest // 2 / largest  # below and above the toe of IEC 61966-2-1
    assert scene.planes[0, :, 1] == pytest.approx([0, low / 12.92, ((middle + 0.055) / 1.055) ** 2.4, 1], abs=1e-7)
    assert any("sRGB" in note and "encoding: linear" in note for note in scene.notes)


def test_encoding_overrides_the_guess_both_ways(tmp_path):
    integer = write(tmp_path / "a.png", np.full((1, 1, 3), 51, np.uint8))
    scene = ImageScene(integer, luminance_cd_m2=1.0, encoding="linear").load()
    assert scene.planes[0, 0, 0] == pytest.approx(0.2, rel=1e-6) and not scene.notes
    floating = write(tmp_path / "a.exr", np.full((1, 1, 3), 0.5, np.float32))
    assert ImageScene(floating, luminance_cd_m2=1.0, encoding="srgb").load().planes[0, 0, 0] == pytest.approx(0.21404, abs=1e-5)


@pytest.mark.parametrize("dtype", ["int16", "int32", "uint32", "int64"])
def test_integers_whose_white_nothing_tells_are_refused(tmp_path, dtype):
    """Of 255 in an int64 array nothing but a black picture would be left."""
    np.save(tmp_path / "a.npy", np.full((4, 4, 3), 255, dtype))
    with pytest.raises(PhotositeError, match=f"scene.image = .*a.npy: holds {dtype}, .* give uint8, uint16 or floats"):
        ImageScene(tmp_path / "a.npy", 100.0).load()
    with pytest.raises(PhotositeError, match=f"rgb = .*holds {dtype}, .* give uint8, uint16 or floats"):
        scene_from_rgb(np.full((4, 4, 3), 255, dtype), luminance_cd_m2=100.0)


@pytest.mark.parametrize("dtype", ["u1", "u2", "f2", "f4", "f8"])
def test_either_byte_order_is_read(tmp_path, dtype):
    found = []
    for order in "<>":
        codes = picture(4) if dtype[0] == "f" else np.random.default_rng(1).integers(0, 256, (4, 5, 4))
        stored = codes.astype(order + dtype)
        np.save(tmp_path / "a.npy", stored[..., :3])
        np.save(tmp_path / "alpha.npy", stored[..., 3])
        layer = PictureLayer(tmp_path / "a.npy", 1.0, alpha_image=tmp_path / "alpha.npy")
        layered = LayeredScene((layer,), 100.0).load().layers[0]
        image = ImageScene(tmp_path / "a.npy", 100.0).load()
        found.append((image.planes, scene_from_rgb(stored[..., :3], luminance_cd_m2=100.0).planes, layered.coverage))
    for little, big in zip(*found, strict=True):
        np.testing.assert_array_equal(little, big)


def test_jpeg_and_hdr_and_npy_are_read(tmp_path):
    jpeg = write(tmp_path / "a.jpg", np.full((16, 16, 3), 128, np.uint8))
    assert ImageScene(jpeg, luminance_cd_m2=1.0).load().planes.mean() == pytest.approx(0.2159, abs=0.003)
    hdr = write(tmp_path / "a.hdr", np.full((8, 8, 3), 4.0, np.float32))
    assert ImageScene(hdr, luminance_cd_m2=1.0).load().planes == pytest.approx(np.full((8, 8, 3), 4.0), rel=0.01)
    np.save(tmp_path / "a.npy", picture())
    assert np.array_equal(ImageScene(tmp_path / "a.npy", luminance_cd_m2=1.0).load().planes, picture())


@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_alpha_is_dropped_and_colours_stay_as_stored(tmp_path, suffix):
    pixels = np.full((2, 2, 4), 255, np.uint8)
    pixels[..., 3] = 64
    attributes = {"oiio:UnassociatedAlpha": 1}
    scene = ImageScene(write(tmp_path / f"a.{suffix}", pixels, **attributes), luminance_cd_m2=1.0).load()
    assert scene.planes.shape == (2, 2, 3) and scene.planes.min() == 1.0
    assert any("alpha dropped" in note for note in scene.notes)


def test_exr_with_other_primaries_is_converted_with_white_kept(tmp_path):
    aces = colour.RGB_COLOURSPACES["ACES2065-1"]
    chromaticities = (*aces.primaries.ravel(), *aces.whitepoint)
    pixels = np.array([[[1, 1, 1], [0.4, 0.3, 0.2]]], np.float32)
    file = write(tmp_path / "a.exr", pixels, chromaticities=(oiio.TypeDesc("float[8]"), chromaticities))
    scene = ImageScene(file, luminance_cd_m2=1.0).load()
    truth = colour.RGB_to_RGB(pixels[0, 1], aces, colour.RGB_COLOURSPACES["sRGB"], chromatic_adaptation_transform="CAT02")
    assert scene.planes[0, 0] == pytest.approx([1, 1, 1], abs=1e-5)
    assert scene.planes[0, 1] == pytest.approx(truth, abs=2e-4)
    assert any("primaries" in note for note in scene.notes)


def test_a_layer_of_a_multilayer_exr_is_chosen_by_name(tmp_path):
    names = ("view.R", "view.G", "view.B", "glossy.R", "glossy.G", "glossy.B")
    pixels = picture(6)
    file = write(tmp_path / "a.exr", pixels, names)
    stored = oiio.ImageInput.open(str(file)).spec().channelnames
    scene = ImageScene(file, luminance_cd_m2=1.0, layer="glossy").load()
    assert scene.planes.shape == (4, 5, 3) and "glossy.R" in stored
    assert np.array_equal(scene.planes, pixels[..., 3:])
    with pytest.raises(PhotositeError, match="layer: and one of glossy, view"):
        ImageScene(file, luminance_cd_m2=1.0).load()


def test_constant_depth_and_field_of_view_are_passed_on(tmp_path):
    file = write(tmp_path / "a.exr", picture())
    scene = ImageScene(file, luminance_cd_m2=1.0, depth_m=2.5, field_of_view_deg=40.0).load()
    assert scene.depth_m == 2.5 and scene.field_of_view_deg == 40.0
    assert ImageScene(file, luminance_cd_m2=1.0).load().depth_m == np.inf


def test_depth_comes_from_a_channel_of_the_same_exr_and_may_be_infinite(tmp_path):
    pixels = picture(4) + 1
    pixels[0, 0, 3] = np.inf
    file = write(tmp_path / "a.exr", pixels, ("R", "G", "B", "Z"))
    scene = ImageScene(file, luminance_cd_m2=1.0, depth_m=DepthChannel()).load()
    assert np.array_equal(scene.depth_m, pixels[..., 3]) and scene.depth_m.dtype == np.float32
    assert scene.planes.shape == (4, 5, 3)
    assert any("Z is not used" in note for note in ImageScene(file, luminance_cd_m2=1.0).load().notes)


def test_depth_comes_from_a_16_bit_png_of_millimetres(tmp_path):
    depth = np.array([[[1500], [65535]]], np.uint16)
    file = write(tmp_path / "a.exr", picture(3, 1, 2))
    scene = ImageScene(file, 1.0, depth_m=DepthImage(write(tmp_path / "z.png", depth), unit="mm")).load()
    assert scene.depth_m == pytest.approx(np.array([[1.5, 65.535]]), rel=1e-6)
    half = ImageScene(file, 1.0, depth_m=DepthImage(tmp_path / "z.png", unit="mm", scale=0.5)).load()
    assert half.depth_m == pytest.approx(np.array([[0.75, 32.7675]]), rel=1e-6)


BAD_FILES = {
    "two channels": (lambda path: write(path / "a.tif", picture(2)), "2 channels"),
    "five channels": (lambda path: write(path / "a.tif", picture(5)), "5 channels"),
    "no colour": (lambda path: write(path / "a.exr", picture(2), ("U", "V")), "grey"),
    "text": (lambda path: path.joinpath("a.png").write_text("hello") and path / "a.png", "cannot be read"),
    "empty": (lambda path: path.joinpath("a.exr").write_bytes(b"") or path / "a.exr", "cannot be read"),
    "missing": (lambda path: path / "nothing.exr", "no such file"),
    "folder": (lambda path: path, "is a folder, not a file"),
    "bad npy": (lambda path: path.joinpath("a.npy").write_bytes(b"\x93NUMPY") and path / "a.npy", "cannot be read"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_a_bad_file_is_one_message_that_names_it(tmp_path, case):
    make, says = BAD_FILES[case]
    file = make(tmp_path)
    with pytest.raises(PhotositeError, match=says) as caught:
        ImageScene(file, luminance_cd_m2=1.0).load()
    assert str(file) in str(caught.value) and "scene.image" in str(caught.value)


def test_an_exr_cut_anywhere_is_one_message(tmp_path):
    whole = write(tmp_path / "a.exr", picture(3, 40, 40)).read_bytes()
    for share in (0.01, 0.1, 0.3, 0.6, 0.9, 0.99):
        (tmp_path / "cut.exr").write_bytes(whole[: int(len(whole) * share)])
        with pytest.raises(PhotositeError, match="cut.exr: cannot be read"):
            ImageScene(tmp_path / "cut.exr", luminance_cd_m2=1.0).load()


@pytest.mark.parametrize(("value", "name"), [(np.nan, "NaN"), (np.inf, "Inf"), (-np.inf, "Inf"), (-0.5, "negative radiance")])
def test_impossible_radiance_is_counted_and_located(tmp_path, value, name):
    pixels = picture()
    pixels[2, 3, 1] = pixels[2, 3, 2] = pixels[3, 0, 0] = value
    with pytest.raises(PhotositeError, match=f"{name} in 2 of 20 pixels, the first at x = 3, y = 2"):
        ImageScene(write(tmp_path / "a.exr", pixels), luminance_cd_m2=1.0).load()


def test_negative_radiance_can_be_clipped_and_is_noted(tmp_path):
    pixels = picture()
    pixels[2, 3, 1] = -0.5
    scene = ImageScene(write(tmp_path / "a.exr", pixels), luminance_cd_m2=1.0, negative="clip").load()
    assert scene.planes.min() == 0 and np.array_equal(scene.planes, np.maximum(pixels, 0))
    assert any("1 of 20 pixels" in note for note in scene.notes)


def test_a_black_picture_has_no_mean_to_scale(tmp_path):
    file = write(tmp_path / "a.exr", np.zeros((2, 2, 3), np.float32))
    with pytest.raises(PhotositeError, match="black"):
        ImageScene(file, luminance_cd_m2=1.0, luminance_of="mean").load()
    assert ImageScene(file, luminance_cd_m2=1.0).load().planes.max() == 0


@pytest.mark.parametrize(("value", "says"), [(0.0, "0 or less"), (-1.0, "0 or less"), (np.nan, "NaN")])
def test_impossible_depth_is_refused(tmp_path, value, says):
    pixels = picture(4) + 1
    pixels[1, 2, 3] = value
    file = write(tmp_path / "a.exr", pixels, ("R", "G", "B", "Z"))
    with pytest.raises(PhotositeError, match=f"{says}.* in 1 of 20 pixels, the first at x = 2, y = 1"):
        ImageScene(file, 1.0, depth_m=DepthChannel()).load()


def test_depth_of_another_size_or_channel_is_refused(tmp_path):
    file = write(tmp_path / "a.exr", picture())
    small = write(tmp_path / "z.exr", picture(1, 2, 3))
    with pytest.raises(PhotositeError, match="is 3x2 pixels, but the scene is 5x4"):
        ImageScene(file, 1.0, depth_m=DepthImage(small)).load()
    with pytest.raises(PhotositeError, match="no such channel.*has R, G, B"):
        ImageScene(file, 1.0, depth_m=DepthChannel("Z")).load()
    with pytest.raises(PhotositeError, match="scene.depth.image = .*missing.exr: no such file"):
        ImageScene(file, 1.0, depth_m=DepthImage(tmp_path / "missing.exr")).load()


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"luminance_cd_m2": 0.0}, "scene.luminance"),
        ({"luminance_cd_m2": float("nan")}, "scene.luminance"),
        ({"illuminant": "D64"}, "scene.illuminant"),
        ({"depth_m": 0.0}, "scene.depth"),
        ({"depth_m": float("nan")}, "scene.depth"),
        ({"field_of_view_deg": 180.0}, "scene.field_of_view"),
    ],
)
def test_bad_settings_are_refused_before_any_file_is_read(settings, key):
    with pytest.raises(PhotositeError, match=key):
        ImageScene(**({"image": Path("nothing.exr"), "luminance_cd_m2": 1.0} | settings))


@pytest.mark.parametrize("scale", [0.0, -1.0, float("inf")])
def test_bad_depth_scale_is_refused(scale):
    with pytest.raises(PhotositeError, match="scene.depth.scale"):
        DepthChannel(scale=scale)


def test_a_deep_exr_is_refused(tmp_path):
    spec = oiio.ImageSpec(2, 2, 3, oiio.FLOAT)
    spec.deep = True
    data = oiio.DeepData()
    data.init(4, 3, [oiio.TypeFloat] * 3, ["R", "G", "B"])
    output = oiio.ImageOutput.create(str(tmp_path / "deep.exr"))
    assert output.open(str(tmp_path / "deep.exr"), spec) and output.write_deep_image(data) and output.close()
    with pytest.raises(PhotositeError, match="deep EXR"):
        ImageScene(tmp_path / "deep.exr", luminance_cd_m2=1.0).load()


@pytest.mark.skipif(not SHARED_EXR.exists(), reason="no OpenEXR sample pictures beside the checkout")
def test_the_openexr_sample_pictures_load_or_say_why_not():
    loaded = {}
    for file in sorted(SHARED_EXR.glob("*.exr")):
        try:
            loaded[file.stem] = ImageScene(file, 100.0, negative="clip").load().planes.shape
        except PhotositeError as error:
            loaded[file.stem] = str(error)
    assert loaded["StillLife"] == (846, 1240, 3) and loaded["Desk"] == (874, 644, 3)
    assert "deep EXR" in loaded["Trunks"]
