"""Normal numbers: the transform against float64, the numbers against the distribution."""

import numpy as np
from helpers.randomness import accept, correlation_p, mean_p, variance_p
from scipy import stats

COUNT = 1_000_000


def _pairs(bench, first, second):
    arrays = {"a": first.astype(np.uint32), "b": second.astype(np.uint32)}
    both = "INLINE float part(uint a, uint b, int k) { float n[2]; normal_two(a, b, &n[0], &n[1]); return n[k]; }"
    return [bench.header("normal.h", f"part(a, b, {k})", arrays, function=both) for k in (0, 1)]


def test_transform_matches_box_muller_in_float64(bench):
    rng = np.random.default_rng(1)
    a, b = rng.integers(0, 2**32, (2, COUNT), dtype=np.uint64).astype(np.int64)
    # every quarter turn and its neighbours, and the ends of the radius
    b[:32] = (np.arange(8)[:, None] * 2**29 + np.array([-1, 0, 1, 2])).ravel() % 2**32
    a[32:36] = [0, 1, 2**32 - 1, 2**31]
    first, second = _pairs(bench, a, b)
    u = ((a // 2).astype(np.float32) + np.float32(0.5)) * np.float32(2.0**-31)
    radius = np.sqrt(-2.0 * np.log(u.astype(np.float64)))
    angle = 2.0 * np.pi * b.astype(np.float64) / 2.0**32
    half = np.pi * ((2 * b + 2**31) % 2**32 - 2.0**31) / 2.0**32  # the lower 31 bits as a signed half turn
    sign = np.where(b >= 2**31, -1.0, 1.0)
    assert np.max(np.abs(first - sign * radius * np.cos(half))) < 9e-5  # 6.7 sigma times the polynomials' error
    assert np.max(np.abs(second - radius * np.sin(half))) < 9e-5
    arrays = {"a": a.astype(np.uint32), "b": b.astype(np.uint32)}
    one = bench.header("normal.h", "normal_one(a, b)", arrays)
    assert np.max(np.abs(one - radius * np.cos(angle))) < 3e-5


def test_distribution_is_standard_normal_and_pairs_are_independent(bench):
    rng = np.random.default_rng(2)
    first, second = _pairs(bench, *rng.integers(0, 2**32, (2, COUNT), dtype=np.uint64))
    words = dict(zip("ab", rng.integers(0, 2**32, (2, COUNT), dtype=np.uint32), strict=True))
    one = bench.header("normal.h", "normal_one(a, b)", words)
    checks = {"correlation": correlation_p(first, second), "of squares": correlation_p(first**2, second**2)}
    for name, sample in (("first", first), ("second", second), ("one", one)):
        checks[name, "mean"] = mean_p(sample, 0.0, 1.0)
        checks[name, "variance"] = variance_p(sample, 1.0)
        checks[name, "shape"] = stats.kstest(sample, "norm").pvalue
        checks[name, "kurtosis"] = 2 * stats.norm.sf(abs(stats.kurtosis(sample)) / np.sqrt(24 / COUNT))
        beyond = np.sum(np.abs(sample) > 4.0)
        checks[name, "tail"] = stats.binomtest(int(beyond), COUNT, 2 * stats.norm.sf(4.0)).pvalue
    accept(checks)
