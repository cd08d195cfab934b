"""Raw files of cameras are refused wherever a picture is read, and the command that the message tells makes a scene of one."""

import shlex
import struct

import numpy as np
import pytest
import tifffile
from helpers.dng_edits import with_tags
from helpers.picture_files import put, random_codes
from helpers.raw_frame import NEUTRAL, random_frame

from simulator.command_line.main import main
from simulator.errors import PhotositeError
from simulator.exposure.vector_maps import BlenderVectors, VectorMap
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes
from simulator.scene.deep import DeepScene
from simulator.scene.depth import DepthImage
from simulator.scene.image import ImageScene
from simulator.scene.layered import LayeredScene, PictureLayer
from simulator.scene.spectral_cube import SpectralCubeScene

MOSAIC, LINEAR_RAW = 32803, 34892


def refused(key):
    return pytest.raises(PhotositeError, match=rf"^{key} = .*: is a raw file of a camera.*photosite develop ")


@pytest.mark.parametrize("name", ["a.dng", "a.DNG", "a.tif", "preview.tiff", "a"])
def test_a_dng_is_refused_by_what_it_holds(tmp_path, name):
    """Its first directory is a preview, which OpenImageIO reads without a word."""
    (tmp_path / name).write_bytes(dng_bytes(random_frame()))
    with refused(r"scene\.image"):
        ImageScene(tmp_path / name, 100.0).load()


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [MOSAIC, LINEAR_RAW])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_other_raw_files_are_tiff_with_a_mosaic_in_or_below_the_first_directory(tmp_path, order, kind, place):
    """As NEF and ARW are, under a name of pictures: the first directory is the mosaic, or one of those below a preview."""
    with tifffile.TiffWriter(tmp_path / "a.tif", byteorder=order) as file:
        codes = random_codes(16, 16, np.uint16)
        mosaic = codes[..., 0] if kind == MOSAIC else codes
        for index in range(place + 1):
            below = {"subifds": place} if index == 0 else {}
            if index == place:
                file.write(mosaic, photometric=kind, **below)
            else:
                file.write(codes, photometric="rgb", **below)
    with refused(r"scene\.image"):
        ImageScene(tmp_path / "a.tif", 100.0).load()


def test_a_canon_raw_file_is_known_by_its_mark(tmp_path):
    """A preview, and CR before the first directory."""
    whole = bytearray(put(tmp_path / "a.tif", random_codes()).read_bytes())
    (first,) = struct.unpack("<I", whole[4:8])
    (entries,) = struct.unpack("<H", whole[first : first + 2])
    directory = whole[first : first + 2 + 12 * entries + 4]
    (tmp_path / "a.tif").write_bytes(b"II*\0" + struct.pack("<I", len(whole)) + b"CR\2\0" + whole[12:] + directory)
    with refused(r"scene\.image"):
        ImageScene(tmp_path / "a.tif", 100.0).load()


@pytest.mark.parametrize("suffix", [".cr3", ".RAF", ".nef", ".ARW", ".rw2", ".orf"])
def test_other_kinds_are_refused_by_their_suffix(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(b"FUJIFILMCCD-RAW")
    with refused(r"scene\.image"):
        ImageScene(tmp_path / f"a{suffix}", 100.0).load()


def test_pictures_with_smaller_ones_below_are_read(tmp_path):
    pixels = random_codes(16, 24)
    with tifffile.TiffWriter(tmp_path / "a.tif") as file:
        file.write(pixels, photometric="rgb", subifds=2)
        file.write(pixels[::2, ::2], photometric="rgb")
        file.write(pixels[::4, ::4], photometric="rgb")
    assert ImageScene(tmp_path / "a.tif", 100.0).load().planes.shape == (16, 24, 3)


def test_a_damaged_tiff_is_called_damaged(tmp_path):
    (tmp_path / "a.tif").write_bytes(b"II*\0\xff\xff\xff\x7f")
    with pytest.raises(PhotositeError, match=r"a\.tif: cannot be read .*damaged"):
        ImageScene(tmp_path / "a.tif", 100.0).load()


def test_every_key_that_reads_a_picture_refuses_them(tmp_path):
    raw = tmp_path / "a.dng"
    raw.write_bytes(dng_bytes(random_frame()))
    picture = put(tmp_path / "a.png", random_codes(4, 4))
    with refused(r"scene\.depth\.image"):
        ImageScene(picture, 100.0, depth_m=DepthImage(raw)).load()
    for layer, key in ((PictureLayer(raw, 2.0), "image"), (PictureLayer(picture, 2.0, alpha_image=raw), "alpha_image")):
        with refused(rf"scene\.layers\.0\.{key}"):
            LayeredScene((layer,), 100.0).load()
    with refused(r"scene\.spectral_cube"):
        SpectralCubeScene(raw).load()
    with refused(r"scene\.deep"):
        DeepScene(raw, 100.0).load()
    for vectors in (VectorMap(raw, "px/s"), BlenderVectors(raw, "Vector")):
        with refused(r"motion\.vectors\.image"):
            vectors.load((4, 4), 0.1)


def test_the_told_command_makes_a_scene_in_proportion_to_light(tmp_path, capsys):
    """Grey steps in white-balanced codes; 1 is the white level of the colour that the balance lifts least."""
    steps = np.array([0.05, 0.1, 0.3, 0.5])  # of the white level, seen by green
    share = np.repeat(steps, 32)[None] * np.ones((64, 1))
    frame = random_frame(64, 128, "RGGB")
    span_dn = frame.white_level_dn - frame.black_level_dn
    balance = np.array([[NEUTRAL[0], NEUTRAL[1]], [NEUTRAL[1], NEUTRAL[2]]])[np.arange(64)[:, None] % 2, np.arange(128) % 2]
    codes = np.rint(frame.black_level_dn + span_dn * share * balance).astype(np.uint16)
    raw = tmp_path / "a frame.dng"
    raw.write_bytes(dng_bytes(random_frame(64, 128, "RGGB", dn=codes)))
    with pytest.raises(PhotositeError) as told:
        ImageScene(raw, 100.0).load()
    words = shlex.split(str(told.value).split("run ")[1])
    assert words[:2] == ["photosite", "develop"]
    with pytest.raises(SystemExit):
        main(words[1:])
    made = tmp_path / "a frame.exr"
    assert capsys.readouterr().out.strip() == str(made)
    scene = ImageScene(made, 100.0).load()
    found = scene.planes.reshape(64, 4, 32, 3)[16:48, :, 8:24].mean(axis=(0, 2))
    assert not scene.notes and found == pytest.approx(np.repeat(steps[:, None], 3, axis=1), abs=2e-3)


def test_a_dng_without_its_version_is_known_by_its_mosaic(tmp_path):
    content = with_tags(dng_bytes(random_frame()), {}, {Tag.DNG_VERSION}, raw_directory=False)
    (tmp_path / "a.tif").write_bytes(content)
    with refused(r"scene\.image"):
        ImageScene(tmp_path / "a.tif", 100.0).load()
