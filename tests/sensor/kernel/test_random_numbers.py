"""Random numbers of a pair of rows: which bits they are made of, and that no two of them know of each other."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from simulator.device.kernel_source import expanded
from simulator.sensor.stages.poisson_variants import MACROS, PoissonVariant

ABSENT = ("DARK_CURRENT", "HOT_PIXELS", "COLUMN_OFFSET", "ROW_NOISE", "DEAD_PIXELS", "RANDOM_TELEGRAPH_NOISE")
PRESENT = ("PHOTON_SHOT_NOISE", "READ_NOISE_BEFORE_GAIN", "READ_NOISE_AFTER_GAIN", "PRNU", "DSNU")
BUILD = {
    **dict.fromkeys(ABSENT, 0),
    **{f"{stem}_STREAM": "9u" for stem in ABSENT},
    **dict.fromkeys(PRESENT, 1),
    **MACROS,
    "POISSON_VARIANT": int(PoissonVariant.ALL),
}
# What of the words each normal number may count as its own: radius words, and angles of which 21 bits matter.
OWN_BITS = {
    "block.a": 21,
    "block.b": 22,
    "block.c": 22,
    "angle_of_a(block)": 21,
    "angle_of_b(block)": 21,
    "angle_of_c(block)": 21,
}
COUNTS = """#include "random_numbers.h"
kernel void probe(global float *numbers, const uint count, const uint y, const uint seed) {
    const uint x = get_global_id(0);
    const struct words frame = block_of(x, y, STREAM_FRAME, seed, 0u);
    float normals[2][NORMALS];
    uint bits[2][BITS];
    draw_normals(x, y, frame, seed, seed, 0u, normals[0], normals[1]);
    draw_bits(x, y, frame, seed, seed, bits[0], bits[1]);
    for (uint row = 0; row < 2; row++) {
        numbers[row * count + x] = fine_uniform(bits[row][SHOT_COUNT]);
        numbers[(2 + row) * count + x] = normals[row][BEFORE];
        numbers[(4 + row) * count + x] = normals[row][AFTER];
    }
}"""
NAMES = ("shot", "before gain", "after gain", "response", "offset")
PROBE = """#include "random_numbers.h"
kernel void probe(global float *numbers, const uint count, const uint y, const uint seed) {
    const uint x = get_global_id(0);
    float first[NORMALS], second[NORMALS];
    draw_normals(x, y, block_of(x, y, STREAM_FRAME, seed, 0u), seed, seed, 0u, first, second);
    for (int i = SHOT; i <= OFFSET; i++) {
        numbers[(size_t)i * count + x] = first[i];
        numbers[(size_t)(i + 5) * count + x] = second[i];
    }
}"""


def _rank(rows):
    """Rank over the field of two elements; rows are Python integers."""
    pivots = []
    for row in rows:
        for pivot in pivots:
            row = min(row, row ^ pivot)
        if row:
            pivots.append(row)
    return len(pivots)


def test_the_bits_that_matter_of_all_numbers_of_a_block_are_independent(bench):
    """Words are exclusive sums of the block's 128 bits: every bit's sum is read from what single bits do to it."""
    single = np.zeros((4, 128), np.uint32)
    for bit in range(128):
        single[bit // 32, bit] = 1 << (bit % 32)
    arrays = dict(zip("abcd", single, strict=True))
    sums = []
    for word, bits in OWN_BITS.items():
        function = (
            f"INLINE uint part(uint a, uint b, uint c, uint d) {{ const struct words block = {{a, b, c, d}}; return {word}; }}"
        )
        found = bench.header("random_numbers.h", "part(a, b, c, d)", arrays, BUILD, np.uint32, function)
        for place in range(31, 31 - bits, -1):
            sums.append(sum(1 << int(bit) for bit in np.flatnonzero((found >> place) & 1)))
    assert _rank(sums) == len(sums) == 128


class _Draws:
    """The ten normal numbers of pairs of rows, five of the even row and then five of the odd row, row after row."""

    def __init__(self, device, count):
        self.device, self.count = device, count
        self.kernel = device.build(expanded(PROBE), "probe", BUILD)
        self.numbers = device.empty((10, count), np.float32)

    def row(self, y, seed):
        self.device.run(self.kernel, (self.count,), None, numbers=self.numbers, count=self.count, y=y, seed=seed)
        return self.device.download(self.numbers, (10, self.count), np.float32)


def _products(first, second):
    """Sums of products of numbers, (20, n) each; in blocks, which one processor multiplies fastest."""
    blocks = [part[:, : part.shape[1] // 1024 * 1024].reshape(20, -1, 1024).swapaxes(0, 1) for part in (first, second)]
    return (blocks[0] @ blocks[1].swapaxes(1, 2)).sum(axis=0, dtype=np.float64)


def _check(device, width, rows, seed):
    """Test `rows` pairs of rows of `width` photosites.

    Correlations of the ten numbers and of their squares, each with each, with the next column and with the next pair of rows;
    numbers beyond 3, 4 and 5 sigma, below and above.
    """
    draws = _Draws(device, width)
    limits = (3.0, 4.0, 5.0)
    here, column, pair = (np.zeros((20, 20)) for _ in range(3))
    above, below = np.zeros((3, 10)), np.zeros((3, 10))
    last = np.zeros((20, width), np.float32)
    for y in range(rows):
        row = draws.row(2 * y, seed)
        both = np.concatenate([row, (row * row - np.float32(1.0)) * np.float32(np.sqrt(0.5))])
        here += _products(both, both)
        column += _products(both, np.roll(both, 1, axis=1))
        pair += _products(both, last)
        last = both
        for i, limit in enumerate(limits):
            above[i] += np.count_nonzero(row > limit, axis=1)
            below[i] += np.count_nonzero(row < -limit, axis=1)
    count = width * rows
    checks = {}
    names = [f"{name}, row {row}" for row in (0, 1) for name in NAMES]
    names += [f"square of {name}" for name in names]
    for where, products in (("here", here), ("next column", column), ("next pair", pair)):
        scores = products / np.sqrt(count)
        if where == "here":
            scores[np.arange(10, 20), np.arange(10)] /= np.sqrt(5.0)  # a number and its own square: E x^2 (x^2 - 1)^2 / 2 = 5
        for i in range(20):
            for j in range(i) if where == "here" else range(20):
                checks[where, names[i], names[j]] = 2 * stats.norm.sf(abs(scores[i, j]))
    for i, limit in enumerate(limits):
        for k in range(10):
            up, down = int(above[i, k]), int(below[i, k])
            checks["sides", limit, names[k]] = stats.binomtest(up, up + down, 0.5).pvalue if up + down else 1.0
            checks["beyond", limit, names[k]] = stats.binomtest(up + down, count, 2 * stats.norm.sf(limit)).pvalue
    accept(checks)


def test_numbers_of_a_pair_of_rows_are_independent_and_normal(device):
    _check(device, 2**16, 64, seed=3)


def test_counts_of_few_electrons_know_nothing_of_the_read_noise(device):
    """Both come from one block: uniform numbers of both rows against normal numbers, themselves and squared, and each other."""
    count = 2**20
    numbers = device.empty((6, count), np.float32)
    device.run(device.build(expanded(COUNTS), "probe", BUILD), (count,), None, numbers=numbers, count=count, y=6, seed=5)
    drawn = device.download(numbers, (6, count), np.float32).astype(float)
    shares, normals = np.sqrt(12.0) * (drawn[:2] - 0.5), drawn[2:]
    checks = {("uniform", row): stats.kstest(drawn[row], "uniform").pvalue for row in (0, 1)}
    checks["rows"] = 2 * stats.norm.sf(abs((shares[0] * shares[1]).sum()) / np.sqrt(count))
    for what, others in (("normal", normals), ("square", np.sqrt(0.5) * (normals**2 - 1.0))):
        for power, own in (("share", shares), ("square of share", np.sqrt(1.25) * (shares**2 - 1.0))):
            scores = abs(own @ others.T) / np.sqrt(count)
            checks |= {(what, power, i, j): 2 * stats.norm.sf(scores[i, j]) for i in (0, 1) for j in range(4)}
    accept(checks)


@pytest.mark.slow
def test_no_correlation_is_found_in_2_4e9_photosites(device):
    _check(device, 2**16, 18311, seed=4)
