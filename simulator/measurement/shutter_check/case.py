"""A measurement of a shutter: the frames that it needs, and what it finds in them."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.measurement.report.tolerance_check import LEAST_SIGMAS, ToleranceCheck
from simulator.measurement.shutter_check.frames import Frame, ShutterBench, TakenFrame

LEAST_TOLERANCE = 1e-5  # single precision and the rounding of codes
LARGEST_TOLERANCE = 0.25  # a wider one would let anything pass


@dataclass(frozen=True)
class Curve:
    """A measured curve beside the fitted or stated one, for the report.

    x, measured, model: (points,).
    """

    title: str
    x_label: str
    y_label: str
    x: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    model_label: str = "fitted"


@dataclass(frozen=True)
class Findings:
    """What a measurement found: checks against what the shot states, and curves."""

    checks: tuple[ToleranceCheck, ...]
    curves: tuple[Curve, ...] = ()


class ShutterCase(Protocol):
    """A measurement of one kind."""

    def frames(self, bench: ShutterBench) -> list[Frame]:
        """Return the frames that it needs."""
        ...

    def measure(self, bench: ShutterBench, files: Mapping[str, TakenFrame]) -> Findings:
        """Measure these frames, by name, from their raw files, and compare. Raises PhotositeError."""
        ...


def check_number(
    quantity: str, where: str, measured: float, expected: float, error: float, unit: str = "", reason: str = ""
) -> ToleranceCheck:
    """Return the check of a number whose tolerance is LEAST_SIGMAS standard errors, and LEAST_TOLERANCE at least.

    error: standard error, in the unit of the number. reason: why it is not gated; nor is it where the noise leaves a tolerance
    over LARGEST_TOLERANCE.
    """
    if expected == 0:
        return ToleranceCheck(quantity, where, measured, 0.0, LEAST_SIGMAS * error, error, unit, False, reason)
    share = error / abs(expected)
    if LEAST_SIGMAS * share > LARGEST_TOLERANCE:
        reason = reason or f"{LEAST_SIGMAS:g} standard errors are {100 * LEAST_SIGMAS * share:.2g} %"
    tolerance = max(LEAST_SIGMAS * share, LEAST_TOLERANCE)
    return ToleranceCheck(quantity, where, measured, expected, tolerance, share, unit, reason_unchecked=reason)


def mean_of(values: np.ndarray) -> tuple[float, float]:
    """Return the mean and its standard error, from how values differ from their neighbours."""
    scatter = float(np.sqrt(0.5 * np.mean(np.diff(values) ** 2)))
    return float(values.mean()), scatter / np.sqrt(values.size)
