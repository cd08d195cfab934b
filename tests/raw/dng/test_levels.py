"""Black and white levels as a DNG tells them, and how the camera was held."""

import dataclasses
import io
import math
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.camera_builders import small_camera
from helpers.dng_variants import UPRIGHT
from helpers.fresh_reader import libraw_codes
from helpers.raw_frame import random_frame
from helpers.scene_builders import band_scene

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.development import develop
from simulator.raw.dng.tags import Tag
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.raw_format import RawFormat
from simulator.raw.raw_reader import read_raw_file
from simulator.sensor.camera.camera import IsoSetting, Window
from simulator.sensor.camera.hdr_readout import Companding, HdrReadout
from simulator.sensor.stages.digital_gain import DigitalGain

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
OFFSETS = (-11.0, -1.0, 9.0, 19.0)


def raw_tags(raw) -> dict:
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        return {tag.code: (tag.dtype.name, tag.count, tag.value) for tag in file.pages[0].pages[0].tags.values()}


@pytest.mark.parametrize("cfa", CFAS[:4])
def test_libraw_finds_each_place_of_the_block_its_own_black(tmp_path, cfa):
    raw = random_frame(97, 131, cfa, black_level_dn=511, black_offsets_dn=OFFSETS)
    assert raw_tags(raw)[Tag.BLACK_LEVEL_REPEAT_DIM] == ("SHORT", 2, (2, 2))
    assert raw_tags(raw)[Tag.BLACK_LEVEL] == ("SHORT", 4, (500, 510, 520, 530))
    write_dng(raw, tmp_path / "a.dng")
    np.testing.assert_array_equal(libraw_codes([tmp_path / "a.dng"], tmp_path)[str(tmp_path / "a.dng")], raw.dn)
    with rawpy.imread(str(tmp_path / "a.dng")) as frame:
        by_place = np.array(frame.black_level_per_channel)[frame.raw_pattern]
    np.testing.assert_array_equal(by_place, [[500, 510], [520, 530]])


@pytest.mark.parametrize("cfa", CFAS[:4])
def test_libraw_subtracts_from_each_photosite_the_black_of_its_place(cfa):
    dark = np.tile([[500, 510], [520, 530]], (24, 32)).astype(np.uint16)
    raw = dataclasses.replace(random_frame(48, 64, cfa, black_offsets_dn=OFFSETS), dn=dark + 100)
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        picture = frame.postprocess(no_auto_scale=True, output_color=rawpy.ColorSpace.raw, gamma=(1, 1), no_auto_bright=True,
                                    output_bps=16, user_flip=0)  # fmt: skip
    np.testing.assert_array_equal(picture, 100)


def test_a_fractional_black_makes_all_four_rational():
    raw = random_frame(black_offsets_dn=(0.0, 0.25, 0.0, 0.0))
    assert raw_tags(raw)[Tag.BLACK_LEVEL] == ("RATIONAL", 4, (511, 1, 2045, 4, 511, 1, 511, 1))


@pytest.mark.parametrize("white", [900, 16383, 60000])
def test_white_below_and_above_the_data_is_told_and_changes_no_code(white):
    raw = random_frame(bit_depth=16, black_level_dn=511, white_level_dn=white)
    raw = dataclasses.replace(raw, dn=np.clip(raw.dn, 0, 16383))
    with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
        assert frame.white_level == white
        np.testing.assert_array_equal(frame.raw_image_visible, raw.dn)


REFUSED = {
    "black_level = 511 DN: black lies from 0 up to below the white level, 511 DN": dict(white_level_dn=511),
    "black_level = -1 DN: black lies from 0": dict(black_offsets_dn=(0.0, 0.0, 0.0, -512.0)),
    "white_level = 4096 DN: lies outside the codes 1 to 4095 of 12 bits": dict(
        bit_depth=12, white_level_dn=4096, format=RawFormat("packed")
    ),
    "black_offsets_dn = .*each place": dict(black_offsets_dn=(1.0, 2.0)),
}


@pytest.mark.parametrize("message", REFUSED)
def test_levels_that_no_reader_takes_are_refused_before_anything_is_written(tmp_path, message):
    with pytest.raises(PhotositeError, match=message):
        write_dng(random_frame(**REFUSED[message]), tmp_path / "a.dng")
    assert list(tmp_path.iterdir()) == []


def dark_frame(window, told, **settings):
    """A frame of no light and no noise of a camera whose colours differ in the dark."""
    iso_table = {100: IsoSetting(1.0, 0.0, color_bias_dn=(-8.0, 3.0, 5.0, 10.0))}  # R, G beside R, G beside B, B
    camera = small_camera(64, 48, "GRBG", black_level_dn=100.0, iso_table=iso_table, window=window, **settings)
    lens = ThinLens(50.0, 8.0, cos4=False)
    shot = Shot(
        band_scene(np.zeros((4, 4, 3)), math.inf), lens, Exposure(0.02, 100), camera, raw=RawFormat(black_per_place=told)
    )
    return simulate(shot)


@pytest.mark.parametrize(("x", "y"), [(0, 0), (1, 0), (0, 1), (3, 5)])
def test_told_per_place_the_black_levels_are_the_codes_of_the_dark(tmp_path, x, y):
    raw = dark_frame(Window(x, y, 40, 30), told=True)
    block = np.roll([[103, 92], [110, 105]], (-y % 2, -x % 2), (0, 1))  # GRBG: G beside R, R, B, G beside B
    np.testing.assert_array_equal(raw.dn, np.tile(block, (15, 20)))
    write_dng(raw, tmp_path / "a.dng")
    np.testing.assert_array_equal(read_raw_file(tmp_path / "a.dng").black_level_dn, block)


def test_digital_gain_stretches_what_the_black_levels_differ():
    raw = dark_frame(None, told=True, stages={"digital_gain": DigitalGain(2.0, 100.0)})
    assert raw.black_offsets_dn == (6.0, -16.0, 20.0, 10.0)
    np.testing.assert_array_equal(raw.dn[:2, :2], [[106, 84], [120, 110]])


def test_left_alone_the_file_tells_the_camera_s_one_level():
    raw = dark_frame(None, told=False)
    assert raw_tags(raw)[Tag.BLACK_LEVEL] == ("SHORT", 4, (100,) * 4)


@pytest.mark.parametrize("orientation", UPRIGHT)
def test_converters_turn_the_picture_and_the_codes_stay(orientation):
    raw = random_frame(96, 128, "GBRG", format=RawFormat(orientation=orientation))
    pictures = []
    for options in ({}, {"user_flip": 0}):
        with rawpy.imread(io.BytesIO(dng_bytes(raw))) as frame:
            np.testing.assert_array_equal(frame.raw_image_visible, raw.dn)
            pictures.append(frame.postprocess(half_size=True, no_auto_bright=True, **options))
    np.testing.assert_array_equal(pictures[0], UPRIGHT[orientation](pictures[1]))


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_exiftool_takes_every_orientation_and_level(tmp_path):
    frames = [random_frame(format=RawFormat(orientation=orientation)) for orientation in UPRIGHT]
    frames += [random_frame(cfa=cfa, black_offsets_dn=offsets) for cfa in CFAS for offsets in (OFFSETS, (0.25, 0.0, 0.0, 0.0))]
    paths = [str(tmp_path / f"{number}.dng") for number in range(len(frames))]
    for raw, path in zip(frames, paths, strict=True):
        write_dng(raw, path)
    done = subprocess.run(["exiftool", "-validate", "-warning", "-error", "-a", "-q", *paths], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("========")]
    assert (done.stderr, lines) == ("", ["Validate                        : OK"] * len(paths))
    done = subprocess.run(["exiftool", "-s3", "-n", "-q", "-Orientation", *paths[:8]], capture_output=True, text=True)
    assert [line for line in done.stdout.splitlines() if not line.startswith("=")] == [str(number) for number in UPRIGHT]


def test_a_shot_file_says_how_the_camera_was_held(tmp_path):
    text = "scene: {chart: grey_ramp, luminance: 100 cd/m^2}\nlens: {focal_length: 50 mm, f_number: 4}\n"
    text += "exposure: {time: 1/100 s, iso: 100}\ncamera: ideal\n"
    (tmp_path / "a.yaml").write_text(text + "raw: {orientation: 6, black_per_place: true}\n")
    assert load_shot(tmp_path / "a.yaml").raw == RawFormat(orientation=6, black_per_place=True)
    (tmp_path / "b.yaml").write_text(text + "raw: {orientation: 9}\n")
    with pytest.raises(PhotositeError, match=r"b\.yaml:5.*raw\.orientation = 9: give a whole number from 1 to 8"):
        load_shot(tmp_path / "b.yaml")


@pytest.mark.parametrize(("payload", "cfa"), [("uncompressed", "RGGB"), ("packed", "GBRG"), ("lossless_jpeg", "MONO")])
def test_a_companded_frame_is_decoded_by_the_table_in_the_file(tmp_path, payload, cfa):
    """12 bits are stored; LibRaw gives back the combined signal, whose levels are those of light, and so does tifffile."""
    companding = Companding(12, ((1024.0, 1024.0), (8192.0, 2048.0)))
    table = {100: IsoSetting(0.08, 1.3), 1600: IsoSetting(1.28, 2.0)}
    readout = HdrReadout(gains=(1.0, 0.0625), companding=companding)
    camera = small_camera(128, 96, cfa, bit_depth=12, black_level_dn=64.0, iso_table=table, hdr_readout=readout)
    ramp = np.repeat(np.geomspace(1e-5, 1.0, 128)[None], 96, axis=0)
    scene = band_scene(ramp if cfa == "MONO" else np.repeat(ramp[..., None], 3, axis=2), math.inf)
    shot = Shot(scene, ThinLens(50.0, 8.0, cos4=False), Exposure(1e-3, 1600), camera, raw=RawFormat(payload))
    brightest = float(simulate(shot).mean_electrons.max())
    raw = simulate(dataclasses.replace(shot, exposure=Exposure(1e-3 * 60000.0 / brightest, 1600)))
    write_dng(raw, tmp_path / "a.dng")
    with rawpy.imread(str(tmp_path / "a.dng")) as frame:
        decoded, white, black = frame.raw_image.copy(), frame.white_level, set(frame.black_level_per_channel)
    np.testing.assert_array_equal(decoded, raw.dn)
    assert (white, raw.white_level_dn, raw.dn.max()) == (64560, 64560, 64560) and black == {64}
    found = raw_tags(raw)
    assert found[Tag.LINEARIZATION_TABLE][:2] == ("SHORT", 4096)
    np.testing.assert_array_equal(found[Tag.LINEARIZATION_TABLE][2], companding.decoding(64560))
    assert found[Tag.BITS_PER_SAMPLE][2] == (16 if payload == "uncompressed" else 12)
    if payload == "uncompressed":
        with tifffile.TiffFile(tmp_path / "a.dng") as file:
            stored = file.pages[0].pages[0].asarray()
        assert stored.max() == 4095
        np.testing.assert_array_equal(companding.decoding(64560)[stored], raw.dn)
    if cfa == "RGGB":
        developed, planes = develop(raw, output="metric"), np.tile([[0, 1], [1, 2]], (48, 64))
        own = np.take_along_axis(developed, planes[..., None], axis=2)[..., 0]
        np.testing.assert_allclose(own, (raw.dn.astype(np.float32) - 64.0) / 64496.0, atol=1e-6)
    step = np.interp(raw.noise_free_dn, [0, 1024, 1025, 8192, 8193], [1, 1, 7, 7, 28])
    noise = np.where(raw.noise_free_dn < 3692, 2.0, 1.3 * 16)
    assert (np.abs(raw.dn - raw.noise_free_dn) < 5.5 * noise + 0.5 * step + 8.5).all()


def test_a_code_that_the_table_does_not_hold_is_refused():
    raw = random_frame(48, 64, bit_depth=10, linearization=np.arange(0, 2048, 2, dtype=np.uint16), white_level_dn=2046)
    with pytest.raises(PhotositeError, match="is none that the linearization table decodes to"):
        dng_bytes(raw)
