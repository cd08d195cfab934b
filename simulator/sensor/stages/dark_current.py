"""Dark current: thermally generated electrons, with their own shot noise (EMVA 1288 R4.0, 2.4)."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

from simulator.errors import require
from simulator.sensor.stages.poisson_variants import choose_poisson_variants
from simulator.sensor.stages.stage import FromShot, Moments, Photodiode, Stage
from simulator.sensor.stages.thermal_generation import check_temperatures, rate_ratio
from simulator.units import ElectronsPerSecond, Kelvins, Seconds


@dataclass(frozen=True)
class DarkCurrent(Stage):
    """electrons += Poisson(rate at this temperature * time).

    rate_e_per_s: mean dark electrons per photosite and second [e-/s], >= 0, at the temperature `measured_at_k`.
    time_s: integration time [s]: the exposure time.
    temperature_k: of the sensor [K].
    measured_at_k: temperature of the measured rate [K].
    """

    stem: ClassVar[str] = "dark_current"
    neutral: ClassVar[dict[str, float]] = {"rate_e_per_s": 0.0, "time_s": 0.0}
    changes_mean: ClassVar[bool] = True
    rate_e_per_s: ElectronsPerSecond
    time_s: Annotated[Seconds, FromShot("exposure_time_s")] = 0.0
    temperature_k: Kelvins = 298.15
    measured_at_k: Kelvins = 298.15

    def __post_init__(self) -> None:
        rate = self.rate_e_per_s
        require(0 <= rate < 1e12, "dark_current.rate", f"{rate:g} e-/s", "a dark current is not negative")
        check_temperatures("dark_current", self.temperature_k, self.measured_at_k)

    @property
    def mean_e(self) -> float:
        """Mean dark electrons of the exposure."""
        return self.rate_e_per_s * rate_ratio(self.temperature_k, self.measured_at_k) * self.time_s

    def kernel_values(self) -> dict[str, float]:
        """Mean dark electrons of the exposure, and the reciprocal of its square root."""
        return {"mean_e": self.mean_e, "root": 1.0 / math.sqrt(self.mean_e) if self.mean_e > 0 else 0.0}

    def kernel_switches(self) -> dict[str, int]:
        """Return the PoissonVariant for the mean, which is the same for all photosites."""
        return {"variant": int(choose_poisson_variants(self.mean_e, self.mean_e))}

    def combined(self, side: int, codes: float) -> "DarkCurrent":
        """Return the dark current of the sum of side x side photosites."""
        return replace(self, rate_e_per_s=side**2 * self.rate_e_per_s)

    def of_photodiode(self, diode: Photodiode) -> Self:
        """Return the stage with the diode's own rate."""
        return replace(self, rate_e_per_s=diode.dark_current * self.rate_e_per_s)

    def moments(self, signal: Moments) -> Moments:
        """Give mean + rate t, var + rate t (Poisson)."""
        return signal.plus(mean=self.mean_e, variance=self.mean_e)
