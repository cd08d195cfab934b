"""Two layers of random squares that lie aside of a sample, in float64, against what is stated of their covariance within it."""

import numpy as np
import pytest

from simulator.optics.defocus.mixed_edges import aside_share


def pieces(places: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Widths of the parts of a sample's axis that borders of two layers' squares cut, and each layer's square in them."""
    cuts = np.unique([0.0, 1.0, *(place % 1.0 for place in places)])
    middles = 0.5 * (cuts[1:] + cuts[:-1])
    return np.diff(cuts), np.stack([np.floor(middles - place).astype(int) + 1 for place in places])


def covariance(rng: np.random.Generator, asides: tuple[float, float]) -> float:
    """That of coverage and the light behind it over a sample of side 1, where layers lie aside in random directions."""
    angles, squares = rng.uniform(0.0, 2.0 * np.pi, 2), rng.integers(0, 2, (2, 3, 3)).astype(float)
    ways = np.stack([np.cos(angles), np.sin(angles)]) * asides
    (across, columns), (down, rows) = pieces(tuple(ways[0])), pieces(tuple(ways[1]))
    weights = np.outer(down, across)
    cover, behind = (layer[np.ix_(*places)] for layer, *places in zip(squares, rows, columns, strict=True))
    return float((weights * cover * behind).sum() - (weights * cover).sum() * (weights * behind).sum())


@pytest.mark.parametrize("aside", [0.02, 0.1, 0.2, 0.3, 0.6])
def test_layers_that_lie_little_aside_of_samples_have_little_covariance_within_them(aside):
    rng = np.random.default_rng(1)
    found = max(abs(covariance(rng, (aside, rng.uniform(aside, 1.0)))) for _ in range(6000))
    stated = 0.25 * aside_share(np.array([0.0, aside, 1.0]))
    assert 0.8 * stated < found < stated


def test_a_layer_that_lies_at_its_own_place_has_none():
    assert aside_share(np.array([0.0, 0.7])) == 0.0
