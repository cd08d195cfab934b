"""Binning: several photosites of one colour are combined into one."""

from dataclasses import dataclass
from typing import Literal

from simulator.errors import require
from simulator.sensor.stages.stage import Moments


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
        return Moments(self.count * signal.mean, self.count * signal.variance, self.count * signal.fixed_variance)

    def of_code(self, signal: Moments) -> Moments:
        """Return the moments of the rounded mean of independent codes [DN]; noise common to rows or columns decreases less."""
        if self.mode == "charge":
            return signal
        return Moments(signal.mean, signal.variance / self.count + 1.0 / 12.0, signal.fixed_variance / self.count)
