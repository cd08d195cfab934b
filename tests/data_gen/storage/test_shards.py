"""Shards appear whole, are counted once, and are made again when anything about them is wrong."""

import hashlib
import subprocess

import pytest
from helpers.toy_samples import same, toy_sample

from data_gen.storage.shards import Shard, finished_shards, plan_shards, sha256_of, shard_name, write_shard
from data_gen.storage.writers.writer import find_writer
from simulator.errors import PhotositeError

NPZ = find_writer("npz")
SHARD = Shard(1, 3, 2, 2)


def samples(shard=SHARD):
    return (toy_sample(index) for index in shard.indices)


def test_a_plan_covers_every_sample_once():
    plan = plan_shards(10, 4)
    assert [list(shard.indices) for shard in plan] == [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9]]
    assert {(shard.index, shard.shards) for shard in plan} == {(0, 3), (1, 3), (2, 3)}
    with pytest.raises(PhotositeError, match="count = 0"):
        plan_shards(0, 4)
    with pytest.raises(PhotositeError, match="writer.samples_per_shard = 0"):
        plan_shards(10, 0)


def test_names_sort_by_index():
    assert shard_name(3, 12, ".tar") == "shard-00003-of-00012.tar"
    names = [shard_name(index, 100001, "") for index in (0, 99999, 100000)]
    assert names == sorted(names)


def test_a_written_shard_is_finished_and_reads_back(tmp_path):
    record = write_shard(tmp_path, SHARD, NPZ, samples(), dataset="abc")
    assert record.name == "shard-00001-of-00003-npz" and (record.first, record.count) == (2, 2)
    assert finished_shards(tmp_path, "abc", verify=True) == {1: record}
    assert record.bytes == sum(path.stat().st_size for path in (tmp_path / record.name).iterdir())
    back = list(NPZ.read(tmp_path / record.name, [1, 0]))
    assert same(back[0], toy_sample(3)) and same(back[1], toy_sample(2))
    assert sorted(path.name for path in tmp_path.iterdir()) == [record.name, f"{record.name}.record.json"]


def test_a_fingerprint_is_what_sha256sum_says(tmp_path):
    (tmp_path / "a").write_bytes(b"abc")
    assert sha256_of(tmp_path / "a") == hashlib.sha256(b"abc").hexdigest()
    write_shard(tmp_path, SHARD, NPZ, samples())
    command = r"find . -type f -printf '%P\n' | LC_ALL=C sort | xargs sha256sum | sha256sum"
    folder = tmp_path / "shard-00001-of-00003-npz"
    printed = subprocess.run(command, shell=True, cwd=folder, capture_output=True, text=True, check=True).stdout
    assert sha256_of(folder) == printed.split()[0]


def test_a_shard_that_changed_is_not_finished(tmp_path):
    record = write_shard(tmp_path, SHARD, NPZ, samples())
    file = next((tmp_path / record.name).glob("*.npz"))
    content = bytearray(file.read_bytes())
    content[-1] ^= 1
    file.write_bytes(content)
    assert set(finished_shards(tmp_path)) == {1} and finished_shards(tmp_path, verify=True) == {}
    file.write_bytes(content[:-1])
    assert finished_shards(tmp_path) == {}
    assert write_shard(tmp_path, SHARD, NPZ, samples()) == record
    (tmp_path / f"{record.name}.record.json").write_text("{")
    assert finished_shards(tmp_path) == {}


def test_a_shard_of_another_configuration_is_refused(tmp_path):
    write_shard(tmp_path, SHARD, NPZ, samples(), dataset="abc")
    with pytest.raises(PhotositeError, match="shard-00001.*another configuration.*empty folder"):
        finished_shards(tmp_path, "xyz")


@pytest.mark.parametrize(
    ("indices", "message"),
    [((2,), "end before 3"), ((2, 3, 4), "sample 4 came where None"), ((3, 2), "sample 3 came where 2 belongs")],
)
def test_wrong_samples_leave_nothing_behind(tmp_path, indices, message):
    with pytest.raises(PhotositeError, match=message):
        write_shard(tmp_path, SHARD, NPZ, map(toy_sample, indices))
    assert list(tmp_path.iterdir()) == []
