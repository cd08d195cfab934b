"""Pairs of the denoiser example differ in their noise alone, and our noise teaches a network what the published model does."""

from dataclasses import replace

import numpy as np
import pytest
from denoiser_pairs import (
    GAUSSIAN,
    GREY,
    HELD_OUT,
    MID_GREY,
    NOISES,
    OURS,
    PUBLISHED,
    TRAINED_ON,
    batches,
    held_out_pairs,
    held_out_set,
    photographs,
    training_set,
)
from helpers.randomness import accept, mean_p
from published_noise import SONY_A7S2
from scipy import stats

RATIO, WHITE_DN = 100.0, 16383 - 512
PUBLISHED_ISO = SONY_A7S2[3200]


@pytest.fixture(scope="module")
def seen(tmp_path_factory):
    return training_set(1, photographs(TRAINED_ON, tmp_path_factory.mktemp("seen")))


@pytest.fixture(scope="module")
def pairs(device, seen):
    return next(batches(replace(seen, crops_per_picture=4), device, 32))


def errors_dn(pairs, noise):
    """Noise in codes of the short exposure."""
    return (pairs.noisy[noise].astype(np.float64) - pairs.clean) * WHITE_DN / RATIO


def squares_p(errors, variance):
    """z-test of squared errors against a variance each; rows share noise, so that patches count, not photosites."""
    excess = (errors**2 - variance).mean(axis=(1, 2, 3)) / np.mean(variance)
    return float(2.0 * stats.norm.sf(abs(excess.mean() / (excess.std(ddof=1) / np.sqrt(len(excess))))))


def test_each_noise_has_its_mean_and_variance(pairs):
    mean_e = pairs.clean.astype(np.float64) * WHITE_DN / RATIO / PUBLISHED_ISO.gain_dn_per_e
    real = PUBLISHED_ISO.variance_dn2(mean_e)
    grey_e = MID_GREY * WHITE_DN / RATIO / PUBLISHED_ISO.gain_dn_per_e
    variance = {
        OURS: real,
        PUBLISHED: real,
        GAUSSIAN: np.broadcast_to(real.mean(axis=(1, 2, 3), keepdims=True), real.shape),
        GREY: np.full(real.shape, PUBLISHED_ISO.variance_dn2(grey_e)),
    }
    found = {}
    for noise in NOISES:
        errors = errors_dn(pairs, noise)
        found[noise, "mean"] = mean_p(errors.mean(axis=(1, 2, 3)) / errors.mean(axis=(1, 2, 3)).std(ddof=1), 0.0, 1.0)
        found[noise, "variance"] = squares_p(errors, variance[noise])
    accept(found)


def test_the_reference_saturates_where_the_test_says(pairs, seen, device):
    from data_gen.generate import Generator

    sample = next(Generator(seen, device).samples([0]))
    assert sample.white_level_dn == WHITE_DN + 512
    assert (sample.iso, sample.exposure_ratios, sample.black_level_dn) == (3200, (RATIO,), 512.0)


def test_pairs_held_out_are_other_pictures(device, seen, tmp_path):
    held_out = held_out_set(photographs(HELD_OUT, tmp_path))
    assert not set(TRAINED_ON) & set(HELD_OUT)
    assert held_out.pictures["drawings"].keywords["seed"] != seen.pictures["drawings"].keywords.get("seed", 0)
    assert held_out_pairs(held_out, device, 2).clean.shape == (2, 4, 128, 128)


def test_all_arms_begin_with_the_same_weights_and_learn(device, pairs):
    torch = pytest.importorskip("torch", reason="the denoiser example needs PyTorch")
    torch.set_num_threads(1)  # two threads that wait for each other on busy cores take ten times as long
    from denoiser_training import Arm, denoised, psnr_db, trained

    first, second = (Arm.begun(noise, 5).network.state_dict() for noise in (OURS, PUBLISHED))
    assert all(torch.equal(first[name], second[name]) for name in first)
    watched = pairs.first(8)
    arms = trained([pairs.first(8)] * 30, 30, 1, watched, lambda: None)
    assert [arm.noise for arm in arms] == list(NOISES)
    for arm in arms:
        before = psnr_db(denoised(Arm.begun(arm.noise, 1).network, watched.noisy[PUBLISHED]), watched.clean).mean()
        assert arm.curve[-1][1] > before + 3.0
