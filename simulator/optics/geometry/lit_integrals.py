"""Integrals over time of what moves, times light that may change faster than what moves."""

import numpy as np

from simulator.exposure.light_curve import LightCurve

EVEN = 1e-6  # of the brightest light, by which even light may differ from its mean


def cell_light(light: LightCurve, borders_s: np.ndarray) -> np.ndarray:
    """Return the mean brightness between neighbouring instants of the clock (cells + 1,) [s], (cells,) float64.

    Where it is as bright in the middle it is that brightness, without the rounding of a difference.
    """
    middles = light.brightness(0.5 * (borders_s[1:] + borders_s[:-1])).astype(np.float64)
    come = light.mean_integral(borders_s, borders_s)
    means = light.steady + np.diff(come) / np.diff(borders_s)
    is_even = np.abs(means - middles) <= EVEN * max(float(np.abs(middles).max()), float(np.abs(means).max()))
    return np.where(is_even, middles, means)


class LitIntegrals:
    """Integrals from the first time on of values that are linear in each of many equal cells, times light.

    Light that is even over all cells is a factor. Other light is integrated in closed form, however often it changes within a
    cell: with its running integral P, the changing part of the integral of v l from the cell's begin b to t is
    v(b) (P(t) - P(b)) + (v(t) - v(b)) (P(t) - mean of P from b to t).
    """

    def __init__(
        self, times_s: np.ndarray, values: np.ndarray, light: LightCurve, brightness: np.ndarray, start_s: float
    ) -> None:
        """times_s: (cells + 1,) from start_s on the light's clock on [s]. values: (cells + 1, values).

        brightness: `cell_light` of the cells.
        """
        self.times_s, self.values, self.light, self.start_s = times_s, values, light, start_s
        self.is_even = bool(np.all(brightness == brightness[0]))
        self.level = float(brightness[0]) if self.is_even else light.steady
        steps = self.level * (0.5 * np.diff(times_s)[:, None] * (values[1:] + values[:-1]))
        if not self.is_even:
            steps += self._changing(times_s[:-1], times_s[1:], values[:-1], values[1:])
        self.sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(steps, axis=0)])

    def __call__(self, times_s: np.ndarray) -> np.ndarray:
        """Integrals up to times of any shape, (..., values)."""
        cell_s = (self.times_s[-1] - self.times_s[0]) / (len(self.times_s) - 1)
        place = np.clip((times_s - self.times_s[0]) / max(cell_s, 1e-300), 0.0, len(self.times_s) - 1.0)
        cell = np.minimum(place.astype(np.int64), len(self.times_s) - 2)
        part = (place - cell)[..., None]
        here, next_ = self.values[cell], self.values[cell + 1]
        found = self.sums[cell] + cell_s * self.level * (part * (here + 0.5 * part * (next_ - here)))
        if not self.is_even:
            now_s = np.clip(times_s, self.times_s[0], self.times_s[-1])
            found += self._changing(self.times_s[cell], now_s, here, here + part * (next_ - here))
        return found

    def _changing(self, begin_s: np.ndarray, end_s: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Integral of the changing part of the light times values that go evenly from first to last, (..., values)."""
        begin, end = self.start_s + begin_s, self.start_s + end_s
        before, come = (self.light.mean_integral(one, one)[..., None] for one in (begin, end))
        mean = self.light.mean_integral(begin, end)[..., None]
        return first * (come - before) + (last - first) * (come - mean)
