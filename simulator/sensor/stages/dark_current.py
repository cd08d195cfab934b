"""Dark current: thermally generated electrons, with their own shot noise (EMVA 1288 R4.0, 2.4)."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

from simulator.errors import require
from simulator.sensor.stages.poisson_variants import choose_poisson_variants
from simulator.sensor.stages.stage import FromShot, Moments, Stage
from simulator.units import ElectronsPerSecond, Kelvins, Seconds

BOLTZMANN_EV_PER_K = 8.617333262e-5  # CODATA 2018


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
        for key, kelvins in (("temperature", self.temperature_k), ("measured_at", self.measured_at_k)):
            require(150 <= kelvins <= 400, f"dark_current.{key}", f"{kelvins:g} K", "give 150 to 400 K, such as 298.15 K")

    @property
    def mean_e(self) -> float:
        """Mean dark electrons of the exposure."""
        share = thermal_generation(self.temperature_k) / thermal_generation(self.measured_at_k)
        return self.rate_e_per_s * share * self.time_s

    def kernel_values(self) -> dict[str, float]:
        """Mean dark electrons of the exposure, and the reciprocal of its square root."""
        return {"mean_e": self.mean_e, "root": 1.0 / math.sqrt(self.mean_e) if self.mean_e > 0 else 0.0}

    def kernel_switches(self) -> dict[str, int]:
        """Return the PoissonVariant for the mean, which is the same for all photosites."""
        return {"variant": int(choose_poisson_variants(self.mean_e, self.mean_e))}

    def moments(self, signal: Moments) -> Moments:
        """Give mean + rate t, var + rate t (Poisson)."""
        return signal.plus(mean=self.mean_e, variance=self.mean_e)


def thermal_generation(temperature_k: float) -> float:
    """Return T^1.5 exp(-Eg(T) / 2 k T), to which dark current is proportional (Janesick 2001, eq. 7.23).

    Eg: band gap of silicon, 1.1557 eV - 7.021e-4 T^2 / (1108 K + T) eV (Varshni 1967).
    """
    gap_ev = 1.1557 - 7.021e-4 * temperature_k**2 / (1108.0 + temperature_k)
    return temperature_k**1.5 * math.exp(-gap_ev / (2.0 * BOLTZMANN_EV_PER_K * temperature_k))
