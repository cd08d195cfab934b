"""Instants that are denser at the ends of a path: edges are seen in the noise of the dark there."""

import numpy as np
import pytest
from audit.drawn_shots import draw_shot

from simulator import load_shot
from simulator.optics.geometry.end_spacing import LIT_SHARE, EndSpacing
from simulator.optics.geometry.instants import MOST_INSTANTS, PathLength, needed_instants
from simulator.optics.geometry.motion_plan import MotionNeed
from simulator.optics.geometry.spaced_instants import SpacedInstants
from simulator.pipeline.planner import plan


@pytest.mark.parametrize(("length_px", "dark"), [(0.3, 40.0), (5.06, 40.0), (30.0, 3.0)])
def test_borders_go_from_end_to_end_and_are_the_same_from_either(length_px, dark):
    borders = EndSpacing(length_px, dark).borders(41)
    assert borders[0] == 0.0 and borders[-1] == 1.0 and (np.diff(borders) > 0.0).all()
    np.testing.assert_allclose(borders, 1.0 - borders[::-1], atol=1e-12)


def test_without_a_dark_the_instants_are_even():
    spacing = EndSpacing(5.0, 1.0)
    np.testing.assert_allclose(spacing.borders(10), np.linspace(0.0, 1.0, 11), atol=1e-9)
    assert spacing.excess == pytest.approx(1.0)


@pytest.mark.parametrize("electrons", [300.0, 17310.0])
@pytest.mark.parametrize("length_px", [1.0, 5.06277, 12.0])
def test_an_edge_is_seen_by_no_more_than_allowed_wherever_it_lies(electrons, length_px):
    """Of black beside white with a ramp of one photosite, in float64, in the noise of the light itself and one electron."""
    allowed, floor_e2 = 0.1 / np.sqrt(electrons + 1.0), 1.0  # a tenth of sigma, as a share of the light

    def contrast(lit: float) -> float:
        return float(np.sqrt((electrons + floor_e2) / (lit * electrons + floor_e2)))

    spaced = SpacedInstants.fewest(
        PathLength(length_px, length_px), contrast(LIT_SHARE), contrast(0.0), allowed * (1.0 + 1.0 / electrons), 0.0
    )
    assert spaced.spacing is not None
    assert spaced.count < 0.5 * SpacedInstants.even(spaced.length, contrast(0.0), allowed, 0.0).count or electrons < 1e3
    borders = spaced.spacing.borders(spaced.count)
    edges = np.linspace(-1.0, length_px, 4001)[:, None]  # where the ramp begins
    found = np.clip(0.5 * length_px * (borders[1:] + borders[:-1]) - edges, 0.0, 1.0) @ np.diff(borders)

    def integral(place: np.ndarray) -> np.ndarray:
        past = np.clip(place - edges, 0.0, None)
        return np.where(past < 1.0, 0.5 * past**2, past - 0.5)

    exact = ((integral(np.array([length_px])) - integral(np.zeros(1))) / length_px)[:, 0]
    error = electrons * np.abs(found - exact) / np.sqrt(electrons * exact + floor_e2)
    assert 0.04 < error.max() <= 0.1


def test_even_instants_are_kept_where_they_are_fewer():
    length = PathLength(3.0, 3.0)
    spaced = SpacedInstants.fewest(length, 1.0, 1.0, 0.002, 0.0)
    assert spaced.spacing is None and spaced.excess == 1.0
    assert spaced.count == needed_instants(length, 1.0, 0.002, 0.0)
    far = SpacedInstants.fewest(PathLength(5000.0, 5000.0), 1.0, 50.0, 1e-6, 0.0)
    assert far.count <= MOST_INSTANTS


@pytest.mark.parametrize("lamp_e", [3e3, 1e5, 1e6])
@pytest.mark.parametrize("length_px", [0.4, 1.43, 6.0])
def test_a_lamp_at_the_end_of_a_path_is_seen_by_no_more_than_allowed(lamp_e, length_px):
    """A quarter of a photosite wide, in float64, in its own noise and one electron; even instants miss more."""
    length, width, allowed = PathLength(length_px, length_px), 0.25, 0.1
    lit, dark = (lamp_e / width / np.sqrt(share * lamp_e + 1.0) for share in (LIT_SHARE, 0.0))
    even = SpacedInstants.even(length, lit, allowed, 0.0)
    spaced = even.dense_at_ends(even.count, dark / lit)
    assert spaced.spacing is not None and even.count < spaced.count < 3.0 * even.count
    begin = np.concatenate([np.linspace(-1.3, 0.05, 601), np.linspace(length_px - 0.05, length_px, 601)])

    def light(borders: np.ndarray) -> np.ndarray:
        places = length_px * 0.5 * (borders[1:] + borders[:-1]) - begin[:, None]  # of its front, in a photosite from 0 to 1
        return lamp_e * np.clip(np.minimum(places, 1.0 + width - places) / width, 0.0, 1.0) @ np.diff(borders)

    def passed(place: np.ndarray) -> np.ndarray:
        entered, left = (np.clip(place - border, 0.0, width) for border in (0.0, 1.0))
        return np.clip(place - width, 0.0, 1.0 - width) + entered**2 / (2.0 * width) + left - left**2 / (2.0 * width)

    truth = lamp_e * (passed(length_px - begin) - passed(-begin)) / length_px
    spacings = spaced.spacing.borders(spaced.count), np.linspace(0.0, 1.0, even.count + 1)
    left, missed = (float((np.abs(light(borders) - truth) / np.sqrt(truth + 1.0)).max()) for borders in spacings)
    assert left < allowed and missed > 2.0 * allowed


def test_lamps_out_of_focus_that_move_past_a_border_have_instants_there(tmp_path):
    """A lamp of 2 10^5 e-: 0.8 sigma were found at the end of its path where 0.28 were told."""
    shot = load_shot(draw_shot(92, 77).write(tmp_path))
    planned = plan(shot)
    motion, accuracy = planned.optics.motion, planned.optics.accuracy
    assert motion is not None and motion.method == "instants" and motion.path.spacing is not None
    last_px = motion.length.longest_px * float(motion.path.spacing.borders(motion.count)[1])
    missed_e = accuracy.peak * accuracy.electrons / 4.0 * last_px**2 / (8.0 * motion.length.longest_px)
    assert missed_e < shot.tolerance


@pytest.mark.parametrize("electrons", [300.0, 20000.0])
@pytest.mark.parametrize(("angle_deg", "length_px"), [(45.0, 2.0), (50.0, 3.9), (20.0, 9.0)])
def test_a_corner_is_seen_by_no_more_than_allowed_wherever_a_path_slants_past_it(electrons, angle_deg, length_px):
    """Of a quarter of the plane over black, in float64: in the middle of a path it gives little light, too."""
    sigma = np.sqrt(electrons + 1.0) / electrons
    edge, dark = (sigma * electrons / np.sqrt(lit * electrons + 1.0) for lit in (LIT_SHARE, 0.0))
    need = MotionNeed(edge, dark, 0.0, 0.0, 0.0, 0.1 * sigma, 0.0, 0.0, sigma)
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    corners = max(need.contrast_of_corners(length_px, cos * sin), edge)
    spaced = SpacedInstants.fewest(PathLength(length_px, length_px), corners, dark, need.allowed, 0.0)
    places = np.linspace(0.45, 0.55, 9)[:, None, None], np.linspace(0.0, 0.6, 81)[:, None]  # of the chord; its length

    def light(borders: np.ndarray) -> np.ndarray:
        way = length_px * (0.5 * (borders[1:] + borders[:-1]) - places[0])
        seen = np.clip(cos * way, 0.0, 1.0) * np.clip(sin * (places[1] - way), 0.0, 1.0)
        return electrons * seen @ np.diff(borders)

    assert spaced.spacing is not None
    exact = light(np.linspace(0.0, 1.0, 2001))
    error = np.abs(light(spaced.spacing.borders(spaced.count)) - exact) / np.sqrt(exact + 1.0)
    assert 0.02 < error.max() <= 0.1
