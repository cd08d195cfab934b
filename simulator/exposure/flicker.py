"""Flicker of the light on the scene, whose mean over time is the light that the scene states."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.errors import require
from simulator.units import Degrees, Hertz

KEY = "exposure.flicker"
NARROW = 1e-6  # of a period: over an interval as narrow, the running integral in its middle is its mean


@dataclass(frozen=True)
class Harmonic:
    """One more wave of a flicker.

    order: of the frequency, 2 or more. modulation: amplitude over the mean. phase_deg: of its own wave when the clock is 0.
    """

    order: int
    modulation: float
    phase_deg: Degrees = 0.0


@dataclass(frozen=True)
class MainsFlicker:
    """Lamps on alternating current: light 1 + m cos(2 pi f t + phase) + those of the harmonics.

    A line that is open for T without ramps sees the modulation m |sinc(f T)|: none at T = k / f.
    frequency_hz: of the light, twice that of the mains. modulation: m, amplitude over the mean. phase_deg: when the clock is 0.
    harmonics: waves of multiples of the frequency. Raises PhotositeError for light that would be negative.
    """

    frequency_hz: Hertz
    modulation: float
    phase_deg: Degrees = 0.0
    harmonics: tuple[Harmonic, ...] = ()

    def __post_init__(self) -> None:
        _check_frequency(self.frequency_hz)
        good = 0 <= self.modulation <= 2 and math.isfinite(self.phase_deg)
        require(good, f"{KEY}.modulation", self.modulation, "give amplitude over mean, from 0 to 1, such as 0.3")
        for number, wave in enumerate(self.harmonics):
            good = wave.order >= 2 and 0 <= wave.modulation <= 2
            rule = "give an order of 2 or more and a modulation from 0 to 1"
            require(good, f"{KEY}.harmonics.{number}", f"{wave.order}, {wave.modulation:g}", rule)
        turns = np.linspace(0.0, 2.0 * np.pi, 4096 * max(order for order, _, _ in self._waves()))
        light = 1.0 + np.sum([m * np.cos(order * turns + phase) for order, m, phase in self._waves()], axis=0)
        least = float(light.min())
        rule = f"the light would fall to {least:.3g} of its mean; light is not negative, give a lower modulation"
        require(least > -1e-6, f"{KEY}.modulation", self.modulation, rule)

    def _waves(self) -> list[tuple[int, float, float]]:
        """Return order, modulation and phase [rad] of all waves."""
        own = (1, self.modulation, math.radians(self.phase_deg))
        return [own, *((wave.order, wave.modulation, math.radians(wave.phase_deg)) for wave in self.harmonics)]

    @property
    def steady(self) -> float:
        """The mean."""
        return 1.0

    @property
    def span_s(self) -> tuple[float, float]:
        """Always."""
        return -math.inf, math.inf

    def mean_integral(self, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
        """Return the mean of sin(2 pi f t + phase) / (2 pi f) over the interval: its middle's, times sinc(f width)."""
        middle, width = 0.5 * (begin_s + end_s), end_s - begin_s
        total = np.zeros(np.shape(middle))
        for order, modulation, phase in self._waves():
            turns = order * self.frequency_hz
            total += modulation / (2.0 * np.pi * turns) * np.sin(2.0 * np.pi * turns * middle + phase) * np.sinc(turns * width)
        return total

    def brightness(self, times_s: np.ndarray) -> np.ndarray:
        """Return the light at some instants of the clock [s]."""
        turns = 2.0 * np.pi * self.frequency_hz * np.asarray(times_s)
        return 1.0 + np.sum([m * np.cos(order * turns + phase) for order, m, phase in self._waves()], axis=0)

    def describe(self) -> str:
        """Return the light over time as a formula, t being the clock, with the phases of all waves."""
        own = [(1, self.modulation, self.phase_deg), *((one.order, one.modulation, one.phase_deg) for one in self.harmonics)]
        waves = [
            f"{modulation:g} cos(2 pi {order * self.frequency_hz:g} Hz t{_phase(phase)})" for order, modulation, phase in own
        ]
        return " + ".join(["1", *waves])


@dataclass(frozen=True)
class PwmLamp:
    """Lamps that are switched on and off (pulse-width modulation): light 1 / duty for a share of the period, else 0.

    frequency_hz: of the pulses. duty: share of the period that they are on. phase_deg: of the period when the clock is 0; a
        pulse begins at phase 0.
    """

    frequency_hz: Hertz
    duty: float
    phase_deg: Degrees = 0.0

    def __post_init__(self) -> None:
        _check_frequency(self.frequency_hz)
        good = 0 < self.duty <= 1 and math.isfinite(self.phase_deg)
        require(good, f"{KEY}.duty", self.duty, "give the share of the period that the lamp is on, above 0 and up to 1")

    @property
    def steady(self) -> float:
        """The mean."""
        return 1.0

    @property
    def span_s(self) -> tuple[float, float]:
        """Always."""
        return -math.inf, math.inf

    def mean_integral(self, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
        """Return the mean over the interval of the running integral of light - 1, which rises while the lamp is on."""
        begin, end = (self.frequency_hz * np.asarray(time_s) + self.phase_deg / 360.0 for time_s in (begin_s, end_s))
        width, middle = end - begin, 0.5 * (begin + end)
        is_narrow = width < NARROW
        mean = (self._twice(end) - self._twice(begin)) / np.where(is_narrow, 1.0, width)
        return np.where(is_narrow, self._once(middle), mean) / self.frequency_hz

    def brightness(self, times_s: np.ndarray) -> np.ndarray:
        """Return the light at some instants of the clock [s]."""
        return ((self.frequency_hz * np.asarray(times_s) + self.phase_deg / 360.0) % 1.0 < self.duty) / self.duty

    def _once(self, turns: np.ndarray) -> np.ndarray:
        """Return the integral of light - 1 over the period up to this phase, less its mean over a period [periods]."""
        phase, duty = turns - np.floor(turns), self.duty
        return np.where(phase < duty, phase * (1.0 / duty - 1.0), 1.0 - phase) - 0.5 * (1.0 - duty)

    def _twice(self, turns: np.ndarray) -> np.ndarray:
        """Return the integral of `_once` over the period up to this phase; over a whole period it is 0."""
        phase, duty = turns - np.floor(turns), self.duty
        rising = 0.5 * (1.0 / duty - 1.0) * np.minimum(phase, duty) ** 2
        falling = 0.5 * ((1.0 - duty) ** 2 - (1.0 - np.maximum(phase, duty)) ** 2)
        return rising + falling - 0.5 * (1.0 - duty) * phase

    def describe(self) -> str:
        """Return its numbers, with the place in the period when the clock is 0."""
        begun = f", {self.phase_deg:g} deg of which have passed when the clock is 0" if self.phase_deg else ""
        return f"on for the first {100 * self.duty:g} % of each 1 / {self.frequency_hz:g} Hz{begun}"


def _phase(phase_deg: float) -> str:
    return f" {'-' if phase_deg < 0 else '+'} {abs(phase_deg):g} deg" if phase_deg else ""


def _check_frequency(frequency_hz: float) -> None:
    good = 0 < frequency_hz < math.inf
    require(good, f"{KEY}.frequency", f"{frequency_hz:g} Hz", "give a frequency above 0 Hz, such as 100 Hz")
