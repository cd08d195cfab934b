"""When light reaches each line of the sensor: what a shutter is to the rest of the simulator."""

from dataclasses import dataclass
from typing import Literal

import numpy as np


@dataclass(frozen=True)
class LineTimes:
    """Opening of the shutter over each line (row or column) of the sensor, as a trapezoid over time.

    The share of the light that passes rises evenly from 0 at `opens_s` to `peak` at `open_s`, stays there until `closes_s` and
    falls evenly to 0 at `closed_s`. An electronic shutter has no ramps; a leaf shutter's blades have, and the penumbra of a
    curtain that hangs before the sensor.

    axis: "rows": line i is row i of the sensor, counted from its top; "columns": column i from its left; "all": one line is the
        whole sensor.
    opens_s, open_s, closes_s, closed_s: (lines,) float64, ascending, from the release of the shutter on [s].
    peak: (lines,) float64, share of the light at the widest opening, above 0 and up to 1.
    """

    axis: Literal["rows", "columns", "all"]
    opens_s: np.ndarray
    open_s: np.ndarray
    closes_s: np.ndarray
    closed_s: np.ndarray
    peak: np.ndarray

    @property
    def effective_s(self) -> np.ndarray:
        """Time for which a fully open shutter gives as much of a steady light, (lines,) [s]: the area of the trapezoid."""
        return self.peak * 0.5 * ((self.closed_s - self.opens_s) + (self.closes_s - self.open_s))

    @property
    def is_common(self) -> bool:
        """Whether all lines are open at the same times."""
        times = self.opens_s, self.open_s, self.closes_s, self.closed_s, self.peak
        return all(bool(np.all(one == one[0])) for one in times)


def open_at_once(time_s: float) -> LineTimes:
    """Return the times of a global shutter, open over the whole sensor from 0 to this time [s]."""
    start, end = np.zeros(1), np.full(1, time_s)
    return LineTimes("all", start, start, end, end, np.ones(1))
