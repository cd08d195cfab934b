"""Column offset: the amplifiers and ADCs of the columns differ (EMVA 1288 R4.0: DSNU.col)."""

import math
from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class ColumnOffset(Stage):
    """signal += N(0, sigma) of the column, drawn once for the body.

    sigma_dn: standard deviation over the columns [DN], >= 0.
    """

    stem: ClassVar[str] = "column_offset"
    neutral: ClassVar[dict[str, float]] = {"sigma_dn": 0.0}
    sigma_dn: DigitalNumbers

    def __post_init__(self) -> None:
        require(
            0 <= self.sigma_dn < 1e6, "column_offset.sigma", f"{self.sigma_dn:g} DN", "a standard deviation is not negative"
        )

    def combined(self, side: int, codes: float) -> "ColumnOffset":
        """Return the offset of the mean of `side` columns: sigma / sqrt(side)."""
        return ColumnOffset(codes * self.sigma_dn / math.sqrt(side))

    def moments(self, signal: Moments) -> Moments:
        """Give fixed var + sigma^2 [DN^2]."""
        return signal.plus(fixed_variance=self.sigma_dn**2)
