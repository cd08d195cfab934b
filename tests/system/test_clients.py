"""Other raw converters open the DNGs: the bit-exact ones give back every code, the others the right picture.

`make test-clients` installs them. A test of one that is missing is skipped and says which.
"""

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import OpenImageIO
import pytest
from helpers.dng_variants import PICTURES, UPRIGHT, as_stored, code_frames, picture_frame
from helpers.flat_patches import SRGB_TO_XYZ, patch_means
from helpers.fresh_reader import libraw_codes
from helpers.raw_frame import COLOR_MATRIX, random_frame

from simulator.raw.development import develop, srgb_encoded
from simulator.raw.dng.areas import masked_areas
from simulator.raw.dng.writer import write_dng
from simulator.sensor.camera.cfa import Cfa

pytestmark = pytest.mark.clients

PATTERNS = (
    "GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG",
    "RRGG/RRGG/GGBB/GGBB",
    "RRRGGG/RRRGGG/RRRGGG/GGGBBB/GGGBBB/GGGBBB",
    "RCCB",
    "RGWB",
    "WGWR/GWRW/WBWG/BWGW",
)
ADOBE = """
import sys, dngpy, numpy as np
found = {}
for path in sys.argv[2:]:
    file = dngpy.Dng(path)
    found[path] = np.squeeze(file.raw_pixels)
    found[path + ":cfa"] = file.get_bayer_pattern() or "MONO"  # it names no larger pattern and none with clear photosites
    found[path + ":neutral"] = file.get_white_balance()
np.savez(sys.argv[1], **found)
"""


def needs(program: str, package: str):
    """Skip without a program, saying where it comes from."""
    return pytest.mark.skipif(
        shutil.which(program) is None, reason=f"{program} is missing; Debian and Ubuntu: apt install {package}"
    )


def run(*command, **environment: str) -> tuple[bytes, str]:
    """Standard output and standard error of a command that succeeds; validators warn on the latter and still succeed."""
    done = subprocess.run(command, capture_output=True, env=os.environ | environment, timeout=120)
    assert done.returncode == 0, done.stdout.decode() + done.stderr.decode()
    return done.stdout, done.stderr.decode()


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """Files of every pattern, size, depth, payload, orientation, level and edge: path -> frame."""
    folder = tmp_path_factory.mktemp("frames")
    found = {str(folder / f"{name}.dng"): raw for name, raw in code_frames().items()}
    for path, raw in found.items():
        write_dng(raw, path)
    return found


def test_a_fresh_libraw_reads_back_every_code(frames, tmp_path):
    found = libraw_codes(frames, tmp_path)
    for path, raw in frames.items():
        np.testing.assert_array_equal(found[path], raw.dn[raw.active], err_msg=path)


@needs("dcraw", "dcraw")
def test_dcraw_reads_back_every_code_and_turns_the_picture(frames):
    """It takes ActiveArea for the frame, and 1 to 8 for the way to an upright view."""
    for path, raw in frames.items():
        out, problems = run("dcraw", "-D", "-4", "-c", path)
        assert problems == ""
        upright = UPRIGHT[raw.format.orientation](raw.dn[raw.active])
        kind, size, most, codes = out.split(b"\n", 3)
        assert (kind, size.split(), most) == (b"P5", [b"%d" % side for side in upright.shape[::-1]], b"65535"), path
        np.testing.assert_array_equal(np.frombuffer(codes, ">u2").reshape(upright.shape), upright, err_msg=path)


@pytest.mark.skipif(find_spec("dngpy") is None, reason="dngpy is missing; pip install 'photosite[clients]'")
def test_adobes_sdk_reads_back_every_code_pattern_and_neutral(frames, tmp_path):
    _, problems = run(sys.executable, "-c", ADOBE, tmp_path / "found.npz", *frames)
    assert problems == ""
    found = np.load(tmp_path / "found.npz")
    for path, raw in frames.items():
        np.testing.assert_array_equal(found[path], raw.dn, err_msg=path)
        assert found[f"{path}:cfa"] == raw.cfa
        if raw.cfa != "MONO":
            np.testing.assert_allclose(found[f"{path}:neutral"], raw.as_shot_neutral, rtol=1e-6)


@pytest.mark.skipif(find_spec("dngpy") is None, reason="dngpy is missing; pip install 'photosite[clients]'")
@pytest.mark.parametrize("cfa", PATTERNS)
def test_adobes_sdk_reads_back_every_code_of_other_patterns(cfa, tmp_path):
    letters = Cfa.named(cfa).letters
    white = COLOR_MATRIX.sum(axis=0)
    matrix = np.stack([white if letter in "CW" else COLOR_MATRIX["RGB".index(letter)] for letter in letters])
    neutral = (0.5, 1.0, 0.625, 0.9)[: len(letters)]
    profile = ((2e-4, 3e-7),) * len(letters)
    raw = random_frame(96, 128, cfa, color_matrix=matrix, as_shot_neutral=neutral, noise_profile=profile)
    path = str(tmp_path / "frame.dng")
    write_dng(raw, path)
    _, problems = run(sys.executable, "-c", ADOBE, tmp_path / "found.npz", path)
    assert problems == ""
    found = np.load(tmp_path / "found.npz")
    np.testing.assert_array_equal(found[path], raw.dn)
    np.testing.assert_allclose(found[f"{path}:neutral"], neutral, rtol=1e-6)


@needs("exiftool", "libimage-exiftool-perl")
def test_exiftool_validates_every_file_without_a_warning(frames):
    out, problems = run("exiftool", "-validate", "-warning", "-error", "-a", "-q", *frames)
    lines = [line for line in out.decode().splitlines() if not line.startswith("========")]
    assert problems == ""
    assert lines == ["Validate                        : OK"] * len(frames)


@needs("exiftool", "libimage-exiftool-perl")
def test_exiftool_reads_levels_edges_and_orientation(frames):
    tags = ("Orientation", "BlackLevel", "WhiteLevel", "ActiveArea", "MaskedAreas", "DefaultCropSize")
    out, _ = run("exiftool", "-j", "-n", *(f"-SubIFD:{tag}" for tag in tags[1:]), "-IFD0:Orientation", *frames)
    for found, raw in zip(json.loads(out), frames.values(), strict=True):
        path, edged = found["SourceFile"], raw.active_area is not None
        assert (found["Orientation"], found["WhiteLevel"]) == (raw.format.orientation, raw.white_level_dn), path
        blacks = [raw.black_level_dn + offset for offset in raw.black_offsets_dn]
        told = [float(word) for word in str(found["BlackLevel"]).split()]
        assert told == (blacks if len(told) == 4 else blacks[:1]) and (len(told) == 4 or not any(raw.black_offsets_dn)), path
        assert found.get("ActiveArea") == (" ".join(map(str, raw.edges)) if edged else None), path
        masked = " ".join(str(edge) for area in masked_areas(raw) for edge in area)
        assert found.get("MaskedAreas") == (masked if edged else None), path
        (width, height), (rows, columns) = map(int, found["DefaultCropSize"].split()), raw.dn[raw.active].shape
        assert 0 < width < columns and 0 < height < rows, path


@needs("exiv2", "exiv2")
def test_exiv2_reads_exposure_levels_noise_and_orientation_without_a_warning(frames):
    for path, raw in frames.items():
        out, problems = run("exiv2", "-Pkv", "-g", "Exif", "pr", path)
        assert problems == "", path
        values = dict(line.split(maxsplit=1) for line in out.decode().splitlines() if len(line.split(maxsplit=1)) == 2)
        assert (values["Exif.Photo.ExposureTime"], values["Exif.Photo.FNumber"]) == ("1/125", "14/5")
        assert values["Exif.Photo.ISOSpeedRatings"] == "400"
        assert int(values["Exif.Image.Orientation"]) == raw.format.orientation
        assert int(values["Exif.SubImage1.WhiteLevel"]) == raw.white_level_dn
        noise = [float(word) for word in values["Exif.SubImage1.NoiseProfile"].split()]
        np.testing.assert_allclose(noise, np.ravel(raw.noise_profile), rtol=1e-5)  # exiv2 prints six digits


def picture_of(path) -> np.ndarray:
    """A developed picture as float32, full scale 1."""
    opened = OpenImageIO.ImageInput.open(str(path))
    assert opened is not None, f"{path}: no picture came out"
    return np.asarray(opened.read_image("float"))


def by_darktable(path, folder) -> np.ndarray:
    """Linear sRGB by darktable, without the looks it adds to every picture."""
    own = ["--configdir", folder / "config", "--cachedir", folder / "cache", "--library", ":memory:", "--disable-opencl"]
    plain = ["--conf", "plugins/darkroom/workflow=none", "--conf", "plugins/imageio/format/tiff/bpp=32"]
    to = ["--icc-type", "LIN_REC709", "--apply-custom-presets", "0"]
    run("darktable-cli", path, folder / "a.tif", *to, "--core", *own, *plain)
    return picture_of(folder / "a.tif")


def by_rawtherapee(path, folder) -> np.ndarray:
    """sRGB by RawTherapee with its neutral profile."""
    here = {"RT_SETTINGS": str(folder / "config"), "RT_CACHE": str(folder / "cache")}
    run("rawtherapee-cli", "-o", folder / "a.tif", "-b16", "-t", "-Y", "-c", path, **here)
    return picture_of(folder / "a.tif")


def colour_gains(raw) -> np.ndarray:
    """What R, G and B gain where a converter divides each by white minus its own black, instead of all by one span."""
    span = raw.white_level_dn - raw.black_level_dn
    gains = [[span / (span - offset) for letter, offset in zip(raw.cfa, raw.black_offsets_dn, strict=True) if letter == colour]
             for colour in "RGB"]  # fmt: skip
    return np.array([np.mean(mine) for mine in gains])


def with_gains(shown: np.ndarray, gains: np.ndarray) -> np.ndarray:
    """Linear sRGB after gains on the camera's own colours."""
    to_camera = COLOR_MATRIX @ SRGB_TO_XYZ
    return (shown @ to_camera.T * gains) @ np.linalg.inv(to_camera).T


@pytest.mark.slow
@needs("darktable-cli", "darktable")
@pytest.mark.parametrize("name", PICTURES)
def test_darktable_develops_the_patches_to_their_linear_colours(tmp_path, name):
    """Within 1e-4 of full scale, in the size of DefaultCrop and upright; darktable 4.2.1 is 3.6e-5 off.

    It divides each colour by white minus its own black (DNG 1.4: by white minus the largest). In orientations 2, 3 and 4,
    its picture lacks the last row and column.
    """
    raw, shown = picture_frame(name)
    write_dng(raw, tmp_path / "a.dng")
    picture, orientation = by_darktable(tmp_path / "a.dng", tmp_path), raw.format.orientation
    size = np.subtract(raw.dn[raw.active].shape, 16 + (orientation in (2, 3, 4)))
    stored = as_stored(picture, orientation)
    assert stored.shape == (*size, 3)
    expected = with_gains(shown, colour_gains(raw)) if any(raw.black_offsets_dn) else shown
    np.testing.assert_allclose(patch_means(stored), expected, rtol=0, atol=1e-4)


@pytest.mark.slow
@needs("rawtherapee-cli", "rawtherapee")
@pytest.mark.parametrize("name", PICTURES)
def test_rawtherapee_develops_the_patches_to_their_colours(tmp_path, name):
    """Within 5e-4 of full scale, sRGB-encoded; RawTherapee 5.9 is 1.8e-4 off. Two runs of it differ, so never compare bytes.

    It cuts 4 pixels off each side of a Bayer frame, and shows the mirrored orientations 2, 4, 5 and 7 as they are stored.
    It divides each colour by white minus its own black, then all by white minus red's. Where the two greens have different
    blacks its picture is wrong by more, 4.9e-3 here.
    """
    raw, shown = picture_frame(name)
    write_dng(raw, tmp_path / "a.dng")
    orientation = raw.format.orientation if raw.format.orientation in (3, 6, 8) else 1
    stored = as_stored(by_rawtherapee(tmp_path / "a.dng", tmp_path), orientation)
    assert stored.shape == (*np.subtract(raw.dn[raw.active].shape, 0 if raw.cfa == "MONO" else 8), 3)
    gains = colour_gains(raw) if any(raw.black_offsets_dn) else np.ones(3)
    expected = srgb_encoded(with_gains(shown, gains * gains[0]))
    error = np.abs(patch_means(stored) - expected).max()
    if "greens apart" in name:
        assert 1e-3 < error < 1e-2
    else:
        assert error < 5e-4


@pytest.mark.parametrize("name", PICTURES)
def test_libraw_develops_the_patches_to_their_linear_colours(name):
    """Within 1e-4 of full scale; LibRaw 0.22.2 is 3.3e-5 off. It divides all colours by white minus the least black."""
    raw, shown = picture_frame(name)
    # Full scale is white in the channel with the smallest multiplier, which is the largest of AsShotNeutral, 1.
    picture = develop(raw, output="linear_srgb")
    assert picture.shape == (*raw.dn[raw.active].shape, 3)
    np.testing.assert_allclose(patch_means(picture / 65535), shown, rtol=0, atol=1e-4)
