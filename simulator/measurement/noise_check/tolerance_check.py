"""A gate: one measured number, the number it should be, and how far apart they may lie."""

import math
from dataclasses import dataclass

from simulator.errors import require

LEAST_SIGMAS = 4.0  # a gate is this many standard errors wide at least, so that chance alone fails one in 16,000


@dataclass(frozen=True)
class Gate:
    """One comparison.

    quantity, unit: what is compared. where: ISO, colour plane or both.
    measured, expected: in that unit. tolerance: largest allowed deviation; relative to `expected` where `relative`.
    error: standard error of the measurement, as a deviation is given.
    ungated: why nothing is asked of it; the numbers are reported all the same.
    """

    quantity: str
    where: str
    measured: float
    expected: float
    tolerance: float
    error: float
    unit: str = ""
    relative: bool = True
    ungated: str = ""

    def __post_init__(self) -> None:
        fits = not self.relative or self.expected > 0 or bool(self.ungated)
        require(fits, f"gate {self.quantity}", self.expected, "a relative deviation needs an expected value above 0")

    @property
    def deviation(self) -> float:
        """Measured less expected, relative where the gate is."""
        difference = self.measured - self.expected
        if not self.relative:
            return difference
        return difference / self.expected if self.expected else math.inf

    @property
    def passed(self) -> bool:
        """Whether the deviation is within the tolerance, or nothing is asked. Never for NaN."""
        return bool(self.ungated) or abs(self.deviation) <= self.tolerance

    def as_dict(self) -> dict[str, object]:
        """Plain data, for JSON."""
        verdict = "not gated" if self.ungated else "pass" if self.passed else "fail"
        deviation = self.deviation if math.isfinite(self.deviation) else None
        return {**self.__dict__, "deviation": deviation, "verdict": verdict}
