"""Random telegraph noise: a trap in the source follower captures and releases an electron (Janesick et al. 2006)."""

import math
from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import Electrons


@dataclass(frozen=True)
class RandomTelegraphNoise(Stage):
    """electrons += A * (-1, 0, +1 with probabilities 1/4, 1/2, 1/4) in a share of the photosites.

    Correlated double sampling takes the difference of two samples, hence the three levels. A is drawn once for the body from an
    exponential distribution.

    share: probability of a photosite to have a trap, 0 to 1.
    amplitude_e: mean of A [e-], >= 0.
    """

    stem: ClassVar[str] = "random_telegraph_noise"
    neutral: ClassVar[dict[str, float]] = {"share": 0.0, "amplitude_e": 0.0}
    share: float
    amplitude_e: Electrons

    def __post_init__(self) -> None:
        require(0 <= self.share <= 1, "random_telegraph_noise.share", self.share, "give a share from 0 to 1, such as 1e-3")
        amplitude_e = self.amplitude_e
        require(0 <= amplitude_e < 1e9, "random_telegraph_noise.amplitude", f"{amplitude_e:g} e-", "a jump is not negative")

    def combined(self, side: int, codes: float) -> "RandomTelegraphNoise":
        """Return jumps in sums of side x side photosites: the same variance, in as many of them as have a trap."""
        share = min(1.0, side**2 * self.share)
        scale = side * math.sqrt(self.share / share) if share > 0 else 1.0
        return RandomTelegraphNoise(share, scale * self.amplitude_e)

    def moments(self, signal: Moments) -> Moments:
        """Give var + share * E[A^2] / 2 = var + share amplitude^2, the mean over all photosites."""
        return signal.plus(variance=self.share * self.amplitude_e**2)
