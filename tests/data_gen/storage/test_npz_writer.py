"""Archives that LED reads: keys, shapes, types and names as its loader takes them."""

import re

import numpy as np
import pytest
import rawpy
from helpers.raw_frame import random_frame
from helpers.toy_samples import COLOR_MATRIX, same, toy_sample

from data_gen.samples.camera_color import camera_to_srgb
from data_gen.samples.packing import pack
from data_gen.storage.writers.npz import WRITER
from data_gen.storage.writers.writer import WriterOptions
from simulator.raw.dng.writer import write_dng


def led_pair(root, line):
    """What LED's PairedRAWDataset makes of one line of its pair list: ratio, and signals 0 to 1 of both frames."""
    noisy, clean = line.split(" ")[:2]
    seconds = [float(re.search(r"_(\d+(\.\d+)?)s.", name).group(0)[1:-2]) for name in (noisy, clean.rstrip("\n"))]
    signals = []
    for name in (noisy, clean.rstrip("\n")):
        with np.load(root / f"{name}.npz") as meta:
            black, white = meta["black_level"], meta["white_level"]
            assert black.shape == white.shape == (4, 1, 1) and meta["wb"].shape == (4,) and meta["ccm"].shape == (3, 3)
            signals.append((meta["im"].astype("float32") - black) / (white - black))
    return seconds[1] / seconds[0], *signals


def test_led_reads_the_pair(tmp_path):
    sample = toy_sample(5, cfa="GBRG")
    WRITER.write(tmp_path / "shard", [toy_sample(4, cfa="GBRG"), sample], WriterOptions("rgbg"))
    lines = (tmp_path / "shard" / "pairs.txt").read_text().splitlines(keepends=True)
    ratio, noisy, clean = led_pair(tmp_path / "shard", lines[1])
    assert ratio == sample.exposure_ratios[0]
    wanted = (pack(sample.noisy_dn[0], "GBRG", "rgbg").astype(np.float64) - 512) / (16383 - 512)
    np.testing.assert_allclose(noisy, wanted, rtol=0, atol=1e-7)
    assert noisy.min() < 0  # the pedestal keeps what lies below black
    np.testing.assert_allclose(clean, (pack(sample.clean_dn[0], "GBRG", "rgbg") - 512.0) / 15871, rtol=0, atol=1e-6)
    with np.load(tmp_path / "shard" / f"{lines[1].split()[0]}.npz") as archive:
        np.testing.assert_array_equal(archive["wb"], np.array([2.1, 1.0, 1.57, 1.0], np.float32))
        assert archive["im"].dtype == np.uint16


@pytest.mark.parametrize("channels", ["mosaic", "rggb", "rgbg"])
@pytest.mark.parametrize("frames", [1, 3])
def test_samples_read_back_bit_for_bit(tmp_path, channels, frames):
    wanted = [toy_sample(index, frames=frames, cfa="GRBG", variance=index == 8) for index in (7, 8)]
    WRITER.write(tmp_path / "shard", wanted, WriterOptions(channels))
    assert all(map(same, WRITER.read(tmp_path / "shard", [0, 1]), wanted))


def test_a_sample_takes_the_bytes_that_were_announced(tmp_path):
    wanted = [toy_sample(index, frames=2) for index in range(3)]
    WRITER.write(tmp_path / "shard", wanted, WriterOptions("rgbg"))
    size = sum(path.stat().st_size for path in (tmp_path / "shard").iterdir())
    assert size == sum(WRITER.bytes_per_sample(sample, WriterOptions("rgbg")) for sample in wanted)


def test_the_colour_matrix_is_the_one_of_libraw(tmp_path):
    write_dng(random_frame(48, 64), tmp_path / "a.dng")  # with this colour matrix
    with rawpy.imread(str(tmp_path / "a.dng")) as frame:
        # LibRaw's matrix of sRGB has other sixth decimals, in float32.
        np.testing.assert_allclose(camera_to_srgb(COLOR_MATRIX), frame.color_matrix[:, :3], rtol=0, atol=1e-4)
    np.testing.assert_allclose(camera_to_srgb(COLOR_MATRIX) @ np.ones(3), 1.0, rtol=1e-12)
    np.testing.assert_array_equal(camera_to_srgb(None), np.eye(3))
    assert camera_to_srgb(COLOR_MATRIX).flags.c_contiguous  # the order is written into the file
