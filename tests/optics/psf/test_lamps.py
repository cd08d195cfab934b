"""Which pixels of a scene are lamps, and how their light is divided."""

import numpy as np
import pytest

from simulator.optics.geometry.projection import Projection
from simulator.optics.psf.lamps import LAMP_TIMES, LIMIT_TIMES, MOST_ALIGNED, MOST_LAMPS, find_lamps
from simulator.scene.scene import Scene

WEIGHTS = np.diag([1.0, 2.0])


def scene_of(planes: np.ndarray) -> Scene:
    return Scene(planes.astype(np.float32), np.ones((2, 3)), np.array([400.0, 500.0, 600.0]), np.ones(3))


def projection_of(planes: np.ndarray, scale: float = 1.0) -> Projection:
    return Projection(scale, 0.0, 0.0, planes.shape[1], planes.shape[0], 1, nearest=True)


def found_in(planes: np.ndarray, limits: tuple[float, float] = (4.0, 8.0), scale: float = 1.0):
    return find_lamps(scene_of(planes), WEIGHTS, projection_of(planes, scale), limits, float((planes @ WEIGHTS).max()))


def test_pixels_above_a_limit_of_highlights_are_lamps_where_one_is_far_above_it():
    planes = np.ones((300, 40, 2))
    planes[280, 7] = [4.1, 1.0]
    assert found_in(planes) is None
    planes[11, 30] = [1.0, 1.01 * LAMP_TIMES * 4.0]
    lamps = found_in(planes)
    assert lamps is not None and lamps.rest == 0.0
    assert list(zip(lamps.rows.tolist(), lamps.columns.tolist(), strict=True)) == [(11, 30), (280, 7)]


def test_a_lamp_keeps_the_least_light_around_it_up_to_the_mean_of_the_dark():
    planes = np.ones((9, 9, 2))
    planes[2:5, 2:5] = [500.0, 100.0]
    planes[7, 7], planes[8, 8] = [300.0, 1.0], [0.25, 0.5]
    lamps = found_in(planes)
    assert lamps is not None and lamps.count == 10
    kept, drawn = lamps.split(planes, WEIGHTS)
    expected = np.array(9 * [[1.0, 2.0]] + [[0.25, 1.0]])
    assert np.array_equal(kept, expected) and lamps.most == (4.0 / LIMIT_TIMES, 8.0 / LIMIT_TIMES)
    assert kept + drawn == pytest.approx((planes @ WEIGHTS)[lamps.rows, lamps.columns], rel=1e-12)


@pytest.mark.parametrize(("scale", "most"), [(1.0, MOST_ALIGNED), (1.37, MOST_LAMPS)])
def test_the_brightest_are_drawn_where_there_are_too_many(scale, most):
    planes = np.zeros((200, 200, 2))
    planes.reshape(-1, 2)[: most + 100, 0] = np.linspace(1000.0, 100.0, most + 100)
    lamps = found_in(planes, scale=scale)
    assert lamps is not None and lamps.count == most and lamps.rest == pytest.approx(planes.reshape(-1, 2)[most, 0])
    planes.reshape(-1, 2)[: most + 100, 0] = 1000.0
    assert found_in(planes, scale=scale) is None
