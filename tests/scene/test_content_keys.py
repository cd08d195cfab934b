"""Keys are equal where the content is, and only there."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from simulator.config import load_camera
from simulator.scene.content_keys import LARGEST_COMPARED, freeze, is_ours
from simulator.scene.scene import Scene


@dataclass(frozen=True)
class Setting:
    """Anything with numbers, arrays and parts."""

    number: float = 1.0
    array: np.ndarray = field(default_factory=lambda: np.arange(3.0))
    parts: tuple[object, ...] = ()
    table: dict[int, float] = field(default_factory=lambda: {100: 1.0, 200: 2.0})


def test_equal_content_gives_equal_keys():
    assert freeze(Setting()) == freeze(Setting()) and hash(freeze(Setting())) == hash(freeze(Setting()))
    assert freeze(Setting(table={200: 2.0, 100: 1.0})) == freeze(Setting())
    assert freeze(load_camera("sony_a7s2")) == freeze(load_camera("sony_a7s2"))


@pytest.mark.parametrize(
    "other",
    [
        Setting(2.0),
        Setting(array=np.arange(3.0, dtype=np.float32)),
        Setting(array=np.arange(3.0)[:, None]),
        Setting(parts=(Setting(),)),
        Setting(table={100: 1.0}),
    ],
    ids=["number", "type", "shape", "part", "table"],
)
def test_other_content_gives_another_key(other):
    assert freeze(other) != freeze(Setting())


def test_fields_can_be_left_out():
    assert freeze(Setting(2.0), frozenset({"number"})) == freeze(Setting(), frozenset({"number"}))


def test_one_and_true_are_not_the_same():
    assert freeze(1) != freeze(True) and freeze(1.0) != freeze(1)


def test_a_file_is_another_when_it_was_written_again(tmp_path):
    path = tmp_path / "picture.exr"
    path.write_bytes(b"one")
    first = freeze(path)
    assert freeze(Path(str(path))) == first
    path.write_bytes(b"three")
    assert freeze(path) != first
    path.unlink()
    with pytest.raises(OSError, match=r"picture\.exr"):
        freeze(path)


@dataclass(frozen=True)
class Listing:
    """A list of files, which declares them."""

    file: Path
    number: int = 1

    def companion_files(self):
        """All files beside the list."""
        return {"file": tuple(sorted(self.file.parent.glob("*.bin")))}


def test_the_files_that_a_file_leads_to_count_with_it(tmp_path):
    for name in ("list.csv", "a.bin"):
        (tmp_path / name).write_bytes(b"one")
    listing = Listing(tmp_path / "list.csv")
    first, without = freeze(listing), freeze(listing, frozenset({"file"}))
    assert freeze(Listing(tmp_path / "list.csv")) == first
    (tmp_path / "a.bin").write_bytes(b"three")
    second = freeze(listing)
    (tmp_path / "b.bin").write_bytes(b"one")
    assert len({first, second, freeze(listing)}) == 3 and freeze(listing, frozenset({"file"})) == without


def test_what_cannot_be_compared_is_equal_to_itself_alone():
    large, same = np.zeros(LARGEST_COMPARED + 1, np.uint8), object()
    assert freeze(large) == freeze(large) and freeze(large) != freeze(large.copy())
    assert freeze(same) == freeze(same) and freeze(same) != freeze(object())


def test_only_the_simulators_own_objects_are_known_to_stay_the_same():
    planes = np.ones((1, 1, 1), np.float32)
    assert is_ours(Scene(planes, np.ones((1, 2)), np.array([400.0, 700.0]), np.ones(2))) and not is_ours(Setting())
