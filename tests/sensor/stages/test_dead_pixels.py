"""Dead pixels give no signal, are as many as their share says, and stay where they are."""

import numpy as np
import pytest
from helpers.randomness import accept
from scipy import stats

from simulator.errors import PhotositeError
from simulator.sensor.stages.dark_current import DarkCurrent
from simulator.sensor.stages.dead_pixels import DeadPixels
from simulator.sensor.stages.stage import Moments

LIGHT = np.full((700, 700), 1000.0)


def test_as_many_are_dead_as_the_share_says_and_the_others_are_whole(bench):
    checks = {}
    for share in (1e-4, 0.01, 0.5):
        codes = bench.sensor(LIGHT, DeadPixels(share), black=64.0)
        assert set(np.unique(codes)) == {64, 1064}
        checks[share] = stats.binomtest(int((codes == 64).sum()), codes.size, share).pvalue
    accept(checks)


def test_none_and_all(bench):
    assert (bench.sensor(LIGHT, DeadPixels(0.0)) == 1000).all()
    assert (bench.sensor(LIGHT, DeadPixels(1.0)) == 0).all()


def test_they_stay_from_frame_to_frame_and_differ_from_body_to_body(bench):
    first, again, other = (
        bench.sensor(LIGHT, DeadPixels(0.1), frame_seed=f, body_seed=b) == 0 for f, b in ((1, 5), (2, 5), (1, 6))
    )
    assert np.array_equal(first, again)
    accept({"both dead": stats.binomtest(int((first & other).sum()), first.size, 0.01).pvalue})


def test_rows_of_a_pair_share_a_block_of_random_words_and_no_chance(bench):
    dead = bench.sensor(LIGHT, DeadPixels(0.3)) == 0
    both = dead[::2] & dead[1::2]
    accept({"both dead": stats.binomtest(int(both.sum()), both.size, 0.09).pvalue})


def test_dark_current_still_gathers_in_them(bench):
    codes = bench.sensor(LIGHT, DeadPixels(1.0), DarkCurrent(100.0, 1.0))
    accept({"mean": 2 * stats.norm.sf(abs(codes.mean() - 100.0) / np.sqrt(100.0 / codes.size))})


def test_a_share_beyond_1_is_refused():
    with pytest.raises(PhotositeError, match="dead_pixels.share = 1.5"):
        DeadPixels(1.5)


def test_moments_are_those_of_a_photosite_that_answers():
    assert DeadPixels(0.5).moments(Moments(5.0, 1.0, 2.0)) == Moments(5.0, 1.0, 2.0)
