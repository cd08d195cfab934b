"""A meter finds the exposure that brings what it looks at to its level."""

import math

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.exposure.metering import LevelBound, Metering, exposure_for_level, read_meter

LIGHT = np.random.default_rng(3).lognormal(0.0, 1.5, (40, 60))


def level_at(exposure: float, light: np.ndarray, weights: np.ndarray) -> float:
    """Level that an exposure gives: light above white counts as white."""
    return float((weights * np.minimum(exposure * light, 1.0)).sum())


@pytest.mark.parametrize("level", [1e-6, 0.128, 0.5, 0.99])
@pytest.mark.parametrize("pattern", ["mean", "centre_weighted", "spot"])
def test_the_exposure_gives_the_level(level, pattern):
    found = read_meter(LIGHT, LIGHT, Metering(pattern, level=level)).exposure
    assert level_at(found, LIGHT, Metering(pattern).weights(40, 60)) == pytest.approx(level, rel=1e-12)


def test_without_clipping_the_exposure_is_the_level_over_the_mean():
    assert read_meter(LIGHT, LIGHT, Metering("mean", level=1e-3)).exposure == pytest.approx(1e-3 / LIGHT.mean(), rel=1e-12)


def test_a_lamp_hardly_darkens_the_picture():
    """One cell of 2400, however bright, is white: it takes 1/2400 of white from the level, not all of it."""
    lamp = np.ones((40, 60))
    lamp[3, 4] = 1e9
    found = read_meter(lamp, lamp, Metering("mean")).exposure
    assert found == pytest.approx((10 / 78 - 1 / 2400) / (2399 / 2400), rel=1e-12)


def test_weights_have_the_sum_one_and_lie_where_the_pattern_says():
    for pattern in ("mean", "centre_weighted", "spot", "highlights"):
        assert Metering(pattern).weights(40, 60).sum() == pytest.approx(1.0)
    down, across = np.mgrid[:200, :300] + 0.5
    inside = np.hypot(down - 100, across - 150) < 50  # half as wide as the frame is high
    assert Metering("centre_weighted").weights(200, 300)[inside].sum() == pytest.approx(0.75, abs=0.01)
    spot = Metering("spot", 0.25, 0.8, 0.1).weights(200, 300)
    assert (spot * across).sum() == pytest.approx(0.25 * 300) and (spot * down).sum() == pytest.approx(0.8 * 200)
    assert np.count_nonzero(spot > 0.5 * spot.max()) == pytest.approx(math.pi * 10**2, rel=0.05)


def test_the_smallest_spot_has_the_nearest_cell_and_a_frame_of_one_cell_all_weight():
    assert Metering("spot", 0.0, 0.0, 1e-6).weights(4, 4)[0, 0] == 1.0
    for pattern in ("mean", "centre_weighted", "spot"):
        assert Metering(pattern).weights(1, 1) == [[1.0]]


def test_highlights_are_protected():
    """Truth: the mean of the brightest 2 % of 2400 cells, 48 of them, is 0.8 of white."""
    light = np.full((40, 60), 0.1)
    light.flat[:48] = np.linspace(5.0, 9.0, 48)
    reading = read_meter(light, light, Metering("highlights"))
    assert np.minimum(reading.exposure * light.flat[:48], 1.0).mean() == pytest.approx(0.8)
    assert reading.exposure < read_meter(light, light, Metering("mean")).exposure
    assert reading.bound == "cells from 98 to 100 % of brightness at most 80 % of white"


def test_bounds_act_on_the_colour_that_has_most():
    light = np.full((40, 60), 0.1)
    assert read_meter(light, light, Metering("highlights")).bound is None
    assert read_meter(light, 20 * light, Metering("highlights")).exposure == pytest.approx(0.8 / 2.0)


def test_shadows_are_lifted_and_a_later_bound_is_stronger():
    """Truth: the darker half has the level 0.17, unless the brightest tenth would rise above 0.5."""
    light = np.where(np.arange(100) < 50, 0.02, 1.0)[None, :]
    shadows, bright = LevelBound("least", 0.0, 0.5, 0.17), LevelBound("most", 0.9, 1.0, 0.5)
    assert read_meter(light, light, Metering("mean", bounds=(shadows,))).exposure == pytest.approx(0.17 / 0.02)
    assert read_meter(light, light, Metering("mean", bounds=(shadows, bright))).exposure == pytest.approx(0.5)


def test_where_too_little_is_lit_no_exposure_reaches_the_level():
    stars = np.zeros((10, 10))
    stars[2, 2] = 5.0
    assert math.isinf(read_meter(stars, stars, Metering("mean")).exposure)  # a hundredth of the frame, and 12.8 % wanted
    assert exposure_for_level(np.zeros(4), np.full(4, 0.25), 0.1) == math.inf


@pytest.mark.parametrize(
    ("settings", "what"), [({"pattern": "mean"}, "the frame is black"), ({"pattern": "spot", "x": 0.1}, "the spot at x = 0.1")]
)
def test_darkness_cannot_be_metered(settings, what):
    light = np.zeros((10, 10))
    light[:, 9] = 0.0 if settings["pattern"] == "mean" else 1.0
    with pytest.raises(PhotositeError, match=f"{what}.*nothing to meter; set exposure.mode: manual"):
        read_meter(light, light, Metering(**settings))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Metering("spot", x=1.2), "exposure.metering.x = 1.2"),
        (lambda: Metering("spot", y=math.nan), "exposure.metering.y = nan"),
        (lambda: Metering("spot", size=0.0), "exposure.metering.size = 0"),
        (lambda: Metering(level=1.0), "exposure.metering.level = 1"),
        (lambda: Metering("mean", x=0.2), "exposure.metering.pattern = mean: .* are those of a spot"),
        (lambda: LevelBound("most", 0.9, 0.9, 0.5), "from_quantile = 0.9 to 0.9"),
        (lambda: LevelBound("most", 0.9, 1.0, 1.5), "bounds.level = 1.5"),
    ],
)
def test_a_meter_without_sense_is_refused(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()
