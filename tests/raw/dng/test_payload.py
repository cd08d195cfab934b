import dataclasses
import io
import itertools
import shutil
import subprocess

import numpy as np
import pytest
import rawpy
import tifffile
from helpers.fresh_reader import dcraw_codes, libraw_codes
from helpers.raw_frame import random_frame

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.raw import raw_format
from simulator.raw.dng.payload import pack_codes
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.raw_format import RawFormat

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
SIZES = ((96, 128), (97, 131), (22, 23))
DEPTHS = range(8, 17)
PAYLOADS = ("packed", "lossless_jpeg")


def frame(payload, *arguments, **changes):
    """A frame of random codes, stored so; the reader of a lossless JPEG is a package of its own."""
    if payload == "lossless_jpeg":
        pytest.importorskip("imagecodecs", reason="imagecodecs (extra lossless-jpeg) is not installed")
    return random_frame(*arguments, format=RawFormat(payload), **changes)


def directory(raw) -> dict:
    """Tags of the SubIFD by number."""
    with tifffile.TiffFile(io.BytesIO(dng_bytes(raw))) as file:
        return {tag.code: tag.value for tag in file.pages[0].pages[0].tags.values()}


@pytest.mark.parametrize("payload", PAYLOADS)
def test_a_fresh_libraw_reads_back_every_code_for_all_patterns_sizes_and_depths(tmp_path, payload):
    frames = {}
    for seed, (cfa, size, depth) in enumerate(itertools.product(CFAS, SIZES, DEPTHS)):
        path = str(tmp_path / f"{cfa}_{size[0]}_{depth}.dng")
        frames[path] = frame(payload, *size, cfa, depth, seed)
        write_dng(frames[path], path)
    found = libraw_codes(frames, tmp_path)
    assert len(found) == len(CFAS) * len(SIZES) * len(DEPTHS)
    for path, raw in frames.items():
        np.testing.assert_array_equal(found[path], raw.dn, err_msg=path)


@pytest.mark.skipif(shutil.which("dcraw") is None, reason="dcraw is not installed")
@pytest.mark.parametrize("payload", PAYLOADS)
@pytest.mark.parametrize(("cfa", "size"), [("RGGB", (96, 128)), ("BGGR", (97, 131)), ("MONO", (23, 22))])
def test_dcraw_reads_back_every_code(tmp_path, payload, cfa, size):
    for depth in DEPTHS:
        raw = frame(payload, *size, cfa, depth, seed=depth)
        write_dng(raw, tmp_path / "a.dng")
        np.testing.assert_array_equal(dcraw_codes(tmp_path / "a.dng", size), raw.dn, err_msg=f"{depth} bits")


def strip_tags(raw) -> tuple:
    """BitsPerSample, Compression, RowsPerStrip, StripByteCounts."""
    found = directory(raw)
    return tuple(found[code] for code in (258, 259, 278, 279))


@pytest.mark.parametrize(("depth", "bits"), list(zip(DEPTHS, (8, 10, 10, 12, 12, 14, 14, 16, 16), strict=True)))
def test_the_directory_tells_bits_compression_and_the_one_strip(depth, bits):
    assert strip_tags(frame("packed", 97, 132, "GRBG", depth)) == (bits, 1, 97, (97 * 132 * bits // 8,))
    assert strip_tags(frame("lossless_jpeg", 97, 131, "GRBG", depth))[:3] == (bits, 7, 97)


@pytest.mark.parametrize(("width", "depth", "bits"), [(130, 10, 12), (130, 12, 12), (130, 14, 16), (131, 12, 16), (131, 8, 8)])
def test_packed_rows_fill_whole_bytes_since_darktable_refuses_others(width, depth, bits):
    assert strip_tags(frame("packed", 97, width, "GRBG", depth)) == (bits, 1, 97, (97 * width * bits // 8,))


@pytest.mark.parametrize("bits", [8, 10, 12, 14])
@pytest.mark.parametrize("width", [4, 8, 24, 28])
def test_packed_codes_are_the_binary_digits_written_one_after_the_other(bits, width):
    dn = np.random.default_rng(bits * width).integers(0, 2**bits, (3, width), dtype=np.uint16)
    digits = "".join(f"{code:0{bits}b}" for code in dn.ravel())
    assert pack_codes(dn, bits).tobytes() == int(digits, 2).to_bytes(len(digits) // 8, "big")


def test_a_frame_of_16_bits_is_the_same_file_packed_or_not():
    assert dng_bytes(frame("packed", bit_depth=16)) == dng_bytes(frame("uncompressed", bit_depth=16))


@pytest.mark.parametrize("depth", [8, 10, 12, 14, 16])
def test_the_lossless_jpeg_is_process_14_with_predictor_1_which_darktable_decodes(depth):
    raw = frame("lossless_jpeg", 97, 131, bit_depth=depth)
    data = dng_bytes(raw)[directory(raw)[273][0] :]
    assert data.startswith(b"\xff\xd8")
    # ITU-T T.81: SOF3 is length 11, precision, lines, samples per line, one component; SOS ends in predictor, 0, 0.
    header = data.index(b"\xff\xc3")
    assert data[header + 2 : header + 10] == bytes([0, 11, depth, 0, 97, 0, 131, 1])
    scan = data.index(b"\xff\xda")
    assert data[scan + 7 : scan + 10] == bytes([1, 0, 0])


@pytest.mark.parametrize("payload", PAYLOADS)
def test_smooth_frames_shrink(payload):
    raw = frame(payload, 200, 300, bit_depth=12)
    smooth = dataclasses.replace(raw, dn=np.full((200, 300), 700, np.uint16))
    uncompressed = dataclasses.replace(smooth, format=RawFormat())
    limit = 0.8 if payload == "packed" else 0.1
    thumbnail = 200 * 150 * 3 // 2
    assert len(dng_bytes(smooth)) - thumbnail < limit * len(dng_bytes(uncompressed))


@pytest.mark.parametrize("payload", PAYLOADS)
def test_a_code_that_the_bits_do_not_hold_is_refused_rather_than_cut(tmp_path, payload):
    raw = frame(payload, bit_depth=12)
    wrong = dataclasses.replace(raw, dn=np.full_like(raw.dn, 4096))
    with pytest.raises(PhotositeError, match="code = 4096 DN: more than 12 bits hold; take raw.payload: uncompressed"):
        write_dng(wrong, tmp_path / "a.dng")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
@pytest.mark.parametrize("payload", PAYLOADS)
def test_exiftool_validates_without_a_warning(tmp_path, payload):
    paths = [str(tmp_path / f"{depth}.dng") for depth in DEPTHS]
    for depth, path in zip(DEPTHS, paths, strict=True):
        write_dng(frame(payload, 97, 131, "BGGR", depth), path)
    done = subprocess.run(["exiftool", "-validate", "-warning", "-error", "-a", "-q", *paths], capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if not line.startswith("========")]
    assert (done.stderr, lines) == ("", ["Validate                        : OK"] * len(paths))


def test_a_shot_file_chooses_the_payload(tmp_path):
    (tmp_path / "a.yaml").write_text(SHOT + "raw: {payload: packed}\n")
    assert load_shot(tmp_path / "a.yaml").raw == RawFormat("packed")
    assert load_shot(tmp_path / "a.yaml").resolved["raw"]["payload"] == "packed"
    (tmp_path / "b.yaml").write_text(SHOT)
    assert load_shot(tmp_path / "b.yaml").raw == RawFormat("uncompressed")


def test_an_unknown_payload_is_named_with_its_line(tmp_path):
    (tmp_path / "a.yaml").write_text(SHOT + "raw:\n  payload: zip\n")
    with pytest.raises(PhotositeError, match=r"a\.yaml:6.*raw\.payload.*zip.*lossless_jpeg"):
        load_shot(tmp_path / "a.yaml")


def test_a_missing_library_is_told_before_the_picture_is_taken(tmp_path, monkeypatch):
    monkeypatch.setattr(raw_format, "find_spec", lambda name: None)
    (tmp_path / "a.yaml").write_text(SHOT + "raw: {payload: lossless_jpeg}\n")
    with pytest.raises(PhotositeError, match=r"raw\.payload = lossless_jpeg: needs imagecodecs: pip install"):
        load_shot(tmp_path / "a.yaml")
    (tmp_path / "b.yaml").write_text(SHOT + "raw: {payload: packed}\n")
    load_shot(tmp_path / "b.yaml")


@pytest.mark.parametrize("payload", PAYLOADS)
def test_a_development_does_not_depend_on_the_payload(payload):
    raw = frame(payload, 60, 80, "GBRG", 12)
    pictures = []
    for one in (raw, dataclasses.replace(raw, format=RawFormat())):
        with rawpy.imread(io.BytesIO(dng_bytes(one))) as file:
            pictures.append(file.postprocess(adjust_maximum_thr=0.0, no_auto_bright=True, output_bps=16))
    np.testing.assert_array_equal(*pictures)


SHOT = """\
scene: {chart: grey_ramp, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: 4}
exposure: {time: 1/100 s, iso: 100}
camera: ideal
"""
