"""The manifest is last, tells all, and finds every byte that changed; samples read back through it."""

import json
import pickle

import pytest
from helpers.toy_samples import same, toy_sample
from helpers.toy_shards import write_toy_folder

from data_gen.storage.manifest import read_manifest, verify, write_manifest
from data_gen.storage.reading import SampleFolder, read_samples
from data_gen.storage.shards import finished_shards
from data_gen.storage.writers.writer import FORMATS, WriterOptions
from simulator.errors import PhotositeError


def test_a_manifest_tells_shards_counts_and_problems_and_no_time(tmp_path):
    write_toy_folder(tmp_path / "a")
    write_toy_folder(tmp_path / "b")
    manifest = json.loads((tmp_path / "a" / "manifest.json").read_text())
    assert (tmp_path / "a" / "manifest.json").read_bytes() == (tmp_path / "b" / "manifest.json").read_bytes()
    about = (manifest["samples"], manifest["format"], manifest["channels"], manifest["dataset"])
    assert about == (7, "webdataset", "mosaic", "abc")
    assert [(shard["first"], shard["count"]) for shard in manifest["shards"]] == [(0, 3), (3, 3), (6, 1)]
    assert manifest["bytes"] == sum((tmp_path / "a" / shard["name"]).stat().st_size for shard in manifest["shards"])
    assert (manifest["problem_count"], manifest["problems"]) == (2, ["a.png: cannot be read", "b.png: is grey"])
    assert read_manifest(tmp_path / "a")["shards"] == list(finished_shards(tmp_path / "a").values())


def test_a_manifest_waits_for_the_last_shard(tmp_path):
    plan = write_toy_folder(tmp_path, only=(0, 2))
    with pytest.raises(PhotositeError, match="1 of 3 shards are not there, the first is 1.*again"):
        write_manifest(tmp_path, plan, "abc", WriterOptions())
    assert verify(tmp_path) == [
        f"{tmp_path / 'manifest.json'}: is missing: the data set is not complete; run the same command again"
    ]


def test_verify_finds_what_changed_and_lets_the_next_run_mend_it(tmp_path):
    plan = write_toy_folder(tmp_path)
    assert verify(tmp_path) == []
    first, second, third = (tmp_path / record.name for record in read_manifest(tmp_path)["shards"])
    content = bytearray(first.read_bytes())
    content[700] ^= 16
    first.write_bytes(content)
    second.write_bytes(second.read_bytes()[:-512])
    third.unlink()
    (tmp_path / "shard-00009-of-00010.tar").write_bytes(b"other")
    seen = []
    problems = verify(tmp_path, lambda what, share: seen.append((what, share)))
    assert (
        seen[-1] == ("shards, 3 of 3", 1.0)
        and len(seen) == 3
        and [line.split(": ")[1][:22] for line in problems]
        == [
            "its SHA-256 is not tha",
            problems[1].split(": ")[1][:22],
            "is missing; run the sa",
            "is no part of this dat",
        ]
    )
    assert f"{second}: has " in problems[1] and finished_shards(tmp_path) == {}
    (tmp_path / "shard-00009-of-00010.tar").unlink()
    write_toy_folder(tmp_path)
    assert verify(tmp_path) == [] and len(plan) == 3


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_samples_of_any_format_read_back_by_index(tmp_path, name):
    write_toy_folder(tmp_path, name)
    folder = pickle.loads(pickle.dumps(SampleFolder(tmp_path)))
    assert len(folder) == 7 and [sample.index for sample in folder.read()] == list(range(7))
    assert [sample.index for sample in folder] == list(range(7))
    assert [sample.index for sample in read_samples(tmp_path, [6, 0, 4, 3, 0])] == [6, 0, 4, 3, 0]
    if name not in ("eld", "dng"):
        assert same(folder[5], toy_sample(5))


def test_what_is_not_there_is_told(tmp_path):
    with pytest.raises(PhotositeError, match="holds no data set"):
        SampleFolder(tmp_path)
    write_toy_folder(tmp_path, only=(0, 2))
    folder = SampleFolder(tmp_path)
    assert list(folder.indices) == [0, 1, 2, 6]
    for index in (3, -1, 7):
        with pytest.raises(PhotositeError, match=f"has no sample {index}; it holds 4"):
            folder[index]


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_a_damaged_shard_is_one_message(tmp_path, name):
    write_toy_folder(tmp_path, name)
    shard = tmp_path / read_manifest(tmp_path)["shards"][0].name
    for path in [shard] if shard.is_file() else [path for path in shard.rglob("*") if path.is_file()]:
        path.write_bytes(b"x" * path.stat().st_size)
    with pytest.raises(PhotositeError, match="shard-00000.*--verify|shard-00000.*LibRaw"):
        SampleFolder(tmp_path)[1]
    assert SampleFolder(tmp_path)[3].index == 3
