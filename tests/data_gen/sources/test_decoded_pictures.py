"""The cache of decoded pictures: it never changes a bit, decodes once, keeps its size, and its failures fail nothing."""

import os
import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.picture_files import put, random_codes

from data_gen.sources.collections import open_collection
from data_gen.sources.decoded_pictures import ENDING, DecodedPictures
from data_gen.sources.photographs import Photographs
from simulator.errors import PhotositeError


class Decoder:
    """Reads .npy files and remembers which."""

    def __init__(self) -> None:
        self.read: list[str] = []

    def __call__(self, path: Path) -> np.ndarray:
        self.read.append(path.name)
        return np.load(path)


def pictures(folder: Path, count: int, side: int = 40) -> list[Path]:
    return [put(folder / f"{number}.npy", random_codes(side, side, seed=number)) for number in range(count)]


def files(folder: Path) -> list[Path]:
    return sorted(folder.glob(f"*{ENDING}"))


def test_a_picture_is_decoded_once_for_all_processes(tmp_path):
    (path,) = pictures(tmp_path / "in", 1)
    decode, cache = Decoder(), DecodedPictures(10**6, tmp_path / "cache")
    for each in (cache, cache, DecodedPictures(10**6, tmp_path / "cache"), pickle.loads(pickle.dumps(cache))):
        found = each.codes(path, decode)
        np.testing.assert_array_equal(found, np.load(path))
        assert found.dtype == np.uint8 and not found.flags.writeable
    assert decode.read == ["0.npy"] and cache.cost.pictures == 1 and cache.cost.decoded_bytes == 40 * 40 * 3
    assert len(files(tmp_path / "cache")) == 1


def test_two_processes_that_want_the_same_picture_decode_it_once(tmp_path):
    (path,) = pictures(tmp_path / "in", 1)
    script = (
        "import sys, time; from pathlib import Path; import numpy as np\n"
        "from data_gen.sources.decoded_pictures import DecodedPictures\n"
        "def decode(path):\n    time.sleep(0.5)\n    return np.load(path)\n"
        "cache = DecodedPictures(10**6, Path(sys.argv[2]))\n"
        "sys.stdin.readline()\n"
        "cache.codes(Path(sys.argv[1]), decode)\n"
        "print(cache.cost.pictures)\n"
    )
    root = str(Path(__file__).parents[3])
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([root, os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, "-c", script, str(path), str(tmp_path / "cache")]
    both = [
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) for _ in range(2)
    ]
    assert sum(int(process.communicate("go\n", timeout=120)[0]) for process in both) == 1


def test_a_changed_picture_is_decoded_again(tmp_path):
    (path,) = pictures(tmp_path / "in", 1)
    cache = DecodedPictures(10**6, tmp_path / "cache")
    cache.codes(path, np.load)
    changed = random_codes(40, 40, seed=9)
    put(path, changed)
    os.utime(path, ns=(1, 1))
    np.testing.assert_array_equal(cache.codes(path, np.load), changed)


def test_the_files_stay_within_the_limit_and_the_longest_unused_goes_first(tmp_path):
    paths, decode = pictures(tmp_path / "in", 4), Decoder()
    size = 40 * 40 * 3 + 128
    cache = DecodedPictures(3 * size, tmp_path / "cache")
    for number in (0, 1, 2):
        cache.codes(paths[number], decode)
    by_age = sorted(files(tmp_path / "cache"), key=lambda one: one.stat().st_mtime_ns)
    for seconds, path in enumerate(by_age, 1000):
        os.utime(path, (seconds, seconds))
    cache.codes(paths[0], decode)  # used: 1 is the oldest
    cache.codes(paths[3], decode)
    assert sum(path.stat().st_size for path in files(tmp_path / "cache")) == 3 * size
    for number in (0, 2, 3):
        cache.codes(paths[number], decode)
    assert decode.read == ["0.npy", "1.npy", "2.npy", "3.npy"]
    np.testing.assert_array_equal(cache.codes(paths[1], decode), np.load(paths[1]))
    assert decode.read[4:] == ["1.npy"]


def test_random_draws_of_more_pictures_than_fit_write_no_more_than_fits(tmp_path):
    """What an earlier run left makes room, what this one uses stays."""
    paths, old = pictures(tmp_path / "in", 6), pictures(tmp_path / "old", 3)
    cache = DecodedPictures(3 * (40 * 40 * 3 + 128), tmp_path / "cache")
    for path in old:
        cache.codes(path, np.load)
    for path in files(tmp_path / "cache"):
        os.utime(path, (1000, 1000))
    kept, first, second = cache.keeping_used(), Decoder(), Decoder()
    for path in paths:
        kept.codes(path, first)
    for path in paths:
        kept.codes(path, second)
    assert first.read == [path.name for path in paths] and second.read == first.read[3:]
    assert len(files(tmp_path / "cache")) == 3 and kept.cost is cache.cost


def test_a_picture_larger_than_the_limit_is_not_kept_and_removes_nothing(tmp_path):
    small, large = pictures(tmp_path / "in", 1)[0], pictures(tmp_path / "large", 1, side=90)[0]
    cache = DecodedPictures(10_000, tmp_path / "cache")
    cache.codes(small, np.load)
    np.testing.assert_array_equal(cache.codes(large, np.load), np.load(large))
    assert len(files(tmp_path / "cache")) == 1


def test_a_limit_of_0_keeps_nothing(tmp_path):
    (path,), decode = pictures(tmp_path / "in", 1), Decoder()
    cache = DecodedPictures(0, tmp_path / "cache")
    cache.codes(path, decode), cache.codes(path, decode)
    assert decode.read == ["0.npy"] * 2 and not (tmp_path / "cache").exists()
    with pytest.raises(PhotositeError, match="cache = -1 bytes"):
        DecodedPictures(-1)


def test_a_folder_that_is_none_and_a_damaged_file_only_cost_time(tmp_path):
    (path,) = pictures(tmp_path / "in", 1)
    (tmp_path / "file").write_text("no folder")
    np.testing.assert_array_equal(DecodedPictures(10**6, tmp_path / "file").codes(path, np.load), np.load(path))
    cache = DecodedPictures(10**6, tmp_path / "cache")
    cache.codes(path, np.load)
    (kept,) = files(tmp_path / "cache")
    for damaged in (b"", kept.read_bytes()[:1000], b"text" * 1000):
        kept.write_bytes(damaged)
        fresh = DecodedPictures(10**6, tmp_path / "cache")
        np.testing.assert_array_equal(fresh.codes(path, np.load), np.load(path))
        assert fresh.cost.pictures == 1
    DecodedPictures(10**6, tmp_path / "cache").codes(path, Decoder())
    assert kept.stat().st_size == 40 * 40 * 3 + 128  # it was made again


def test_the_folder_follows_the_environment(tmp_path, monkeypatch):
    monkeypatch.setenv("PHOTOSITE_CACHE", str(tmp_path / "mine"))
    assert DecodedPictures().place == tmp_path / "mine"
    monkeypatch.delenv("PHOTOSITE_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert DecodedPictures().place == tmp_path / "xdg" / "photosite" / "decoded"


def test_a_photograph_has_the_same_bits_from_the_cache(tmp_path):
    put(tmp_path / "in" / "a.jpg", random_codes(64, 80))
    put(tmp_path / "in" / "grey.png", random_codes(64, 80, channels=1))
    plain, cache = Photographs(tmp_path / "in", small_camera(), "brooks2019"), DecodedPictures(10**6, tmp_path / "cache")
    kept = open_collection({"photos": plain}, "photos", small_camera(), cache)
    for name in ("a.jpg", "grey.png"):
        for _ in range(2):
            one, other = (source.read(name, np.random.default_rng(3)) for source in (plain, kept))
            np.testing.assert_array_equal(one.signal, other.signal)
    assert cache.cost.pictures == 2


def test_a_damaged_picture_is_named_whatever_the_cache(tmp_path):
    (tmp_path / "bad.jpg").write_bytes(b"no picture")
    source = Photographs(tmp_path, small_camera(), "brooks2019", decoded=DecodedPictures(10**6, tmp_path / "cache"))
    for name, message in (("bad.jpg", r"bad\.jpg: cannot be read"), ("gone.jpg", r"gone\.jpg: no such file")):
        for _ in range(2):
            with pytest.raises(PhotositeError, match=message):
                source.read(name, np.random.default_rng(0))
    assert not files(tmp_path / "cache")
