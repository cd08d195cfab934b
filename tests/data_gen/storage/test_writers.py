"""What every format keeps: each bit of a sample, the same bytes each time, and the size that was announced."""

import hashlib
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from helpers.toy_samples import same, toy_sample
from helpers.toy_shards import toy_options, write_toy_shard

from data_gen.storage.shards import Shard, sha256_of, write_shard
from data_gen.storage.writers.writer import FORMATS, WriterOptions, find_writer
from simulator.errors import PhotositeError

LOSSLESS = sorted(set(FORMATS) - {"eld", "dng"})
STACKED = ("hdf5", "zarr")
ROOT = Path(__file__).parents[3]
IN_A_NEW_PROCESS = """
import sys; sys.path[:0] = ["tests"]
from pathlib import Path
from helpers.toy_shards import write_toy_shard
import data_gen.storage.writers.writer, os
print(write_toy_shard(Path(sys.argv[1]), sys.argv[2]).sha256)
"""
# A worker makes whichever shards come to it, so what it wrote before must not matter.
AFTER_OTHERS = """
import sys; sys.path[:0] = ["tests"]
from pathlib import Path
from helpers.toy_shards import write_toy_shard
folder, name, before = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3])
for index in range(before):
    write_toy_shard(folder / f"other{index}", name, 5 + 30 * index, height=32 + 32 * index, variance=index % 2 == 0)
print(write_toy_shard(folder / "it", name).sha256)
"""


@pytest.mark.parametrize("channels", ["mosaic", "rgbg"])
@pytest.mark.parametrize("frames", [1, 3])
@pytest.mark.parametrize("name", LOSSLESS)
def test_samples_read_back_bit_for_bit(tmp_path, name, frames, channels):
    wanted = [toy_sample(index, frames=frames, cfa="GBRG", variance=frames == 1) for index in (7, 8, 9)]
    find_writer(name).write(tmp_path / "shard", wanted, WriterOptions(channels))
    back = list(find_writer(name).read(tmp_path / "shard", [2, 0, 1]))
    assert all(map(same, back, (wanted[2], wanted[0], wanted[1])))


@pytest.mark.parametrize("first", [999_999_998, 10**9])
@pytest.mark.parametrize("name", LOSSLESS)
def test_samples_around_the_first_index_of_ten_digits_read_back(tmp_path, name, first):
    shard = Shard(0, 1, first, 4)
    record = write_shard(tmp_path, shard, find_writer(name), map(toy_sample, shard.indices))
    back = list(find_writer(name).read(tmp_path / record.name, [3, 0, 1, 2]))
    assert all(map(same, back, [toy_sample(first + place) for place in (3, 0, 1, 2)]))


def test_names_of_a_shard_sort_by_index(tmp_path):
    shard = Shard(0, 1, 999_999_998, 4)
    name = write_shard(tmp_path, shard, find_writer("webdataset"), map(toy_sample, shard.indices)).name
    with tarfile.open(tmp_path / name) as archive:
        names = archive.getnames()
    assert names == sorted(names) and names[0] == "0999999998.clean.npy"


def test_lmdb_refuses_samples_whose_names_do_not_sort(tmp_path):
    with pytest.raises(ValueError, match=r"key 1000000000\.clean\.npy does not sort behind the one before it"):
        find_writer("lmdb").write(tmp_path / "shard", map(toy_sample, (10**9 - 1, 10**9)), WriterOptions())


@pytest.mark.parametrize("name", LOSSLESS)
def test_what_is_not_known_stays_unknown(tmp_path, name):
    wanted = [toy_sample(index, cfa="MONO", color_matrix=None, variance=False) for index in range(2)]
    find_writer(name).write(tmp_path / "shard", wanted, WriterOptions())
    assert all(map(same, find_writer(name).read(tmp_path / "shard", [0, 1]), wanted))


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_the_bytes_are_the_same_in_a_new_process(tmp_path, name):
    # Another time zone, hash seed, umask and processor's BLAS: what often reaches files.
    environment = {"PATH": "/usr/bin:/bin", "PYTHONHASHSEED": "77", "TZ": "Asia/Tokyo", "PYTHONPATH": str(ROOT)}
    environment |= {"OPENBLAS_CORETYPE": "Prescott"}
    command = [sys.executable, "-c", IN_A_NEW_PROCESS, str(tmp_path / "there"), name]
    finished = subprocess.run(command, cwd=ROOT, env=environment, umask=0o077, capture_output=True, text=True, check=True)
    assert finished.stdout.split()[-1] == write_toy_shard(tmp_path / "here", name).sha256


@pytest.mark.parametrize("name", STACKED)
def test_the_bytes_do_not_depend_on_what_memory_held_or_was_written_before(tmp_path, name):
    here = write_toy_shard(tmp_path / "here", name).sha256
    for before in (0, 3):
        # glibc fills memory with this byte where it is asked for, and with its complement where it is given back.
        environment = os.environ | {"MALLOC_PERTURB_": str(85 + before), "PYTHONPATH": str(ROOT)}
        command = [sys.executable, "-c", AFTER_OTHERS, str(tmp_path / str(before)), name, str(before)]
        finished = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
        assert finished.stdout.split()[-1] == here, before


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_shards_with_other_samples_have_other_bytes(tmp_path, name):
    assert write_toy_shard(tmp_path / "a", name, 3).sha256 != write_toy_shard(tmp_path / "b", name, 3, bit_depth=12).sha256


@pytest.mark.parametrize("frames", [1, 2])
@pytest.mark.parametrize("name", sorted(FORMATS))
def test_the_announced_size_is_right_within_three_percent(tmp_path, name, frames):
    frames = 1 if name == "eld" else frames
    record = write_toy_shard(tmp_path, name, 40, height=96, width=160, frames=frames)
    announced = 40 * find_writer(name).bytes_per_sample(toy_sample(0, height=96, width=160, frames=frames), toy_options(name))
    assert announced == pytest.approx(record.bytes, rel=0.03)


@pytest.mark.parametrize("name", STACKED)
def test_stacking_formats_refuse_a_sample_of_another_size(tmp_path, name):
    with pytest.raises(PhotositeError, match="sample 1: .*24, 34.*one size.*webdataset"):
        find_writer(name).write(tmp_path / "shard", [toy_sample(0), toy_sample(1, width=34)], WriterOptions())


def test_an_unknown_format_and_a_missing_library_are_told(monkeypatch):
    with pytest.raises(PhotositeError, match="writer.format = tfrecord: give one of webdataset"):
        find_writer("tfrecord")
    monkeypatch.setattr("data_gen.storage.writers.writer.find_spec", lambda name: None)
    with pytest.raises(PhotositeError, match=r"hdf5: needs h5py: pip install 'photosite\[dataset\]'"):
        find_writer("hdf5")
    assert find_writer("webdataset").suffix == ".tar"


def test_a_fingerprint_of_a_file_is_its_sha256(tmp_path):
    record = write_toy_shard(tmp_path, "webdataset", 2)
    assert record.sha256 == sha256_of(tmp_path / record.name)
    assert record.sha256 == hashlib.sha256((tmp_path / record.name).read_bytes()).hexdigest()
