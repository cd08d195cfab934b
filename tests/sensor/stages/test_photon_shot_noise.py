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


def test_distribution_of_the_expansion_is_within_1e_4_of_poisson(bench):
    """Total variation distance at the switch, the worst mean: the kernel's own arithmetic on a float64 grid of normals."""
    for mean in (POISSON_SWITCH_E, 7.0, 20.0, 100.0, 255.0, POISSON_BRIGHT_E):
        share = (np.arange(2_000_000) + 0.5) / 2_000_000
        w = stats.norm.ppf(share).astype(np.float32)
        arrays = {"w": w, "mean": np.full(w.shape, mean, np.float32)}
        counts = bench.header(
            "poisson.h", "poisson_expansion(mean, reciprocal_square_root(mean), w, LARGE_MEANS)", arrays, MACROS
        ).astype(np.int64)
        found = np.bincount(counts, minlength=600)[:600] / len(w)
        assert 0.5 * np.abs(found - stats.poisson.pmf(np.arange(600), mean)).sum() < 1e-4, mean


def test_inversion_gives_the_exact_quantile(bench):
    rng = np.random.default_rng(4)
    mean = rng.uniform(0.0, POISSON_SWITCH_E, 500_000).astype(np.float32)
    u = ((rng.integers(0, 2**24, mean.size) + 0.5) / 2**24).astype(np.float32)
    counts = bench.header("poisson.h", "poisson_inversion(mean, u, SMALL_MEANS)", {"mean": mean, "u": u}, MACROS)
    exact = stats.poisson.ppf(u.astype(np.float64), mean.astype(np.float64))
    # float32 sums may fall on the other side of a step by a few roundings of 1
    wrong = counts != exact
    assert wrong.mean() < 2e-6 * 22 and np.abs(counts - exact)[wrong].max(initial=0) <= 1


def test_the_largest_random_word_gives_a_count_of_the_upper_tail_not_the_trip_count(bench):
    """Sums of float32 probabilities end a little below 1; that must not let the count run to its end."""
    mean = np.geomspace(1e-6, POISSON_SWITCH_E, 20_000).astype(np.float32)
    word = np.full(mean.shape, 2**32 - 1, np.uint32)
    counts = bench.header("poisson.h", "poisson(mean, 0.0f, word, SMALL_MEANS)", {"mean": mean, "word": word}, MACROS)
    assert np.all(counts <= stats.poisson.isf(1e-8, mean.astype(np.float64)))
    assert np.all(counts >= stats.poisson.isf(3e-6, mean.astype(np.float64)))


@pytest.mark.parametrize(("variant", "limit"), [(3, 2.0), (4, 0.5)])
def test_fewer_steps_give_the_same_counts_below_their_limit(bench, variant, limit):
    rng = np.random.default_rng(7)
    mean = rng.uniform(0.0, limit, 2_000_000).astype(np.float32)
    mean[:1000] = np.nextafter(np.float32(limit), np.float32(0.0))
    word = rng.integers(0, 2**32, mean.size, dtype=np.uint32)
    word[:1000] = 2**32 - 1 - 256 * np.arange(1000, dtype=np.uint32)  # the upper tail
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
