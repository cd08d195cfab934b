"""A measured number with the 95 % confidence interval around it."""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
Z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2.0))  # 1.96 standard errors


@dataclass(frozen=True)
class Interval:
    """A value and the ends of its 95 % confidence interval, all in one unit.

    The ends enclose the true value in 95 of 100 equal measurements; an exactly known value equals both ends.
    """

    value: float
    low: float
    high: float

    def covers(self, truth: float) -> bool:
        """Whether the truth lies within."""
        return self.low <= truth <= self.high

    def scaled(self, factor: float) -> "Interval":
        """The same in another unit; factor > 0."""
        return Interval(factor * self.value, factor * self.low, factor * self.high)

    @property
    def standard_error(self) -> float:
        """Standard deviation of the value, from the width of the interval."""
        return (self.high - self.low) / (2.0 * Z)


def normal_interval(value: float, standard_error: float) -> Interval:
    """Interval of a value whose error is normal."""
    return Interval(value, value - Z * standard_error, value + Z * standard_error)


def student_interval(value: float, standard_error: float, degrees: int) -> Interval:
    """Interval of a value whose standard error was itself estimated with these degrees of freedom (Student's t)."""
    reach = float(stats.t.ppf(0.5 + CONFIDENCE / 2.0, degrees)) * standard_error
    return Interval(value, value - reach, value + reach)


def variance_interval(variance: float, degrees: float) -> Interval:
    """Interval of a variance that was estimated with these degrees of freedom (chi-square)."""
    low, high = stats.chi2.ppf([0.5 + CONFIDENCE / 2.0, 0.5 - CONFIDENCE / 2.0], degrees)
    return Interval(variance, variance * degrees / float(low), variance * degrees / float(high))


def root(variance: Interval) -> Interval:
    """Convert a variance to a standard deviation; negative ends become 0."""
    return Interval(*(math.sqrt(max(part, 0.0)) for part in (variance.value, variance.low, variance.high)))


def shifted(interval: Interval, offset: float) -> Interval:
    """Return the interval with an exactly known offset added."""
    return Interval(interval.value + offset, interval.low + offset, interval.high + offset)


def difference(first: Interval, second: Interval) -> Interval:
    """Return the first less the second value, which have independent errors."""
    value = first.value - second.value
    low = math.hypot(first.value - first.low, second.high - second.value)
    return Interval(value, value - low, value + math.hypot(first.high - first.value, second.value - second.low))


def quotient(top: Interval, bottom: Interval) -> Interval:
    """Return the quotient of two values above 0 with independent errors; a lower end of 0 stays 0."""
    value, share = top.value / bottom.value, bottom.standard_error / bottom.value
    ends = [math.hypot((end - top.value) / bottom.value, Z * share * value) for end in (top.low, top.high)]
    return Interval(value, max(value - ends[0], 0.0) if top.low > 0 else top.low / bottom.value, value + ends[1])


def covariance(first: np.ndarray, second: np.ndarray) -> Interval:
    """Return the covariance of two samples; its standard error follows from the scatter of the products of deviations."""
    products = (first - first.mean()) * (second - second.mean())
    return normal_interval(float(products.mean()), float(products.std()) / math.sqrt(products.size))


def weighted_mean(parts: list[Interval]) -> tuple[Interval, float]:
    """Return the mean weighted by inverse variance, and the p-value that all parts measure the same number (chi-square)."""
    weights = [1.0 / max(part.standard_error, 1e-300) ** 2 for part in parts]
    mean = sum(weight * part.value for weight, part in zip(weights, parts, strict=True)) / sum(weights)
    chi2 = sum(weight * (part.value - mean) ** 2 for weight, part in zip(weights, parts, strict=True))
    p_value = float(stats.chi2.sf(chi2, len(parts) - 1)) if len(parts) > 1 else 1.0
    return normal_interval(mean, math.sqrt(1.0 / sum(weights))), p_value
