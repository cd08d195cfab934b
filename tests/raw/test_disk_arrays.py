"""Arrays in files: their content, their memory, and rows in blocks."""

import numpy as np
import pytest
from helpers.process_memory import reads_memory, resident_bytes

from simulator.raw.disk_arrays import BLOCK_BYTES, give_back, in_blocks, map_array


def test_the_content_lies_in_the_file(tmp_path):
    content = np.arange(15, dtype=np.float32).reshape(3, 5)
    content.tofile(tmp_path / "a")
    array = map_array(tmp_path / "a", (3, 5), np.float32)
    give_back(array)
    np.testing.assert_array_equal(array, content)


@reads_memory
@pytest.mark.parametrize("part", [lambda a: a, lambda a: a[5:9], lambda a: np.frombuffer(a.data, np.uint8)])
def test_memory_is_given_back(tmp_path, part):
    np.ones((64, 2**20), np.uint8).tofile(tmp_path / "a")
    array = map_array(tmp_path / "a", (64, 2**20), np.uint8)
    assert (array == 1).all()
    before = resident_bytes()
    give_back(part(array))
    assert before - resident_bytes() > 0.9 * array.nbytes
    assert (array[::7, ::4096] == 1).all()


def test_arrays_in_memory_keep_theirs():
    array = np.arange(10)
    give_back(array)
    np.testing.assert_array_equal(array, np.arange(10))


@pytest.mark.parametrize(("rows", "step"), [(1, 1), (70, 1), (70, 16), (64, 16), (40, 1000)])
def test_blocks_hold_every_row_once(rows, step):
    array = np.arange(rows * (BLOCK_BYTES // 32), dtype=np.uint8).reshape(rows, -1)
    blocks = list(in_blocks(array, step))
    np.testing.assert_array_equal(np.concatenate(blocks), array)
    assert all(len(block) % step == 0 for block in blocks[:-1])
    assert all(block.nbytes <= max(BLOCK_BYTES, step * array[:1].nbytes) for block in blocks)


def test_a_file_that_is_too_short(tmp_path):
    (tmp_path / "a").write_bytes(bytes(10))
    with pytest.raises(ValueError, match="buffer"):
        map_array(tmp_path / "a", (3,), np.float32)
