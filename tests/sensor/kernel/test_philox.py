"""Philox4x32-10 against the known-answer vectors that Random123 publishes (kat_vectors, philox4x32 10)."""

import numpy as np
import pytest

VECTORS = [
    ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
    ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1),
    ),
]


@pytest.mark.parametrize(("counter", "key", "answer"), VECTORS)
def test_known_answers(bench, counter, key, answer):
    arrays = {name: np.array([value], np.uint32) for name, value in zip("abcdkl", (*counter, *key), strict=True)}
    words = [
        int(bench.header("philox.h", f"philox((struct words){{a, b, c, d}}, k, l).{word}", arrays, dtype=np.uint32)[0])
        for word in "abcd"
    ]
    assert tuple(words) == answer
