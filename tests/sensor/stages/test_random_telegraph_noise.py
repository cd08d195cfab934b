"""Random telegraph noise: three levels in a share of the photosites, their height the body's, their choice the frame's."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.random_telegraph_noise import RandomTelegraphNoise
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((400, 400))


def frames(bench, share, amplitude_e, count=3, **settings):
    noise = RandomTelegraphNoise(share, amplitude_e)
    return np.stack([bench.sensor(DARK, noise, black=30000.0, frame_seed=k, **settings) for k in range(count)]) - 30000.0


def test_levels_are_0_or_plus_minus_the_height_of_the_photosite(bench):
    stack = frames(bench, 1.0, 800.0, count=8)
    height = np.abs(stack).max(axis=0)
    apart = np.minimum(np.abs(np.abs(stack) - height), np.abs(stack))
    assert apart.max() <= 1 and apart.mean() < 1e-3  # a sum near a half may round the other way
    moved = height > 20  # all but e^-(20/800) of them, and those that stayed at 0 in eight frames
    assert moved.mean() > 0.95
    first = np.sign(stack[0])
    shares = [(first == sign).sum() for sign in (-1, 0, 1)]
    zero = 0.5 + 0.5 * (1 - np.exp(-0.5 / 800.0))  # and heights below half a code
    expected = np.array([(1 - zero) / 2, zero, (1 - zero) / 2]) * first.size
    accept({"chances": stats.chisquare(shares, expected).pvalue})


def test_heights_are_exponential_and_the_variance_is_as_the_moments_say(bench):
    sample = frames(bench, 1.0, 600.0, count=1)[0].ravel()
    heights = np.abs(sample[sample != 0])
    share = frames(bench, 0.02, 600.0, count=1, body_seed=11)[0].ravel()
    variance = RandomTelegraphNoise(0.02, 600.0).moments(Moments(0.0, 0.0)).variance
    fourth = 0.02 * 24 * 600.0**4 / 2  # E[x^4] = share E[A^4] / 2
    accept(
        {
            "shape": stats.kstest(heights - 0.5, "expon", args=(0, 600.0)).pvalue,
            "variance": mean_p(share**2, variance, fourth - variance**2),
        }
    )


def test_the_photosites_belong_to_the_body_and_the_levels_to_the_frame(bench):
    first, second = np.sign(frames(bench, 0.3, 500.0, count=2))
    other = np.sign(frames(bench, 0.3, 500.0, body_seed=8)[2])
    accept({"levels": correlation_p(first, second), "another body": correlation_p(first**2, other**2)})
    assert correlation_p(first**2, second**2) < 1e-9  # the same photosites are noisy


def test_rows_of_a_pair_share_blocks_of_random_words_and_no_chance(bench):
    """Levels, traps and heights."""
    (level,) = frames(bench, 0.5, 500.0, count=1)
    trap = np.abs(np.stack([*frames(bench, 0.5, 500.0, count=8)])).max(axis=0)
    upper, lower = trap[::2], trap[1::2]
    both = (upper > 0) & (lower > 0)
    accept(
        {
            "levels": correlation_p(np.sign(level[::2]), np.sign(level[1::2])),
            "traps": correlation_p((upper > 0).astype(float), (lower > 0).astype(float)),
            "heights": correlation_p(upper[both], lower[both]),
        }
    )


@pytest.mark.parametrize(("arguments", "message"), [((-0.1, 1.0), "share"), ((0.1, -1.0), "amplitude")])
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=f"random_telegraph_noise.{message}"):
        RandomTelegraphNoise(*arguments)
