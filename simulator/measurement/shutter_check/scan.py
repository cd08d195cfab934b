"""How a shutter crosses the sensor, in closed form."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scan:
    """A shutter that opens one line after the other.

    time_s: from the first line to one past the last.
    bend: of curtains, a T^2 / (2 width) for an acceleration a: share of the way that is made by accelerating, -1 to 1.
    """

    time_s: float
    bend: float = 0.0


def crossing_share(place: np.ndarray, bend: float) -> np.ndarray:
    """Return when an edge comes to these places, as share of the travel time; place: share of the way, 0 to 1.

    The way after the share x of the time is (1 - bend) x + bend x^2.
    """
    first = 1.0 - bend
    return 2.0 * place / (first + np.sqrt(np.maximum(first**2 + 4.0 * bend * place, 0.0)))


def crossing_speed(place: np.ndarray, bend: float) -> np.ndarray:
    """Return the speed of an edge at these places, relative to its mean speed."""
    return np.sqrt(np.maximum((1.0 - bend) ** 2 + 4.0 * bend * place, 0.0))
