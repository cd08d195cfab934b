"""Noise of data sets is the published one: histograms, rows, neighbours, and a classifier. Each check finds what is wrong."""

import numpy as np
import pytest
from helpers.randomness import SIGNIFICANCE, accept
from noise_classifier import told_apart
from noise_comparison import classified, findings, smallest_p
from noise_statistics import divergence, horizontal_correlation, row_line, row_power_finding, vertical_correlation
from published_noise import BLACK_DN, SONY_A7S2

REJECTED = 1e-6
MODEL = SONY_A7S2[1600]
PHOTOSITE_DN2, ROW_DN2 = MODEL.read_noise_dn**2 + 1.0 / 12.0, MODEL.row_noise_dn**2


def dark(seed, frames=20, side=128):
    return MODEL.codes(np.zeros((frames, side, side)), np.random.default_rng(seed)).astype(np.float64) - BLACK_DN


def statistics(noise):
    """p-values of rows and neighbours."""
    return {
        "row power": row_power_finding(noise, PHOTOSITE_DN2, ROW_DN2).p_value,
        "row line": row_line(noise, PHOTOSITE_DN2, ROW_DN2).p_value,
        "vertical": vertical_correlation(noise, PHOTOSITE_DN2, ROW_DN2).p_value,
        "horizontal": horizontal_correlation(noise, PHOTOSITE_DN2, ROW_DN2).p_value,
    }


def test_noise_of_data_sets_is_the_published_one(device):
    found = {iso: findings(iso, device, 20) for iso in (50, 1600, 2000, 6400)}
    accept({(iso, name): finding.p_value for iso, by_name in found.items() for name, finding in by_name.items()})


@pytest.mark.slow
def test_a_classifier_cannot_tell_data_sets_from_the_published_model_but_gaussian_noise(device):
    told = classified(device, 600)
    assert told["Photosite"].p_value > SIGNIFICANCE
    assert told["Gaussian"].value > 0.7


@pytest.mark.slow
def test_noise_of_data_sets_is_the_published_one_at_every_iso(device):
    chance, tests = smallest_p({iso: findings(iso, device, 100) for iso in SONY_A7S2})
    assert tests == 6 * len(SONY_A7S2)
    assert chance > SIGNIFICANCE
    assert classified(device, 4000)["Photosite"].p_value > SIGNIFICANCE


@pytest.mark.slow
def test_the_model_itself_passes_with_errors_as_large_as_said():
    many = [statistics(dark(seed)) for seed in range(20)]
    accept({(seed, name): p for seed, found in enumerate(many) for name, p in found.items()})
    found = [horizontal_correlation(dark(seed), PHOTOSITE_DN2, ROW_DN2) for seed in range(40)]
    spread = np.sum([((one.value - one.expected) / one.error) ** 2 for one in found])
    assert 16.0 < spread < 78.0  # chi-square of 40: one in a thousand lies outside


@pytest.mark.parametrize(
    "caught, noise",
    [
        ("row power", lambda: dark(1) - dark(1).mean(axis=2, keepdims=True)),
        ("row line", lambda: dark(2) + np.sin(2 * np.pi * np.arange(128) / 8)[:, np.newaxis] * MODEL.row_noise_dn),
        ("vertical", lambda: 0.98 * dark(3) + 0.02 * np.roll(dark(3), 1, axis=1)),
        ("horizontal", lambda: 0.98 * dark(4) + 0.02 * np.roll(dark(4), 1, axis=2)),
    ],
)
def test_a_fault_is_caught(caught, noise):
    assert statistics(noise())[caught] < REJECTED


def test_a_gaussian_of_the_same_variance_is_caught_by_its_histogram():
    deviation = np.sqrt(PHOTOSITE_DN2 + ROW_DN2)
    codes = np.rint(BLACK_DN + deviation * np.random.default_rng(5).standard_normal(20_000)).astype(np.int64)
    support = np.arange(codes.min(), codes.max() + 1)
    assert divergence(codes, int(support[0]), MODEL.shares(support)).p_value < REJECTED


def test_a_classifier_that_saw_the_same_noise_twice_guesses():
    noise = dark(6, frames=1200, side=32) / np.sqrt(PHOTOSITE_DN2 + ROW_DN2)
    assert told_apart(noise[:600], noise[600:]).p_value > SIGNIFICANCE
    assert told_apart(noise[:600], 1.05 * noise[600:]).p_value < REJECTED
