"""Dark current: electrons that heat sets free, counted with a shot noise of their own (EMVA 1288 R4.0, 2.4)."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from simulator.errors import require
from simulator.stage import FromShot, Moments, Stage
from simulator.units import ElectronsPerSecond, Seconds


@dataclass(frozen=True)
class DarkCurrent(Stage):
    """electrons += Poisson(rate * time).

    rate_e_per_s: mean dark electrons per photosite and second [e-/s], >= 0.
    time_s: how long they gather [s]: the exposure time.
    """

    stem: ClassVar[str] = "dark_current"
    rate_e_per_s: ElectronsPerSecond
    time_s: Annotated[Seconds, FromShot("exposure_time_s")] = 0.0

    def __post_init__(self):
        require(self.rate_e_per_s >= 0, "dark_current.rate", f"{self.rate_e_per_s} e-/s", "a dark current is not negative")

    def moments(self, signal: Moments) -> Moments:
        """Give mean + rate t, var + rate t (Poisson)."""
        dark_e = self.rate_e_per_s * self.time_s
        return Moments(signal.mean + dark_e, signal.variance + dark_e)
