"""The layout that ELD trains from, read as its LMDBDataset reads it."""

import pickle

import lmdb
import numpy as np
import pytest
from helpers.toy_samples import toy_sample

from data_gen.samples.packing import pack
from data_gen.storage.writers.eld import WRITER
from data_gen.storage.writers.writer import WriterOptions
from simulator.errors import PhotositeError


def read_as_eld(folder):
    """Frames 0 to 1 of one database, as ELD's loader gives them."""
    meta = pickle.loads((folder / "meta_info.pkl").read_bytes())
    with lmdb.open(str(folder), max_readers=1, readonly=True, lock=False, readahead=False, meminit=False) as database:
        with database.begin() as transaction:
            count = transaction.stat()["entries"]
            stored = [transaction.get(f"{index:08}".encode("ascii")) for index in range(count)]
    assert meta["dtype"] == np.uint16
    return [np.clip(np.frombuffer(one, meta["dtype"]).reshape(*meta["shape"]) / 65535, 0, 1) for one in stored], meta


def test_eld_reads_amplified_clipped_frames_in_its_order(tmp_path):
    wanted = [toy_sample(index, cfa="BGGR") for index in (40, 41)]
    WRITER.write(tmp_path / "shard", wanted, WriterOptions("rgbg"))
    noisy, meta = read_as_eld(tmp_path / "shard" / "noisy")
    clean, _ = read_as_eld(tmp_path / "shard" / "clean")
    assert len(noisy) == len(clean) == 2 and meta["shape"] == (4, 12, 16)
    for place, sample in enumerate(wanted):
        signal = (pack(sample.noisy_dn[0], "BGGR", "rgbg").astype(np.float64) - 512) / (16383 - 512)
        np.testing.assert_allclose(noisy[place], np.clip(signal * sample.exposure_ratios[0], 0, 1), rtol=0, atol=0.51 / 65535)
        signal = (pack(sample.clean_dn[0], "BGGR", "rgbg").astype(np.float64) - 512) / (16383 - 512)
        np.testing.assert_allclose(clean[place], np.clip(signal, 0, 1), rtol=0, atol=0.51 / 65535)
        white_balance, matrix = meta[place]
        np.testing.assert_array_equal(white_balance, [2.1, 1.0, 1.57, 1.0])
        np.testing.assert_allclose(matrix @ np.ones(3), 1.0, rtol=1e-9)
    assert noisy[0].min() == 0.0 and noisy[0].max() == 1.0


def test_codes_come_back_as_far_as_the_layout_keeps_them(tmp_path):
    sample = toy_sample(3, exposure_ratios=(2.0,))
    WRITER.write(tmp_path / "shard", [sample], WriterOptions("rgbg"))
    back = next(WRITER.read(tmp_path / "shard", [0]))
    half_white = 512 + (16383 - 512) // 2
    np.testing.assert_array_equal(back.noisy_dn, np.clip(sample.noisy_dn, 512, half_white + 1))
    assert back.variance_dn2 is None and back.frame_seeds == sample.frame_seeds


def test_what_the_layout_cannot_hold_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="writer.channels = rggb: ELD reads R, G1, B, G2; set rgbg"):
        WRITER.write(tmp_path / "a", [toy_sample(0)], WriterOptions("rggb"))
    with pytest.raises(PhotositeError, match="sample 0: 3 frames.*use lmdb"):
        WRITER.write(tmp_path / "b", [toy_sample(0, frames=3)], WriterOptions("rgbg"))
    with pytest.raises(PhotositeError, match="sample 1: .*one size"):
        WRITER.write(tmp_path / "c", [toy_sample(0), toy_sample(1, width=36)], WriterOptions("rgbg"))
