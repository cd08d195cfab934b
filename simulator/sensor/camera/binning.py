"""Binning: several photosites of one colour are combined into one."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, SignalStep, Stage


@dataclass(frozen=True)
class Binning:
    """factor x factor photosites of one colour are combined into one; the pattern of the colour filter array is preserved.

    factor: 2, 3 or 4.
    mode: "charge" sums the electrons before they are read, so that read noise is added once; "average" rounds the mean of
        the codes.
    """

    factor: int = 2
    mode: Literal["charge", "average"] = "charge"

    def __post_init__(self) -> None:
        require(self.factor in (2, 3, 4), "camera.binning.factor", self.factor, "give 2, 3 or 4")
        require(self.mode in ("charge", "average"), "camera.binning.mode", self.mode, "give charge or average")

    @property
    def count(self) -> int:
        """Number of photosites that are combined into one."""
        return self.factor**2

    def of_charge(self, signal: Moments) -> Moments:
        """Return the moments of the sum of equally illuminated photosites [e-]."""
        if self.mode == "average":
            return signal
        temporal = self.count * (signal.variance + signal.shared_variance)
        return Moments(self.count * signal.mean, temporal, self.count * signal.fixed_variance)

    def of_code(self, signal: Moments) -> Moments:
        """Return the moments of the rounded mean of codes [DN]; a fixed pattern that they share decreases less than told."""
        if self.mode == "charge":
            return signal
        temporal = (signal.variance + signal.shared_variance) / self.count
        return Moments(signal.mean, temporal + 1.0 / 12.0, signal.fixed_variance / self.count)

    def of_rows(self, stage: Stage, step: int) -> SignalStep:
        """Return the effect of a stage that is common to rows, where photosites are averaged that lie `step` apart."""
        rows = step * np.arange(self.factor)
        kept = float(np.sum(stage.row_correlation(rows[:, None] - rows))) - 1.0  # of the mean: (1 + kept) / count

        def moments(signal: Moments) -> Moments:
            after = stage.moments(signal)
            return after.plus(shared_variance=kept * (after.variance - signal.variance))

        return SignalStep(stage.stem, moments)
