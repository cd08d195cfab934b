"""Photon shot noise is Poisson at every mean, and belongs to the photosite."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, counts_p, mean_p, variance_p
from scipy import stats

from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.poisson_variants import MACROS, POISSON_BRIGHT_E, POISSON_SWITCH_E, SMALL_MEANS_E
from simulator.sensor.stages.stage import Moments

SHAPE = (512, 512)
MEANS = [0.01, 0.3, 1.0, 3.0, 4.99, 5.01, 8.0, 15.0, 25.0, 60.0, 300.0, 3000.0, 30000.0]


def _counts(bench, mean, seed=1, shape=SHAPE, **place):
    return bench.sensor(np.full(shape, mean), PhotonShotNoise(), frame_seed=seed, **place)


def test_mean_variance_and_shape_are_poisson_at_every_mean(bench):
    checks = {}
    for seed, mean in enumerate(MEANS, start=10):
        counts = _counts(bench, mean, seed)
        checks[mean, "mean"] = mean_p(counts, mean, mean)
        checks[mean, "variance"] = variance_p(counts, mean, excess_kurtosis=1.0 / mean)
        checks[mean, "shape"] = counts_p(counts, mean)
    accept(checks)


def test_skewness_is_that_of_poisson_not_of_a_gaussian(bench):
    counts = _counts(bench, 25.0, seed=3)
    error = np.sqrt(6.0 / counts.size)
    assert abs(stats.skew(counts, axis=None) - 0.2) < 4 * error  # reference number R16; a Gaussian has 0


@pytest.mark.parametrize("mean", [1e5, 1e6])
def test_large_means_keep_their_moments(bench, mean):
    codes = bench.sensor(np.full(SHAPE, mean), PhotonShotNoise(), gain=1 / 32, frame_seed=5).astype(np.float64)
    rounding = 1 / 12
    checks = {
        "mean": mean_p(codes, mean / 32, mean / 1024 + rounding),
        "variance": variance_p(codes, mean / 1024 + rounding, excess_kurtosis=1e-9),
    }
    accept(checks)


@pytest.mark.parametrize(
    "mean", [POISSON_SWITCH_E, 5.5, 6.0, 7.3, 10.0, 14.0, 20.0, 40.0, 100.0, 255.0, POISSON_BRIGHT_E, 900.0]
)
def test_expansion_steps_where_the_distribution_does(bench, mean):
    """The normal number at which a count is reached, against the exact quantile, in probability: to the end of both tails."""
    mean = float(np.float32(mean))
    low, high = int(stats.poisson.ppf(1e-9, mean)), int(stats.poisson.isf(1e-9, mean))
    count = np.arange(max(1, low), high + 1)
    below, above = stats.poisson.cdf(count - 1, mean), stats.poisson.sf(count - 1, mean)
    share = np.minimum(below, above)
    side = np.where(below < above, 1.0, -1.0)
    error = np.minimum(np.minimum(1.5e-5, 0.02 * share + 1e-8), 0.4 * share)
    for sign in (-1.0, 1.0):  # a little below the step of the distribution, then a little above it
        w = side * stats.norm.ppf(np.clip(share + sign * side * error, 1e-30, 1.0))
        arrays = {"w": w.astype(np.float32), "mean": np.full(w.shape, mean, np.float32)}
        found = bench.header(
            "poisson.h", "poisson_expansion(mean, reciprocal_square_root(mean), w, LARGE_MEANS)", arrays, MACROS
        )
        assert np.all(found < count if sign < 0 else found >= count), (mean, sign)


def test_expansion_gives_no_electrons_where_the_distribution_has_none(bench):
    """Down to the least normal number, far outside the fit."""
    w, mean = (part.ravel().astype(np.float32) for part in np.meshgrid(np.linspace(-6.7, -2.0, 2000), np.geomspace(5, 30, 200)))
    found = bench.header(
        "poisson.h", "poisson_expansion(mean, reciprocal_square_root(mean), w, LARGE_MEANS)", {"w": w, "mean": mean}, MACROS
    )
    exact = stats.poisson.ppf(stats.norm.cdf(w.astype(np.float64)), mean.astype(np.float64))
    assert np.all(np.abs(found - exact) <= 1)
    assert np.mean(found != exact) < 5e-3


def _quantiles(share, mean):
    """Counts with this share beyond them, to float32 and to the least share that a word can be."""
    shares = (np.minimum(share * (1 + 1e-5) + 2.4e-10, 1.0), share * (1 - 1e-5))
    return (stats.poisson.isf(one, mean.astype(np.float64)) for one in shares)


def test_inversion_gives_the_exact_quantile_to_the_least_share(bench):
    rng = np.random.default_rng(4)
    mean = np.concatenate([rng.uniform(0.0, POISSON_SWITCH_E, 300_000), np.geomspace(1e-9, POISSON_SWITCH_E, 200_000)[:-1]])
    mean = mean.astype(np.float32)
    share = np.exp(rng.uniform(np.log(2.4e-10), 0.0, mean.size)).astype(np.float32)
    counts = bench.header("poisson.h", "poisson_inversion(mean, share, SMALL_MEANS)", {"mean": mean, "share": share}, MACROS)
    low, high = _quantiles(share.astype(np.float64), mean)
    assert np.all(low <= counts) and np.all(counts <= high)


def test_words_are_shares_down_to_2_pow_minus_32(bench):
    """Words 0 and 1 are one share, 2 and 3 the next; the least gives the count with less than 2^-32 beyond it."""
    mean = np.geomspace(1e-6, POISSON_SWITCH_E, 20_000).astype(np.float32)[:-1]
    for word, share in ((0, 0.5), (1, 0.5), (2, 1.5), (2**20, 2**19 + 0.5)):
        words = np.full(mean.shape, word, np.uint32)
        counts = bench.header("poisson.h", "poisson(mean, 0.0f, word, SMALL_MEANS)", {"mean": mean, "word": words}, MACROS)
        low, high = _quantiles(share * 2.0**-31, mean)
        assert np.all(low <= counts) and np.all(counts <= high)


@pytest.mark.parametrize(("variant", "limit"), [(3, 2.0), (4, 0.5)])
def test_fewer_steps_give_the_same_counts_below_their_limit(bench, variant, limit):
    rng = np.random.default_rng(7)
    mean = rng.uniform(0.0, limit, 2_000_000).astype(np.float32)
    mean[:1000] = np.nextafter(np.float32(limit), np.float32(0.0))
    word = rng.integers(0, 2**32, mean.size, dtype=np.uint32)
    word[:100_000] = np.exp(rng.uniform(0.0, np.log(2**32 - 1), 100_000)).astype(np.uint32)  # the upper tail, too
    counts = [
        bench.header(
            "poisson.h",
            f"poisson(mean, 0.0f, word, {v})",
            {"mean": mean, "word": word},
            MACROS,
        )
        for v in (2, variant)
    ]
    assert np.array_equal(*counts)


def test_no_light_gives_no_electrons(bench):
    assert not _counts(bench, 0.0).any()


def test_counts_do_not_depend_on_crop_tile_or_neighbours(bench):
    rng = np.random.default_rng(6)
    mean = np.exp(rng.uniform(-4, 9, (120, 700))).astype(np.float32)
    full = bench.sensor(mean, PhotonShotNoise())
    crop = bench.sensor(mean[37:61, 301:660], PhotonShotNoise(), x=301, y=37)
    assert np.array_equal(crop, full[37:61, 301:660])
    for limit in (POISSON_SWITCH_E, POISSON_BRIGHT_E):  # every tile takes the variant for large means, or for bright ones
        bright = np.where(mean < limit, 500.0, mean)
        assert np.array_equal(bench.sensor(bright, PhotonShotNoise())[mean >= limit], full[mean >= limit])
    for limit in SMALL_MEANS_E:  # and here those for small means
        dim = np.where(mean >= limit, 0.1, mean)
        assert np.array_equal(bench.sensor(dim, PhotonShotNoise())[mean < limit], full[mean < limit])


def test_frames_and_neighbours_are_uncorrelated(bench):
    first, second = _counts(bench, 100.0, 1), _counts(bench, 100.0, 2)
    checks = {
        "frames": correlation_p(first, second),
        "columns": correlation_p(first[:, 1:], first[:, :-1]),
        "rows": correlation_p(first[1:], first[:-1]),
        "same Bayer colour": correlation_p(first[:, 2:], first[:, :-2]),
    }
    accept(checks)


def test_moments_add_the_mean_to_the_variance():
    assert PhotonShotNoise().moments(Moments(7.0, 2.0)) == Moments(7.0, 9.0)


@pytest.mark.slow
def test_four_hundred_million_counts_are_poisson_to_the_end_of_both_tails(bench):
    """Chi-square of 4e8 counts at each mean, and counts beyond 1 - 1e-6 and 1 - 1e-7 of probability as often as due."""
    checks = {}
    for mean in (0.003, 0.07, 0.9, 2.0, 4.99, 5.01, 7.3, 12.0, 19.0, 300.0):
        expected, draws = float(np.float32(mean)), 0
        found = np.zeros(2000, np.int64)
        for seed in range(32):
            codes = bench.sensor(np.full((2500, 5000), mean), PhotonShotNoise(), frame_seed=1000 + seed)
            found += np.bincount(codes.ravel(), minlength=found.size)
            draws += codes.size
        checks[mean, "shape"] = counts_p(np.arange(found.size), expected, found)
        for share in (1e-6, 1e-7):
            least = int(stats.poisson.isf(share, expected)) + 1
            due = stats.poisson.sf(least - 1, expected)
            checks[mean, "beyond", share] = stats.binomtest(int(found[least:].sum()), draws, due).pvalue
    accept(checks)


@pytest.mark.slow
def test_ten_million_counts_at_each_of_thirty_means_are_poisson(bench):
    """Mean, variance and shape from 0.01 to 10^6 e-; above what a code can hold the gain is a power of two below 1."""
    checks = {}
    for seed, mean in enumerate(np.geomspace(1e-2, 1e6, 30)):
        scale = 2.0 ** max(0, int(np.ceil(np.log2((mean + 10 * np.sqrt(mean)) / 65535))))
        codes = bench.sensor(np.full((2500, 4000), mean), PhotonShotNoise(), gain=1 / scale, frame_seed=seed)
        expected = float(np.float32(mean))
        if scale == 1.0:
            checks[mean, "mean"] = mean_p(codes, expected, expected)
            checks[mean, "variance"] = variance_p(codes, expected, excess_kurtosis=1 / expected)
            checks[mean, "shape"] = counts_p(codes, expected)
        else:
            checks[mean, "mean"] = mean_p(codes, expected / scale, expected / scale**2)
            checks[mean, "variance"] = variance_p(codes, expected / scale**2 + 1 / 12, excess_kurtosis=1 / expected)
    accept(checks)
