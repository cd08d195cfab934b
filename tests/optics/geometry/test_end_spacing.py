"""Instants that are denser at the ends of a path: edges are seen in the noise of the dark there."""

import numpy as np
import pytest

from simulator.optics.geometry.end_spacing import LIT_SHARE, EndSpacing
from simulator.optics.geometry.instants import MOST_INSTANTS, PathLength, needed_instants
from simulator.optics.geometry.spaced_instants import SpacedInstants


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
