"""Dark signal nonuniformity: each photosite has an offset of its own (EMVA 1288 R4.0, section 4)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import Electrons


@dataclass(frozen=True)
class Dsnu(Stage):
    """electrons += N(0, sigma), drawn once for the body.

    sigma_e: standard deviation of the offsets [e-] (EMVA 1288: DSNU), >= 0.
    """

    stem: ClassVar[str] = "dsnu"
    neutral: ClassVar[dict[str, float]] = {"sigma_e": 0.0}
    sigma_e: Electrons

    def __post_init__(self) -> None:
        require(0 <= self.sigma_e < 1e9, "dsnu.sigma", f"{self.sigma_e:g} e-", "a standard deviation is not negative")

    def combined(self, side: int, codes: float) -> "Dsnu":
        """Return the variation of the sum of side x side offsets: sigma * side."""
        return Dsnu(self.sigma_e * side)

    def moments(self, signal: Moments) -> Moments:
        """Give fixed var + sigma^2 [e-^2]."""
        return signal.plus(fixed_variance=self.sigma_e**2)
