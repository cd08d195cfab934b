"""The middle of an exposure is the mean time of the light, line by line."""

import numpy as np

from simulator.exposure.line_times import LineTimes, open_at_once
from simulator.exposure.mid_exposure import mid_exposure_s


def test_a_shutter_that_opens_at_once_has_its_middle_at_half_time():
    np.testing.assert_allclose(mid_exposure_s([open_at_once(0.02)]), [0.01], rtol=1e-15)


def test_trapezoids_are_integrated():
    """Against sums of fine steps."""
    opens, is_open = np.array([0.1, 0.2, 0.3]), np.array([0.15, 0.5, 0.3])
    closes, closed = np.array([0.4, 0.5, 0.9]), np.array([0.9, 0.6, 0.9])
    peaks = np.array([0.5, 1.0, 0.2])
    first, later = LineTimes("rows", opens, is_open, closes, closed, peaks), open_at_once(2.0)
    times_s = np.linspace(0, 2, 400_001)
    weights = np.zeros((3, len(times_s)))
    for line in range(3):
        corners = opens[line] - 1e-12, is_open[line], closes[line], closed[line] + 1e-12
        weights[line] = np.interp(times_s, corners, [0, peaks[line], peaks[line], 0])
    middle = (weights @ times_s) / weights.sum(axis=1)
    np.testing.assert_allclose(mid_exposure_s([first]), middle, atol=2e-5)  # steps of 5e-6 s
    both = ((weights + 1) @ times_s) / (weights + 1).sum(axis=1)
    np.testing.assert_allclose(mid_exposure_s([first, later]), both, atol=2e-5)
