"""Areas with one slanted edge are found where they are, and nowhere else."""

import math

import numpy as np
import pytest
from helpers.scene_builders import distances
from scipy import ndimage
from scipy.special import erf

from simulator.measurement.statistics.edge_search import find_edges


def edge(width: int, height: int, angle_deg: float, noise: float = 10.0) -> np.ndarray:
    """An edge of 800 through the middle, blurred by 1 photosite, with noise."""
    share = 0.5 * (1.0 + erf(distances(width, height, angle_deg) / math.sqrt(2.0)))
    return 100.0 + 800.0 * share + np.random.default_rng(1).normal(0.0, noise, share.shape)


def texture(height: int, width: int) -> np.ndarray:
    return 500.0 + 600.0 * ndimage.gaussian_filter(np.random.default_rng(2).standard_normal((height, width)), 2)


@pytest.mark.parametrize("angle_deg", [-12.0, 5.7, 30.0])
def test_a_patch_with_an_edge_is_found_in_a_texture(angle_deg):
    picture = texture(400, 600)
    picture[100:280, 320:500] = edge(180, 180, angle_deg)
    (found,) = find_edges(picture, picture == 0)
    top, left, height, width = found.area
    assert 100 <= top and top + height <= 280 and 320 <= left and left + width <= 500 and height >= 96
    assert found.angle_deg == pytest.approx(abs(angle_deg), abs=0.3)


def test_areas_of_one_long_edge_do_not_overlap_and_follow_it():
    picture = edge(400, 600, 5.7)
    found = find_edges(picture, picture == 0, most=5)
    assert 2 <= len(found) <= 5
    for one in found:
        top, left, height, width = one.area
        rows = np.arange(top, top + height)
        place = 0.5 * 400 - 0.3 - (rows - 300) * math.tan(math.radians(5.7))
        assert (place > left).all() and (place < left + width).all()
    covered = np.zeros((600, 400), int)
    for one in found:
        top, left, height, width = one.area
        covered[top : top + height, left : left + width] += 1
    assert covered.max() == 1


@pytest.mark.parametrize(
    "signal",
    [
        np.full((200, 300), 500.0),
        np.random.default_rng(3).normal(500.0, 20.0, (200, 300)),
        texture(200, 300),
        edge(300, 200, 0.5),  # along the photosites
        edge(300, 200, 5.7)[:40, :40],  # too small
        np.add.outer(np.arange(200.0), 0.3 * np.arange(300.0)),  # a gradient
    ],
)
def test_what_holds_no_slanted_edge_has_no_area(signal):
    assert find_edges(signal, signal == 0) == []


def test_a_clipped_edge_is_left_out():
    picture = edge(300, 200, 5.7)
    assert find_edges(picture, picture >= 850.0) == find_edges(picture, picture <= 110.0) == []
    assert find_edges(picture, picture >= 1000.0) != []
