"""Killed, out of space, not allowed: no half shard under its name, one message, and the same bytes in the end."""

import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from helpers import shard_run
from helpers.shard_run import PLAN, make_samples, run
from helpers.toy_shards import mosaic_options

from data_gen.storage.manifest import verify
from data_gen.storage.shards import finished_shards, sha256_of, write_shard
from data_gen.storage.writers.writer import FORMATS, find_writer
from simulator.atomic_files import LEFTOVER, atomic_folder
from simulator.errors import PhotositeError

ROOT = Path(__file__).parents[3]


def visible(folder) -> set[str]:
    return {path.name for path in folder.iterdir() if not path.name.startswith(LEFTOVER)}


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_killed_in_the_middle_of_a_shard_a_rerun_ends_with_the_same_bytes(tmp_path, name):
    folder, whole = tmp_path / "killed", tmp_path / "whole"
    run(whole, name)
    process = subprocess.Popen(
        [sys.executable, shard_run.__file__, folder, name], env=os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    )
    second = f"shard-00001-of-00004{find_writer(name).suffix}"
    # Kill it when the first shard is there and the second is being written.
    first = folder / f"shard-00000-of-00004{find_writer(name).suffix}.record.json"
    for _ in range(20_000):
        if first.exists() and list(folder.glob(f"{LEFTOVER}*")):
            break
        assert process.poll() is None
        time.sleep(0.002)
    else:
        pytest.fail("the run did not come to its second shard")
    process.send_signal(signal.SIGKILL)
    process.wait()
    there = set(finished_shards(folder, verify=True))
    assert 0 in there and len(there) < 4 and "manifest.json" not in visible(folder)
    assert second not in visible(folder) or 1 in there or sha256_of(folder / second) == sha256_of(whole / second)
    assert run(folder, name) == [index for index in range(4) if index not in there]
    assert verify(folder) == [] and sha256_of(folder) == sha256_of(whole)
    assert not list(folder.glob(f"{LEFTOVER}*"))


@pytest.fixture
def small_disk(tmp_path):
    """A file system of one MiB."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", place], capture_output=True)
    if mounted.returncode:
        pytest.skip("a small file system can only be mounted by root, outside a locked container")
    yield place
    subprocess.run(["umount", "--lazy", place], check=True)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_a_full_disk_is_one_message_and_leaves_what_was_finished(small_disk, name):
    size = {"height": 192, "width": 256}  # a shard takes 600 to 1000 kB
    with pytest.raises(
        PhotositeError, match=r"shard-0000\d-of-00004.*cannot be written.*(space|choose another disk)"
    ) as caught:
        run(small_disk, name, **size)
    assert "\n" not in str(caught.value)
    there = finished_shards(small_disk, verify=True)
    assert len(there) <= 2 and "manifest.json" not in visible(small_disk)
    assert visible(small_disk) == {record.name for record in there.values()} | {
        f"{record.name}.record.json" for record in there.values()
    }
    assert not list(small_disk.glob(f"{LEFTOVER}*"))


def test_a_read_only_disk_is_one_message(small_disk):
    subprocess.run(["mount", "-o", "remount,ro", small_disk], check=True)
    for name in ("webdataset", "npz"):
        with pytest.raises(PhotositeError, match="shard-00000-of-00004.*the disk is read-only: choose another folder"):
            run(small_disk / "set", name)


def test_a_folder_below_a_file_is_one_message(tmp_path):
    (tmp_path / "file").write_text("")
    for name in ("webdataset", "npz"):
        with pytest.raises(PhotositeError, match="shard-00000-of-00004.*is a file, not a folder: choose another folder"):
            run(tmp_path / "file" / "set", name)


@pytest.mark.parametrize("name", ["npz", "webdataset"])
def test_workers_that_make_the_same_shard_do_not_harm_each_other(tmp_path, name):
    """A scheduler that loses sight of a worker gives its shard to another, and both may finish."""

    def make(_):
        return write_shard(
            tmp_path, PLAN[0], find_writer(name), make_samples(PLAN[0].indices, 0.0, {}), mosaic_options(name), "abc"
        )

    first = make(0)
    with ThreadPoolExecutor(4) as pool:
        assert set(pool.map(make, range(40))) == {first}
    assert finished_shards(tmp_path, "abc", verify=True) == {0: first} and len(os.listdir(tmp_path)) == 2


def test_a_folder_appears_whole_or_not_at_all(tmp_path):
    with atomic_folder(tmp_path / "a") as temporary:
        temporary.mkdir()
        (temporary / "one").write_text("first")
        assert not (tmp_path / "a").exists()
    with pytest.raises(ValueError), atomic_folder(tmp_path / "a") as temporary:
        temporary.mkdir()
        (temporary / "one").write_text("second")
        raise ValueError
    assert (tmp_path / "a" / "one").read_text() == "first" and visible(tmp_path) == {"a"} == set(os.listdir(tmp_path))
    with atomic_folder(tmp_path / "a") as temporary:
        temporary.mkdir()
        (temporary / "two").write_text("third")
    assert os.listdir(tmp_path) == ["a"] and os.listdir(tmp_path / "a") == ["two"]
    (tmp_path / "file").write_text("")
    with pytest.raises(PhotositeError, match="file: cannot be written: it is not a folder"):
        with atomic_folder(tmp_path / "file"):
            pass
