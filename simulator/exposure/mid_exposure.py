"""Middle of the exposure of each line: the mean of the times at which it gets light."""

from collections.abc import Sequence

import numpy as np

from simulator.exposure.line_times import LineTimes


def mid_exposure_s(openings: Sequence[LineTimes]) -> np.ndarray:
    """Return the centre of gravity of the shutter's opening over each line, (lines,) float64, from its release on [s].

    openings: trapezoids that add up, of the same lines.
    """
    area, moment = np.zeros(1), np.zeros(1)
    for one in openings:
        opens, is_open, closes, closed = one.opens_s, one.open_s, one.closes_s, one.closed_s
        rising = (is_open - opens) * (opens + 2.0 * is_open) / 6.0
        falling = (closed - closes) * (2.0 * closes + closed) / 6.0
        area = area + one.effective_s
        moment = moment + one.peak * (rising + 0.5 * (closes**2 - is_open**2) + falling)
    return moment / area
