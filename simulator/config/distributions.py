"""Distributions that configurations draw numbers from, each as its quantile function.

A draw is the quantile at one uniform random number (inverse transform sampling), so it is a pure function of that number: it
takes one random word whatever the distribution, and any version of NumPy gives the same result.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass
from itertools import accumulate, pairwise
from statistics import NormalDist

from simulator.color.reproducible import nine_digits
from simulator.errors import require


@dataclass(frozen=True)
class Uniform:
    """Every number between two is equally likely.

    uniform: least and greatest number.
    """

    uniform: tuple[float, float]

    def __post_init__(self) -> None:
        _check_range("uniform", self.uniform)

    def quantile(self, probability: float) -> float:
        """Return the quantile at a probability from 0 to 1."""
        low, high = self.uniform
        return low + (high - low) * probability


@dataclass(frozen=True)
class LogUniform:
    """Every ratio is equally likely: the logarithm is uniform.

    log_uniform: least and greatest number, both above 0.
    """

    log_uniform: tuple[float, float]

    def __post_init__(self) -> None:
        _check_range("log_uniform", self.log_uniform)
        require(self.log_uniform[0] > 0, "log_uniform", list(self.log_uniform), "only numbers above 0 have a logarithm")

    def quantile(self, probability: float) -> float:
        """Return the quantile at a probability from 0 to 1."""
        low, high = self.log_uniform
        return low * math.exp(math.log(high / low) * probability)


@dataclass(frozen=True)
class Normal:
    """A normal distribution, whole or cut off.

    normal: mean and standard deviation.
    within: least and greatest number; what lies beyond is not drawn.
    """

    normal: tuple[float, float]
    within: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        require(self.normal[1] > 0, "normal", list(self.normal), "give mean and a standard deviation above 0")
        if self.within is not None:
            _check_range("within", self.within)
            low, high = self._probabilities()
            rule = "lies so far from the mean that nothing of the distribution is left; widen it"
            require(high - low > 1e-9, "within", list(self.within), rule)

    def quantile(self, probability: float) -> float:
        """Return the quantile at a probability between 0 and 1, both excluded."""
        low, high = self._probabilities()
        value = NormalDist(*self.normal).inv_cdf(min(max(low + (high - low) * probability, 1e-300), 1.0 - 2.0**-53))
        return value if self.within is None else min(max(value, self.within[0]), self.within[1])

    def _probabilities(self) -> tuple[float, float]:
        """Return the cumulative probabilities of the whole distribution at both ends of `within`."""
        if self.within is None:
            return 0.0, 1.0
        whole = NormalDist(*self.normal)
        return whole.cdf(self.within[0]), whole.cdf(self.within[1])


@dataclass(frozen=True)
class Choice:
    """One of a few numbers.

    choice: the numbers.
    weights: how likely each is against the others; all alike when left out.
    """

    choice: tuple[float, ...]
    weights: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        require(bool(self.choice), "choice", "[]", "give at least one number")
        rule = f"give one weight for each of the {len(self.choice)} numbers"
        require(self.weights is None or len(self.weights) == len(self.choice), "weights", self.weights, rule)
        check_weights("weights", self.weights or (1.0,))

    def quantile(self, probability: float) -> float:
        """Return the quantile at a probability from 0 to 1, of the numbers in the order listed."""
        return self.choice[weighted_index(self.weights or (1.0,) * len(self.choice), probability)]


@dataclass(frozen=True)
class Table:
    """Any distribution by its cumulative distribution function, straight between the points given.

    table: points [number, share of all that lies below it], the shares from 0 to 1.
    """

    table: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        rule = "give at least two points [number, share below], numbers and shares ascending, shares from 0 to 1"
        rises = all(a[0] < b[0] and a[1] <= b[1] for a, b in pairwise(self.table))
        good = len(self.table) > 1 and rises and self.table[0][1] == 0.0 and self.table[-1][1] == 1.0
        require(good, "table", [list(point) for point in self.table], rule)

    def quantile(self, probability: float) -> float:
        """Return the quantile at a probability from 0 to 1."""
        last = len(self.table) - 2
        place = min(max(bisect_right(self.table, probability, key=lambda point: point[1]) - 1, 0), last)
        (low, below), (high, above) = self.table[place : place + 2]
        return high if above == below else low + (high - low) * min((probability - below) / (above - below), 1.0)


Distribution = float | Uniform | LogUniform | Normal | Choice | Table


def draw(distribution: Distribution, probability: float) -> float:
    """Return the quantile at a probability from 0 to 1, to nine significant digits; a plain number is its own quantile.

    So the last-bit differences between logarithms of different machines do not show.
    """
    value = distribution if isinstance(distribution, float | int) else distribution.quantile(probability)
    return nine_digits(value)


def weighted_index(weights: tuple[float, ...], probability: float) -> int:
    """Return the index at which the running sum of the weights, over their total, passes a probability from 0 to 1."""
    ends = list(accumulate(weights))
    return min(bisect_right(ends, probability * ends[-1]), max(place for place, weight in enumerate(weights) if weight > 0))


def check_weights(key: str, weights: tuple[float, ...]) -> None:
    """Raise PhotositeError unless the weights are at least 0 and one is above."""
    require(all(weight >= 0 for weight in weights) and sum(weights) > 0, key, list(weights), "give weights of 0 or above")


def support_of(distribution: Distribution) -> tuple[float, float]:
    """Return the least and the greatest number that can be drawn."""
    if isinstance(distribution, Choice):
        return min(distribution.choice), max(distribution.choice)
    return draw(distribution, 0.0), draw(distribution, 1.0)


def _check_range(key: str, ends: tuple[float, float]) -> None:
    require(ends[0] < ends[1], key, list(ends), "give the least number first, then a greater one")
