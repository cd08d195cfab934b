"""The published model that noise is compared with: its numbers are the camera file's, its draws follow its distribution."""

import numpy as np
import pytest
from helpers.randomness import accept
from noise_statistics import divergence
from published_noise import BLACK_DN, SONY_A7S2
from scipy import stats

from simulator.config import load_camera


def test_the_camera_file_holds_the_published_numbers():
    table = load_camera("sony_a7s2").iso_table
    assert set(table) == set(SONY_A7S2)
    for iso, published in SONY_A7S2.items():
        written = table[iso].gain_dn_per_e, table[iso].read_noise_dn, table[iso].tukey_lambda, table[iso].row_noise_dn
        numbers = published.gain_dn_per_e, published.gaussian_dn, published.tukey_lambda, published.row_noise_dn
        np.testing.assert_allclose(written, numbers, atol=5.1e-5, rtol=0)


def test_the_two_published_widths_of_the_read_noise_agree_within_1_2_percent():
    for published in SONY_A7S2.values():
        assert abs(published.read_noise_dn / published.gaussian_dn - 1.0) < 0.012
        assert published.with_gaussian_width().read_noise_dn == pytest.approx(published.gaussian_dn, rel=1e-12)


@pytest.mark.parametrize("iso, mean_e", [(50, 0.0), (1600, 0.0), (1600, 3.0), pytest.param(6400, 3.0, marks=pytest.mark.slow)])
def test_probabilities_of_codes_have_the_moments_of_the_model(iso, mean_e):
    published = SONY_A7S2[iso]
    codes = np.arange(BLACK_DN - 200, BLACK_DN + 400)
    shares = published.shares(codes, mean_e)
    mean = BLACK_DN + published.gain_dn_per_e * mean_e
    assert shares.sum() == pytest.approx(1.0, abs=1e-12)
    assert shares @ codes == pytest.approx(mean, abs=1e-6)
    assert shares @ (codes - mean) ** 2 == pytest.approx(published.variance_dn2(mean_e), rel=1e-6)


def test_dark_noise_is_a_tukey_lambda_number_folded_with_a_normal_one():
    published = SONY_A7S2[1600]
    grid = np.linspace(-8.0, 8.0, 4001) * published.row_noise_dn
    weights = stats.norm.pdf(grid, scale=published.row_noise_dn) * (grid[1] - grid[0])
    for value in (-20.0, -3.0, 0.0, 7.5):
        below = stats.tukeylambda.cdf((value - grid) / published.tukey_scale_dn, published.tukey_lambda) @ weights
        assert published.dark_below(np.array([value]))[0] == pytest.approx(below, abs=1e-9)


@pytest.mark.parametrize("iso, mean_e", [(100, 0.0), (1600, 4.0), (6400, 0.0)])
def test_drawn_codes_follow_these_probabilities_and_rows_share_their_noise(iso, mean_e):
    published, draw = SONY_A7S2[iso], np.random.default_rng(7)
    codes = published.codes(np.full((100_000, 2), mean_e), draw)
    support = np.arange(codes.min(), codes.max() + 1)
    pair = codes.astype(np.float64) - BLACK_DN - published.gain_dn_per_e * mean_e
    row_dn2, total = published.row_noise_dn**2, published.variance_dn2(mean_e)
    together = pair.prod(axis=1)
    z = (together.mean() - row_dn2) / np.sqrt((total**2 + row_dn2**2) / len(pair))
    accept(
        {
            "codes": divergence(codes[:, 0], int(support[0]), published.shares(support, mean_e)).p_value,
            "row": 2.0 * stats.norm.sf(abs(z)),
        }
    )
