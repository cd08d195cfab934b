"""Photo response nonuniformity: photosites differ in sensitivity (EMVA 1288 R4.0, section 4)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import NORMAL_REACH, Means, Moments, Region, Stage


@dataclass(frozen=True)
class Prnu(Stage):
    """mean electrons *= 1 + N(0, sigma), drawn once for the body.

    sigma: standard deviation of the response, relative to its mean (EMVA 1288: PRNU), 0 to 0.2.
    """

    stem: ClassVar[str] = "prnu"
    neutral: ClassVar[dict[str, float]] = {"sigma": 0.0}
    sigma: float

    def __post_init__(self) -> None:
        require(0 <= self.sigma <= 0.2, "prnu.sigma", self.sigma, "give a share from 0 to 0.2, such as 0.01 for 1 %")

    def combined(self, side: int, codes: float) -> "Prnu":
        """Return the variation of the mean response of side x side photosites: sigma / side."""
        return Prnu(self.sigma / side)

    def moments(self, signal: Moments) -> Moments:
        """Give fixed var + (sigma mean)^2."""
        return signal.plus(fixed_variance=(self.sigma * signal.mean) ** 2)

    def mean_range(self, low: Means, high: Means, region: Region) -> tuple[Means, Means]:
        """Response of the least and the most sensitive photosite; not below 0."""
        reach = NORMAL_REACH * self.sigma
        return low * max(0.0, 1.0 - reach), high * (1.0 + reach)
