"""The numbers of a stream are those of NumPy's Philox generator, whose key is the seed and whose counter is the place."""

import zlib

import numpy as np
import pytest

from simulator.config.random_streams import RandomStream, philox_4x64


def test_a_block_is_the_published_known_answer():
    """Random123, kat_vectors: philox4x64 10, all zero and all one; the second key word, which we leave 0, is 0 in the first."""
    words = (0x16554D9ECA36314C, 0xDB20FE9D672D0FDC, 0xD7E772CEE186176B, 0x7E68B68AEC7BA23B)
    assert philox_4x64((0, 0, 0, 0), 0) == words


@pytest.mark.parametrize(("seed", "index", "attempt"), [(0, 0, 0), (2**64 - 1, 2**48, 3), (17, 12345, 99)])
def test_uniform_numbers_are_numpys(seed, index, attempt):
    stream = RandomStream(seed, index, attempt)
    counter = [0, zlib.crc32(b"shift"), attempt, index]
    for count in (1, 4, 5, 130):
        words = np.random.Philox(key=seed, counter=counter).random_raw(count)
        assert stream.uniforms("shift", count) == [(int(word >> np.uint64(11)) + 0.5) / 2**53 for word in words]
