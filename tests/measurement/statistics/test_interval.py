"""Measurements of noise on sensors made with NumPy: the truth lies in the 95 % intervals as often as that says."""

import math

import numpy as np
import pytest
from helpers.randomness import accept, mean_p
from scipy import stats

from simulator.measurement.statistics.clipping import find_clipped_code
from simulator.measurement.statistics.dark_current import fit_slope_over_time
from simulator.measurement.statistics.dsnu import measure_dsnu, subtract_plane_means
from simulator.measurement.statistics.interval import Interval, difference, variance_interval, weighted_mean
from simulator.measurement.statistics.photon_transfer import line_without_dark, transfer_point
from simulator.measurement.statistics.prnu import measure_prnu
from simulator.measurement.statistics.read_noise import read_noise, row_residuals
from simulator.measurement.statistics.read_noise_split import find_conversion_gain_switch, fit_two_sources
from simulator.measurement.statistics.row_noise import row_noise
from simulator.measurement.statistics.temporal_noise import pair_noise
from simulator.measurement.statistics.tukey_lambda_fit import fit_tukey_lambda, rounding_doubt_dn2

REPEATS = 200
FEW = 80  # where one takes milliseconds
RGGB = [(0, 0), (0, 1), (1, 0), (1, 1)]


def coverage_p(hits: list[bool]) -> float:
    """Two-sided binomial test of the share of intervals that hold against 95 %."""
    return float(stats.binomtest(sum(hits), len(hits), 0.95).pvalue)


def tukey_lambda_frame(generator, shape=(96, 128), lam=0.14, sigma=2.0, row=0.0, black=300.37) -> np.ndarray:
    """Codes of a dark frame: Tukey-lambda noise of SciPy's distribution, row noise, rounding."""
    noise = stats.tukeylambda.ppf(generator.random(shape), lam) * sigma / stats.tukeylambda.std(lam)
    return np.rint(black + noise + generator.normal(0.0, row, (shape[0], 1))).astype(np.uint16)


@pytest.mark.parametrize(
    ("lam", "sigma", "row"),
    [
        pytest.param(0.14, 1.0, 0.0, marks=pytest.mark.slow),
        (-0.1, 4.0, 0.9),
        pytest.param(0.05, 12.0, 3.0, marks=pytest.mark.slow),
    ],
)
def test_read_noise_row_noise_and_lambda_within_their_intervals(lam, sigma, row):
    hits = {"read noise": [], "row noise": [], "lambda": [], "sigma of lambda": []}
    for seed in range(FEW):
        generator = np.random.default_rng([seed, 1])
        first, second = (tukey_lambda_frame(generator, lam=lam, sigma=sigma, row=row) for _ in range(2))
        residuals = row_residuals(first, second)
        pairs = [pair_noise(first, second)]
        shape = fit_tukey_lambda(residuals)
        hits["read noise"].append(read_noise(pairs).covers(sigma))
        hits["row noise"].append(row_noise(pairs).covers(row))
        hits["lambda"].append(shape.shape.covers(lam))
        hits["sigma of lambda"].append(shape.sigma_dn.covers(sigma))
    if row == 0.0:
        assert np.mean(hits.pop("row noise")) > 0.95, "an interval that ends at 0 holds 0 more often than 95 %"
    accept({name: coverage_p(found) for name, found in hits.items()})


def test_the_scale_is_not_the_standard_deviation():
    """PMN's Sony A7S II at ISO 100: scale 0.702 DN and lambda 0.149 are a standard deviation of 1.007 DN."""
    residuals = row_residuals(*(tukey_lambda_frame(np.random.default_rng(s), (400, 400), 0.149, 1.007) for s in (1, 2)))
    found = fit_tukey_lambda(residuals)
    assert found.sigma_dn.covers(1.007) and not found.sigma_dn.covers(0.702)
    ends = [found.sigma_dn.value / stats.tukeylambda.std(shape) for shape in (found.shape.low, found.shape.high)]
    assert min(ends) < 0.702 < max(ends)
    assert found.scale_dn == pytest.approx(found.sigma_dn.value / stats.tukeylambda.std(found.shape.value))


def test_a_normal_noise_has_the_lambda_of_probability_plots():
    """0.14, where SciPy's ppcc_max puts normal samples too (Filliben 1975)."""
    generator = np.random.default_rng(5)
    first, second = (np.rint(generator.normal(500.0, 8.0, (200, 250))) for _ in range(2))
    reference = stats.ppcc_max(generator.normal(size=20000), brack=(-0.1, 0.14, 0.3))
    assert fit_tukey_lambda(row_residuals(first, second)).shape.value == pytest.approx(reference, abs=0.03)


@pytest.mark.parametrize("sigma", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("black", [64.0, 64.25, 64.5])
def test_noise_of_the_size_of_a_code_stays_within_a_wider_interval(sigma, black):
    generator = np.random.default_rng(3)
    frames = [np.rint(generator.normal(black, sigma, (300, 400))) for _ in range(2)]
    found = read_noise([pair_noise(*frames)], rounding_doubt_dn2(0.14, sigma))
    assert found.covers(sigma)


@pytest.mark.parametrize(("dsnu", "column", "frames"), [(1.5, 0.4, 8), (0.5, 0.0, 2), (0.0, 0.3, 16)])
def test_dark_pattern_within_its_intervals(dsnu, column, frames):
    hits = {"dsnu": [], "column": []}
    for seed in range(REPEATS):
        generator = np.random.default_rng([seed, 2])
        pattern = generator.normal(0.0, dsnu, (64, 80)) + generator.normal(0.0, column, 80)
        pattern[1::2, 1::2] += 3.0  # a plane with another black level
        rows = generator.normal(0.0, 0.8, (frames, 64, 1))
        stack = [np.rint(200.3 + pattern + row + generator.normal(0.0, 2.0, (64, 80))) for row in rows]
        pairs = [pair_noise(*stack[index : index + 2]) for index in range(0, frames, 2)]
        temporal = np.mean([pair.pixel_variance_dn2 for pair in pairs]), np.mean([pair.row_variance_dn2 for pair in pairs])
        found = measure_dsnu([subtract_plane_means(frame, RGGB) for frame in stack], *temporal)
        hits["dsnu"].append(found.photosite_dn.covers(dsnu))
        hits["column"].append(found.column_dn.covers(column))
    for name, truth in (("dsnu", dsnu), ("column", column)):
        if truth == 0.0:
            assert np.mean(hits.pop(name)) > 0.95
    accept({name: coverage_p(found) for name, found in hits.items()})


def test_dsnu_under_heavy_tailed_noise_within_its_interval():
    hits = []
    for seed in range(REPEATS):
        generator = np.random.default_rng([seed, 3])
        pattern = generator.normal(0.0, 0.5, (64, 80))
        noise = [tukey_lambda_frame(generator, (64, 80), -0.24, 4.0) for _ in range(4)]
        stack = [frame + pattern for frame in noise]
        variance = np.mean([pair_noise(*stack[index : index + 2]).pixel_variance_dn2 for index in (0, 2)])
        hits.append(measure_dsnu(stack, variance, 0.0).photosite_dn.covers(0.5))
    accept({"dsnu": coverage_p(hits)})


def test_hot_photosites_are_counted_and_leave_dsnu_alone():
    generator = np.random.default_rng(4)
    pattern = generator.normal(0.0, 1.0, (200, 200))
    pattern.ravel()[:40] += 300.0
    stack = [np.rint(100.0 + pattern + generator.normal(0.0, 2.0, pattern.shape)) for _ in range(8)]
    found = measure_dsnu(stack, 4.0 + 1 / 12, 0.0)
    assert found.hot_share == pytest.approx(40 / 40000)
    assert found.hot_excess_dn == pytest.approx(300.0, abs=1.0)
    assert found.photosite_dn.covers(1.0)


@pytest.mark.parametrize("prnu", [0.01, 0.003])
def test_prnu_under_vignetting_within_its_interval(prnu):
    hits, errors = [], []
    y, x = np.mgrid[-1:1:100j, -1:1:120j]
    shading = 1.0 / (1.0 + 0.2 * (x**2 + y**2)) ** 2  # to half in the corners
    for seed in range(REPEATS):
        generator = np.random.default_rng([seed, 6])
        mean = 9000.0 * shading * (1.0 + generator.normal(0.0, prnu, shading.shape))
        first, second = ([generator.poisson(mean).astype(float)] for _ in range(2))
        found = measure_prnu(first, second)
        hits.append(found.covers(prnu))
        errors.append((found.value - prnu) / found.standard_error)
    accept({"prnu": coverage_p(hits), "unbiased": mean_p(errors, 0.0, 1.0)})


def test_a_line_over_time_within_its_intervals():
    times = np.repeat([0.01, 1.0, 4.0, 8.0], 3)
    hits = {"slope": [], "start": []}
    for seed in range(REPEATS):
        values = 512.0 + 0.3 * times + np.random.default_rng([seed, 7]).normal(0.0, 0.05, times.size)
        slope, start = fit_slope_over_time(times, values)
        hits["slope"].append(slope.covers(0.3))
        hits["start"].append(start.covers(512.0))
    accept({name: coverage_p(found) for name, found in hits.items()})


def test_read_noise_from_flats_alone_within_its_interval():
    """The intercept of photon transfer, for cameras whose dark is cut off at code 0."""
    hits = {"K": [], "variance": []}
    for seed in range(REPEATS):
        generator = np.random.default_rng([seed, 9])
        points = []
        for mean in (30.0, 100.0, 400.0):
            frames = [
                np.rint(0.5 * generator.poisson(mean, (96, 128)) + generator.normal(0.0, 5.0, (96, 128))) for _ in range(2)
            ]
            points.append(transfer_point(pair_noise(*frames), 0.0, row_noise=False))
        slope, offset = line_without_dark(points)
        hits["K"].append(slope.covers(0.5))
        hits["variance"].append(offset.covers(25.0 + 1 / 12))
    accept({name: coverage_p(found) for name, found in hits.items()})


def test_two_sources_come_back_from_the_formula():
    isos = [100, 200, 400, 800, 1600]
    gains = [iso / 400.0 for iso in isos]
    sigmas = [variance_interval((3.0 * gain) ** 2 + 1.5**2, 1e6) for gain in gains]
    exact = [Interval(math.sqrt(s.value), math.sqrt(s.low), math.sqrt(s.high)) for s in sigmas]
    found = fit_two_sources(isos, gains, exact)
    assert found.before_e.value == pytest.approx(3.0, rel=1e-9)
    assert found.after_dn.value == pytest.approx(1.5, rel=1e-9)
    assert found.worst < 1e-9 and found.sigma_dn(2.0) == pytest.approx(math.hypot(6.0, 1.5))


def test_a_switch_of_the_conversion_gain_is_found_where_it_is():
    """PMN's Sony A7S II [e-]: between ISO 1600 and 2000. Moore's Canon 40D has one chain."""
    isos = [100, 200, 400, 800, 1000, 1250, 1600, 2000, 2500, 3200, 6400]
    a7s2_dn = [1.0067, 1.2926, 2.0596, 3.5476, 4.2728, 5.1776, 6.2992, 2.6539, 3.2002, 3.9194, 7.1164]
    a7s2_e = [sigma / (0.0009563 * iso) for sigma, iso in zip(a7s2_dn, isos, strict=True)]
    assert find_conversion_gain_switch(isos, a7s2_e) == 2000
    assert find_conversion_gain_switch([100, 200, 400, 800, 1600], [16.8, 9.9, 6.8, 5.3, 4.6]) is None
    assert find_conversion_gain_switch([100, 200], [3.0, 1.0]) == 200
    assert find_conversion_gain_switch([100], [3.0]) is None


def test_the_clipped_code_is_the_one_that_piles_up():
    generator = np.random.default_rng(8)
    spread = np.minimum(np.rint(generator.normal(14000.0, 3000.0, 100000)), 15520).astype(np.uint16)
    spread[:5] = 15530  # a few photosites of their own kind above it
    assert find_clipped_code(spread) == 15520
    assert find_clipped_code(np.rint(generator.normal(8000.0, 300.0, 100000)).astype(np.uint16)) is None
    noisy_clip = np.minimum(np.rint(generator.normal(15520.0, 1.1, 100000)), 15520).astype(np.uint16)
    assert find_clipped_code(noisy_clip) == 15520, "read noise behind a full well"
    assert find_clipped_code(np.full(1000, 16383, np.uint16)) == 16383
    assert find_clipped_code(np.rint(generator.normal(512.0, 1.0, 100000)).astype(np.uint16)) is None, (
        "a dark frame clips nothing"
    )


def test_the_weighted_mean_tells_parts_that_do_not_agree():
    near = [Interval(1.0, 0.9, 1.1), Interval(1.05, 0.95, 1.15)]
    mean, p_value = weighted_mean(near)
    assert mean.value == pytest.approx(1.025) and mean.high - mean.low == pytest.approx(0.2 / math.sqrt(2)) and p_value > 0.05
    assert weighted_mean([near[0], Interval(1.5, 1.4, 1.6)])[1] < 1e-6


def test_a_difference_has_the_errors_of_both():
    found = difference(Interval(10.0, 7.0, 14.0), Interval(3.0, 0.0, 7.0))
    assert (found.value, found.low, found.high) == (7.0, 7.0 - 5.0, 7.0 + 5.0)
