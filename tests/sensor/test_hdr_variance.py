"""The variance at a switch point is that of a mixture, computed here from the joint distribution of two readings."""

import numpy as np
import pytest
from helpers.hdr_bench import DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES, hdr_plan
from scipy import stats

from simulator.sensor.hdr_variance import combined_variance

NODES = np.linspace(-7.0, 7.0, 801)


@pytest.mark.parametrize("readout", [DUAL_GAIN, TWO_EXPOSURES, TWO_PHOTODIODES])
@pytest.mark.parametrize("sigmas", [-2.0, -0.5, 0.0, 0.7, 2.5])
def test_it_is_the_mixture_of_both_readings(readout, sigmas):
    """Numerical integration over A and, given A, over B: normal, one charge with common shot noise or none in common [e-]."""
    sensor = hdr_plan(readout, 8, 8)
    switch_e = (sensor.readings[0].switch_dn - 0.5 - 64.0) / 1.28
    level = switch_e + sigmas * np.sqrt(switch_e)
    if readout is DUAL_GAIN:
        first, later, common = level + (4.0 + 1 / 12) / 1.28**2, level + (1.3**2 + 1 / 12) / 0.08**2, level
    else:
        first, later, common = level + (4.0 + 1 / 12) / 1.28**2, 16.0 * level + 256.0 * (4.0 + 1 / 12) / 1.28**2, 0.0
    edge = np.sort(np.append(NODES, (switch_e - level) / np.sqrt(first)))
    cells = stats.norm.cdf(edge[1:]) - stats.norm.cdf(edge[:-1])
    at = (stats.norm.pdf(edge[:-1]) - stats.norm.pdf(edge[1:])) / cells  # mean of A in each cell [its deviations]
    below = 0.5 * (edge[1:] + edge[:-1]) * np.sqrt(first) + level < switch_e
    mean = np.where(below, at * np.sqrt(first), common / np.sqrt(first) * at)
    square = mean**2 + np.where(below, 0.0, later - common**2 / first)
    expected = (np.sum(cells * square) - np.sum(cells * mean) ** 2) * 1.28**2
    shares = readout.exposure_shares
    found = combined_variance(sensor, [np.full((1, 1), share * level, np.float32) for share in shares])[0, 0]
    assert found == pytest.approx(expected, rel=2e-3)


def test_saturated_photosites_have_no_variance_and_dark_ones_that_of_the_first_reading():
    sensor = hdr_plan(DUAL_GAIN, 8, 8)
    found = combined_variance(sensor, [np.array([[0.0, 1e6]], np.float32)])[0]
    assert found[0] == pytest.approx(4.0 + 1 / 12, rel=1e-4) and found[1] < 1e-6
