"""Places at which large scenes are looked at."""

import math

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene
from scipy.stats import chisquare

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.sample_places import sample_places


@pytest.mark.parametrize("length", [0, 1, 7, 400])
def test_short_sides_are_looked_at_throughout(length):
    assert np.array_equal(sample_places(length, 400), np.arange(length))


@pytest.mark.parametrize("length", [401, 1200, 4000, 65535])
def test_places_lie_one_in_each_part(length):
    found = sample_places(length, 400)
    assert len(found) == 400 and found[0] >= 0 and found[-1] < length and (np.diff(found) >= 0).all()
    assert np.abs(found - (np.arange(400) + 0.5) * length / 400).max() <= 0.5 * length / 400 + 1.0


@pytest.mark.parametrize("period", [2, 3, 5, 8, 10])
def test_no_pattern_repeats_with_them(period):
    """Each place of a period is met as often as by chance, and more evenly; even steps of 10 meet one of them only."""
    counts = np.bincount(sample_places(4000, 400) % period, minlength=period)
    assert chisquare(counts).pvalue > 0.01


def test_squares_as_wide_as_steps_between_places_are_seen():
    """Squares of 3 pixels in a scene of 1,200: every third pixel begins one, and none of their edges was found."""
    squares = np.kron(np.random.default_rng(1).random((300, 400)) < 0.5, np.ones((3, 3)))
    lens = ThinLens(50.0, 2.8, math.inf, cos4=False, diffraction=True)
    shot = Shot(band_scene(0.05 + 0.95 * squares, math.inf), lens, Exposure(0.01), small_camera(218, 162))
    mixed = [term.sigma for term in plan(shot).error_budget.terms if "mix pixels" in term.cause]
    assert mixed and mixed[0] > 0.1
