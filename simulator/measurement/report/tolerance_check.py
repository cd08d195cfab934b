"""Tolerance check: one measured number, the number expected of it, and the largest deviation allowed."""

import math
from dataclasses import dataclass

from simulator.errors import require

LEAST_SIGMAS = 4.0  # least tolerance in standard errors, so that chance alone fails one check in 16,000


@dataclass(frozen=True)
class ToleranceCheck:
    """Comparison of one measured number with its expected value.

    quantity, unit: what is compared. where: ISO, colour plane or both.
    measured, expected: in that unit. tolerance: largest allowed deviation; relative to `expected` where `relative`.
    error: standard error of the measurement, relative or absolute like the tolerance.
    reason_unchecked: why this number cannot fail; it is reported all the same. Empty where it is checked.
    """

    quantity: str
    where: str
    measured: float
    expected: float
    tolerance: float
    error: float
    unit: str = ""
    relative: bool = True
    reason_unchecked: str = ""

    def __post_init__(self) -> None:
        fits = not self.relative or self.expected > 0 or bool(self.reason_unchecked)
        require(fits, f"tolerance check {self.quantity}", self.expected, "a relative deviation needs an expected value above 0")

    @property
    def deviation(self) -> float:
        """Measured less expected; relative to expected where the tolerance is."""
        difference = self.measured - self.expected
        if not self.relative:
            return difference
        return difference / self.expected if self.expected else math.inf

    @property
    def passed(self) -> bool:
        """Whether the deviation is within the tolerance, or the number is not checked. Never for NaN."""
        return bool(self.reason_unchecked) or abs(self.deviation) <= self.tolerance

    def as_dict(self) -> dict[str, object]:
        """Return plain data for JSON, with the keys that the report files have."""
        verdict = "not gated" if self.reason_unchecked else "pass" if self.passed else "fail"
        deviation = self.deviation if math.isfinite(self.deviation) else None
        fields = {"ungated" if name == "reason_unchecked" else name: value for name, value in self.__dict__.items()}
        return {**fields, "deviation": deviation, "verdict": verdict}
