"""Banding: ripple of the supply voltage modulates the rows sinusoidally."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage, Value
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class Banding(Stage):
    """signal += amplitude * sin(2 pi (y / period + phase)), y the row, the phase new in each frame.

    amplitude_dn: [DN], >= 0.
    period_px: period in rows, >= 2: period of the ripple divided by the readout time of a row.
    """

    stem: ClassVar[str] = "banding"
    neutral: ClassVar[dict[str, float]] = {"amplitude_dn": 0.0}
    is_common_to_rows: ClassVar[bool] = True
    rows_are_independent: ClassVar[bool] = False
    amplitude_dn: DigitalNumbers
    period_px: float

    def __post_init__(self) -> None:
        amplitude_dn = self.amplitude_dn
        require(0 <= amplitude_dn < 1e6, "banding.amplitude", f"{amplitude_dn:g} DN", "an amplitude is not negative")
        require(2 <= self.period_px < 1e6, "banding.period", self.period_px, "give 2 rows or more")

    def kernel_values(self) -> dict[str, float]:
        """Return the amplitude, and turns per row."""
        return {"amplitude_dn": self.amplitude_dn, "turns_per_row": 1.0 / self.period_px}

    def combined(self, side: int, codes: float) -> "Banding | None":
        """Return the ripple of the mean of `side` rows; None where its period is less than 2 of them.

        The mean of n rows of a sinusoid of f turns per row has sin(pi f n) / (n sin(pi f)) of its amplitude.
        """
        period_px, half_turn = self.period_px / side, math.pi / self.period_px
        share = abs(math.sin(side * half_turn) / (side * math.sin(half_turn)))
        return Banding(codes * share * self.amplitude_dn, period_px) if period_px >= 2 else None

    def row_correlation(self, rows: Value) -> Value:
        """Return cos(2 pi rows / period): that of a sine of random phase."""
        return np.cos(2.0 * np.pi / self.period_px * np.asarray(rows))

    def moments(self, signal: Moments) -> Moments:
        """Give var + amplitude^2 / 2 [DN^2] (a sine of random phase)."""
        return signal.plus(variance=0.5 * self.amplitude_dn**2)
