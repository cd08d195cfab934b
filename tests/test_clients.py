"""Other raw converters open the DNGs: the bit-exact ones give back every code, the others the right picture.

`make test-clients` installs them. A test of one that is missing is skipped and says which.
"""

import itertools
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec

import numpy as np
import OpenImageIO
import pytest
from flat_patches import patch_frame, patch_means
from raw_frame import random_frame

from simulator.development import develop, srgb_encoded
from simulator.raw.dng import write_dng

pytestmark = pytest.mark.clients

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
SIZES = ((96, 128), (97, 131), (22, 23), (300, 22))
DEPTHS = (8, 10, 12, 14, 16)
# RawTherapee takes no file below about 100 kB for a raw file, so its frames are larger.
PICTURES = [((240, 320), cfa, 14) for cfa in CFAS] + [((241, 333), "GBRG", depth) for depth in (8, 10, 12, 16)]
PICTURES += [((241, 333), "MONO", 16)]

ADOBE = """
import sys, dngpy, numpy as np
found = {}
for path in sys.argv[2:]:
    file = dngpy.Dng(path)
    found[path] = np.squeeze(file.raw_pixels)
    found[path + ":cfa"] = file.get_bayer_pattern() or "MONO"
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
    """Files of every pattern, size and depth, no two with the same codes: path -> frame."""
    folder = tmp_path_factory.mktemp("frames")
    found = {}
    for seed, (cfa, size, depth) in enumerate(itertools.product(CFAS, SIZES, DEPTHS)):
        path = str(folder / f"{cfa}_{size[0]}_{depth}.dng")
        found[path] = random_frame(*size, cfa, depth, seed)
        write_dng(found[path], path)
    return found


@needs("dcraw", "dcraw")
def test_dcraw_reads_back_every_code(frames):
    for path, raw in frames.items():
        out, problems = run("dcraw", "-D", "-4", "-c", path)
        assert problems == ""
        np.testing.assert_array_equal(np.frombuffer(out[-2 * raw.dn.size :], ">u2").reshape(raw.dn.shape), raw.dn, err_msg=path)


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


@needs("exiftool", "libimage-exiftool-perl")
def test_exiftool_validates_every_file_without_a_warning(frames):
    out, problems = run("exiftool", "-validate", "-warning", "-error", "-a", "-q", *frames)
    lines = [line for line in out.decode().splitlines() if not line.startswith("========")]
    assert problems == ""
    assert lines == ["Validate                        : OK"] * len(frames)


@needs("exiv2", "exiv2")
def test_exiv2_reads_the_exposure_and_the_noise_without_a_warning(frames):
    for path, raw in frames.items():
        out, problems = run("exiv2", "-Pkv", "-g", "Exif", "pr", path)
        assert problems == "", path
        values = dict(line.split(maxsplit=1) for line in out.decode().splitlines() if len(line.split(maxsplit=1)) == 2)
        assert (values["Exif.Photo.ExposureTime"], values["Exif.Photo.FNumber"]) == ("1/125", "14/5")
        assert values["Exif.Photo.ISOSpeedRatings"] == "400"
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


@pytest.mark.slow
@needs("darktable-cli", "darktable")
@pytest.mark.parametrize(("size", "cfa", "depth"), PICTURES)
def test_darktable_develops_the_patches_to_their_linear_colours(tmp_path, size, cfa, depth):
    """Within 1e-4 of full scale; darktable 4.2.1 is 2.2e-5 off."""
    raw, shown = patch_frame(*size, cfa, depth)
    write_dng(raw, tmp_path / "a.dng")
    np.testing.assert_allclose(patch_means(by_darktable(tmp_path / "a.dng", tmp_path)), shown, rtol=0, atol=1e-4)


@pytest.mark.slow
@needs("rawtherapee-cli", "rawtherapee")
@pytest.mark.parametrize(("size", "cfa", "depth"), PICTURES)
def test_rawtherapee_develops_the_patches_to_their_colours(tmp_path, size, cfa, depth):
    """Within 5e-4 of full scale, sRGB-encoded; RawTherapee 5.9 is 1.8e-4 off. Two runs of it differ, so never compare bytes."""
    raw, shown = patch_frame(*size, cfa, depth)
    write_dng(raw, tmp_path / "a.dng")
    found = patch_means(by_rawtherapee(tmp_path / "a.dng", tmp_path))
    np.testing.assert_allclose(found, srgb_encoded(shown), rtol=0, atol=5e-4)


@pytest.mark.parametrize(("size", "cfa", "depth"), PICTURES)
def test_libraw_develops_the_patches_to_their_linear_colours(size, cfa, depth):
    """Within 1e-4 of full scale; LibRaw 0.22.2 is 3.3e-5 off."""
    raw, shown = patch_frame(*size, cfa, depth)
    # Full scale is white in the channel with the smallest multiplier, which is the largest of AsShotNeutral, 1.
    np.testing.assert_allclose(patch_means(develop(raw, output="linear_srgb") / 65535), shown, rtol=0, atol=1e-4)
