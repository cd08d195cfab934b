"""How many instants a moving image needs, and which, against sums over very many."""

import numpy as np
import pytest

from simulator.exposure.camera_motion import Poses, SteadyMotion
from simulator.exposure.flicker import MainsFlicker, PwmLamp
from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.instants import PathLength, TimedPath, cut_error, instants_error, needed_cuts, needed_instants

GEOMETRY = ImageGeometry(1000.0, 64, 48)


class Swing:
    """A camera that is shifted by 0.02 m sin(2 pi f t) at f = 3 Hz."""

    def poses(self, times_s: np.ndarray) -> Poses:
        location = np.zeros((len(times_s), 3))
        location[:, 0] = 0.02 * np.sin(6.0 * np.pi * times_s)
        return Poses(np.zeros_like(location), location)


def moved(camera) -> ImageMotion:
    return ImageMotion(GEOMETRY, (Surface(1.0, 1.0),), camera)


def edge_error(instants, path_px: np.ndarray, light: np.ndarray) -> float:
    """Largest error of a step edge on a photosite's even square, over all places, beside a dense sum of the path."""
    places = np.linspace(path_px.min() - 1.0, path_px.max() + 1.0, 1101)[:, None]
    found = np.clip(places - 1000.0 * instants.pose_numbers[0, :, 3], -0.5, 0.5) @ instants.weights[0]
    return float(np.abs(found - np.clip(places - path_px, -0.5, 0.5) @ (light / light.sum())).max())


def test_the_error_of_a_trembling_path_is_measured_not_that_of_passages_alike():
    """Passages of a hand's tremor have errors of either sign, which the law for a path that turns back adds up."""
    camera, lines, count = HandTremor(0.0, location_rms_m_per_s=0.05, seed=1), open_at_once(40.0), 1700
    path = TimedPath(moved(camera), lines, 0.0)
    dense_s = (np.arange(20000) + 0.5) * 2e-3
    truth = 1000.0 * camera.poses(dense_s).location_m[:, 0]
    found = edge_error(path.instants(count), truth, np.ones(len(truth)))
    predicted = path.instants_error(count, path.length, 1.0)
    assert found < predicted < 0.8 * instants_error(count, path.length, 1.0)
    even = TimedPath(moved(SteadyMotion(right_m_per_s=0.05)), lines, 0.0)
    assert even.instants_error(count, even.length, 0.7) == instants_error(count, even.length, 0.7)


def row_by_row(rows: int, row_s: float, time_s: float) -> LineTimes:
    opens = row_s * np.arange(rows) + max(-row_s, 0.0) * (rows - 1)
    return LineTimes("rows", opens, opens, opens + time_s, opens + time_s, np.ones(rows))


@pytest.mark.parametrize("row_s", [1e-3, -1e-3], ids=["down", "up"])
def test_the_skew_of_an_even_path_is_its_way_from_row_to_row(row_s):
    path = TimedPath(moved(SteadyMotion(right_m_per_s=0.05, up_m_per_s=-0.02)), row_by_row(48, row_s, 0.02), 0.0)
    skew = path.skew
    assert (skew.x_px, skew.y_px) == pytest.approx((50.0 * row_s, 20.0 * row_s)) and skew.apart_px < 1e-9 and skew.of_rows
    assert skew.largest_px == pytest.approx(skew.middle_px)
    swinging = TimedPath(moved(Swing()), row_by_row(48, row_s, 0.4), 0.0).skew
    assert swinging.apart_px > 0.9 * swinging.largest_px > 10.0 * swinging.middle_px
    assert TimedPath(moved(Swing()), open_at_once(0.4), 0.0).skew.largest_px == 0.0


def test_lines_beyond_the_sensor_are_those_at_its_border_or_go_on():
    path = TimedPath(moved(SteadyMotion(right_m_per_s=0.05)), row_by_row(48, 1e-3, 0.02), 0.0)
    lines = np.array([-3, 0, 47, 50])
    at_border, on = (one.of_lines(lines).instants(4) for one in (path, path.going_on()))
    assert np.array_equal(at_border.times_s[[0, 3]], at_border.times_s[[1, 2]])
    assert np.allclose(on.times_s - at_border.times_s, np.array([[-3e-3], [0.0], [0.0], [3e-3]]))
    assert np.allclose(on.pose_numbers[..., 3], 0.05 * on.times_s) and np.array_equal(on.weights, at_border.weights)
    begin, end = path.going_on().of_lines(lines).straight_shift()
    assert np.allclose(begin[:, 0], 50.0 * np.array([-3e-3, 0.0, 47e-3, 50e-3])) and np.allclose(end - begin, [1.0, 0.0])


@pytest.mark.parametrize("count", [20, 60, 200])
@pytest.mark.parametrize("camera", [SteadyMotion(right_m_per_s=0.05), Swing()], ids=["even", "swinging"])
def test_the_law_of_instants_bounds_the_error_of_an_edge(camera, count):
    lines = open_at_once(0.4)
    path = TimedPath(moved(camera), lines, 0.0)
    dense_s = (np.arange(8000) + 0.5) * 5e-5
    truth = 1000.0 * camera.poses(dense_s).location_m[:, 0]
    error = edge_error(path.instants(count), truth, np.ones(8000))
    law = instants_error(count, path.length, 1.0)
    assert error <= 1.02 * law + 1e-4
    if isinstance(camera, SteadyMotion):
        assert path.length.longest_px == pytest.approx(20.0) and error >= 0.97 * law - 1e-4


def both_weights(path: TimedPath, nodes_s: np.ndarray, times_s: np.ndarray, light: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weights of nodes in the light of the only line, and those of dense sums."""
    dense = [np.interp(times_s, nodes_s, node) @ light / light.sum() for node in np.eye(len(nodes_s))]
    return path.node_weights(nodes_s)[0], np.array(dense)


def test_a_ramp_of_the_shutter_and_a_lamp_weigh_the_instants():
    """A trapezoid of 2, 4 and 3 ms under light 1 + cos(2 pi 100 t): weights and mean place of a steady path, by dense sums."""
    lines = LineTimes("all", *(np.array([value]) for value in (0.001, 0.003, 0.007, 0.010, 0.8)))

    lamp = MainsFlicker(100.0, 1.0)
    times_s = 0.001 + (np.arange(90000) + 0.5) * 1e-7
    opening = np.clip(np.minimum((times_s - 0.001) / 0.002, (0.010 - times_s) / 0.003), 0.0, 1.0)
    weight = opening * (1.0 + np.cos(200.0 * np.pi * (0.25 + times_s)))
    path = TimedPath(moved(SteadyMotion(right_m_per_s=1.0)), lines, 0.25, lamp)
    assert np.allclose(*both_weights(path, np.linspace(0.001, 0.010, 10), times_s, weight), atol=2e-5)
    instants, mean = path.instants(9), np.average(0.25 + times_s, weights=weight)
    assert instants.weights[0] @ instants.times_s[0] == pytest.approx(mean, abs=1e-6)
    assert instants.weights[0] @ instants.pose_numbers[0, :, 3] == pytest.approx(mean, abs=1e-6)
    assert np.allclose(path.instants(7, "light").weights, 1.0 / 7.0, rtol=2e-3)


@pytest.mark.parametrize(
    ("time_s", "lamp"),
    [
        (1.0, PwmLamp(500.0, 0.1)),
        (1.0, PwmLamp(20_000.0, 0.3)),
        (0.01, PwmLamp(100.0, 0.01, 250.0)),
        (1.0, MainsFlicker(511.0, 1.0)),
    ],
    ids=["500 Hz", "20 kHz", "one pulse", "mains"],
)
def test_light_that_changes_within_cells_of_the_path_weighs_instants_exactly(time_s, lamp):
    """Pulses as often as the cells of a path do not beat with them: weights and mean times by dense sums."""
    path = TimedPath(moved(SteadyMotion(right_m_per_s=0.06 / time_s)), open_at_once(time_s), 0.25, lamp)
    times_s = time_s * (np.arange(1_000_000) + 0.5) / 1_000_000
    light = lamp.brightness(0.25 + times_s).astype(np.float64)
    assert np.allclose(*both_weights(path, np.linspace(0.0, time_s, 41), times_s, light), atol=2e-4)
    instants = path.of_shift().instants(40)
    assert instants.weights[0] @ instants.times_s[0] == pytest.approx(
        0.25 + np.average(times_s, weights=light), abs=1e-5 * time_s
    )


def test_each_line_has_its_own_instants():
    """Lines that open 10 us apart see a steady path 10 us further on, exactly."""
    opens = 1e-5 * np.arange(50)
    lines = LineTimes("rows", opens, opens, opens + 0.01, opens + 0.01, np.ones(50))
    instants = TimedPath(moved(SteadyMotion(right_m_per_s=1.0)), lines, -0.3).instants(12)
    assert np.abs(1000.0 * (np.diff(instants.pose_numbers[..., 3], axis=0) - 1e-5)).max() < 1e-6
    assert np.allclose(instants.weights, 1.0 / 12.0, atol=1e-9)


def test_the_number_of_instants_follows_edges_and_texture():
    path = PathLength(20.0, 20.0)
    assert needed_instants(path, 1.0, 0.00219, 0.0) == 34  # 0.1 sigma of 2,000 electrons
    assert needed_instants(path, 1.0, 0.00219, 1.82) == 73
    assert needed_instants(path, 8.0, 0.00219, 0.0) == 96  # a bright edge by its real ratio
    for length in (0.0, 0.001):
        assert needed_instants(PathLength(length, length), 1.0, 0.00219, 1.82) == 1
    many = needed_instants(PathLength(5000.0, 5000.0), 1.0, 0.00219, 0.0)
    assert 200 < many < 240
    for length in (0.02, 0.3, 2.0, 50.0, 900.0, 5000.0):
        even = PathLength(length, length)
        assert instants_error(needed_instants(even, 1.0, 0.003, 0.0), even, 1.0) <= 0.003


@pytest.mark.parametrize("count", [1, 7, 40])
def test_a_border_that_is_seen_or_not_is_wrong_by_half_an_instant(count):
    """Borders that pass at any time: the share of the instants after it, and that of time."""
    passes = np.linspace(0.0, 1.0, 2001)
    seen = ((np.arange(count) + 0.5) / count > passes[:, None]).mean(axis=1)
    worst = 0.8 * np.abs(seen - (1.0 - passes)).max()
    assert worst == pytest.approx(cut_error(count, 0.8), rel=0.05)
    assert needed_cuts(0.8, cut_error(count, 0.8)) == count
