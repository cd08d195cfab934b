"""Hot pixels have a dark current of their own, exponentially distributed, that belongs to the body."""

import numpy as np
import pytest
from helpers.randomness import accept, correlation_p, mean_p
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.hot_pixels import HotPixels
from simulator.sensor.stages.stage import Moments

DARK = np.zeros((500, 500))


def test_as_many_are_hot_as_the_share_says(bench):
    codes = bench.sensor(DARK, HotPixels(0.01, 1e4, 1.0))
    # of the hot ones, e^-m with m ~ Exp(1e4) show no electron: 1 in 10001
    accept({"count": stats.binomtest(int((codes > 0).sum()), codes.size, 0.01 * (1 - 1 / 10001)).pvalue})


def test_their_dark_electrons_are_exponential_around_the_rate_and_grow_with_time(bench):
    """All photosites hot: counts of a Poisson number with exponential mean are geometric."""
    checks = {}
    for rate, time_s in ((1000.0, 2.0), (30.0, 0.1)):
        codes = bench.sensor(DARK, HotPixels(1.0, rate, time_s)).ravel()
        mean = rate * time_s
        checks[mean, "mean"] = mean_p(codes, mean, mean + mean**2)
        edges = np.unique(stats.geom.ppf(np.arange(1, 10) / 10, 1 / (1 + mean)) - 1)
        shares = np.diff(np.concatenate([[0.0], stats.geom.cdf(edges + 1, 1 / (1 + mean)), [1.0]]))
        found = np.bincount(np.searchsorted(edges, codes), minlength=len(shares))
        checks[mean, "shape"] = stats.chisquare(found, shares * codes.size).pvalue
    accept(checks)


def test_the_mean_belongs_to_the_body_and_its_shot_noise_to_the_frame(bench):
    frames = np.stack([bench.sensor(DARK, HotPixels(0.2, 500.0, 1.0), frame_seed=seed) for seed in (1, 2)]).astype(float)
    assert np.array_equal(frames[0] > 60, (frames[0] > 60) & (frames[1] > 0))  # e^-20 at most that a bright one vanishes
    mean, difference = frames.mean(axis=0), frames[0] - frames[1]
    bright = mean > 200
    standard = difference[bright] / np.sqrt(2.0 * mean[bright])  # Poisson: variance = mean
    other = bench.sensor(DARK, HotPixels(0.2, 500.0, 1.0), body_seed=3)
    accept(
        {
            "shot noise": mean_p(standard**2, 1.0, 2.0),
            "another body": correlation_p(other > 0, frames[0] > 0),
        }
    )


@pytest.mark.parametrize(("arguments", "message"), [((2.0, 1.0), "hot_pixels.share"), ((0.1, -1.0), "hot_pixels.rate")])
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(PhotositeError, match=message):
        HotPixels(*arguments)


def test_moments_are_those_of_a_photosite_that_is_not_hot():
    assert HotPixels(0.5, 10.0, 1.0).moments(Moments(5.0, 1.0, 2.0)) == Moments(5.0, 1.0, 2.0)


def test_they_grow_with_time_from_a_second_to_an_hour(bench):
    """The same photosites: counts of 1 s and 60 s are Poisson around what an hour of the same body says of each of them."""
    counts = {time_s: bench.sensor(DARK, HotPixels(0.02, 8.0, time_s), gain=gain, frame_seed=int(time_s)).astype(float) / gain
              for time_s, gain in ((1.0, 1.0), (60.0, 1.0), (3600.0, 0.25))}  # fmt: skip
    hot = (counts[3600.0] > 10000.0) & (counts[3600.0] < 200000.0)
    checks = {}
    for time_s in (1.0, 60.0):
        share = time_s / 3600.0
        mean = share * counts[3600.0][hot]
        spread = (counts[time_s][hot] - mean) ** 2 / (mean + share * mean)
        checks[time_s] = mean_p(spread, 1.0, 2.0 + np.mean(1.0 / mean))
    assert hot.sum() > 2000
    accept(checks)


def test_they_follow_the_temperature_as_dark_current_does():
    hot = HotPixels(0.1, 100.0, 2.0, temperature_k=308.15)
    assert hot.kernel_values()["mean_e"] == pytest.approx(DarkCurrent(100.0, 2.0, temperature_k=308.15).mean_e)
    with pytest.raises(PhotositeError, match="hot_pixels.temperature = 25 K"):
        HotPixels(0.1, 1.0, temperature_k=25.0)
