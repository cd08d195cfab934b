"""Light over time, and what the lines of a sensor collect of it, in closed form.

The opening w(t) of a line is a trapezoid (`LineTimes`), so its derivative is a box on each ramp. With the running integral
P(t) of the light, integration by parts gives

    integral of w l dt up to t = w(t) P(t) - integral of w' P up to t
                               = w(t) P(t) - peak (share of the opening ramp * mean of P over it - the same of the closing),

and for all time peak * (mean of P over the closing ramp - mean of P over the opening ramp). A light states that mean alone.
"""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.exposure.line_times import LineTimes


class LightCurve(Protocol):
    """Brightness of a light over the shot's clock: a steady part, and one that changes."""

    @property
    def steady(self) -> float:
        """The steady part."""
        ...

    @property
    def span_s(self) -> tuple[float, float]:
        """First and last instant of the clock at which there is light [s]."""
        ...

    def brightness(self, times_s: np.ndarray) -> np.ndarray:
        """Return the light at some instants of the clock [s], of the same shape."""
        ...

    def mean_integral(self, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
        """Return the mean over an interval of the clock of the running integral of the part that changes.

        begin_s <= end_s: arrays of one shape [s]; where they are equal, the running integral itself. Its start is arbitrary.
        """
        ...


@dataclass(frozen=True)
class SteadyLight:
    """Light that does not change: 1."""

    steady: float = 1.0
    span_s: tuple[float, float] = (-math.inf, math.inf)

    def brightness(self, times_s: np.ndarray) -> np.ndarray:
        """Return 1."""
        return np.ones(np.shape(times_s))

    def mean_integral(self, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
        """Return 0."""
        return np.zeros(np.broadcast_shapes(np.shape(begin_s), np.shape(end_s)))


def collect(light: LightCurve, lines: LineTimes, release_s: float, until_s: np.ndarray | None = None) -> np.ndarray:
    """Return the integral of opening times light of each line, float64: (lines,), or up to some instants (lines, instants).

    release_s: when the shutter is released, on the clock of the light [s]. until_s: instants of that clock [s], (instants,) or
        those of each line, (lines, instants).
    The unit is that of the light times s.
    """
    ramps = (lines.opens_s, lines.open_s), (lines.closes_s, lines.closed_s)
    if until_s is None:
        opening, closing = (light.mean_integral(release_s + begin, release_s + end) for begin, end in ramps)
        return light.steady * lines.effective_s + lines.peak * (closing - opening)
    until = np.atleast_2d(np.asarray(until_s, np.float64)) - release_s
    now = light.mean_integral(release_s + until, release_s + until)
    result, width = np.zeros((2, len(lines.peak), until.shape[1]))
    for sign, (begin, end) in zip((1.0, -1.0), ramps, strict=True):
        begin, end = begin[:, None], end[:, None]
        reached = np.clip(until, begin, end)
        with np.errstate(invalid="ignore"):
            share = np.where(end > begin, (reached - begin) / (end - begin), until >= begin)
        # The steady part of what a ramp has let through: from its middle on, and on the ramp in proportion to share^2.
        width += sign * (share * (until - reached) + 0.5 * share * (reached - begin))
        mean = light.mean_integral(release_s + np.broadcast_to(begin, reached.shape), release_s + reached)
        result += sign * share * (now - mean)
    return lines.peak[:, None] * (light.steady * width + result)
