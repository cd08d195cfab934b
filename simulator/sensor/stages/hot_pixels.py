"""Hot pixels: some photosites have a far larger dark current (Janesick 2001, dark current spikes)."""

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

from simulator.errors import require
from simulator.sensor.stages.stage import FromShot, Moments, Photodiode, Stage
from simulator.sensor.stages.thermal_generation import check_temperatures, rate_ratio
from simulator.units import ElectronsPerSecond, Kelvins, Seconds


@dataclass(frozen=True)
class HotPixels(Stage):
    """electrons += Poisson(mean * E) in a share of the photosites; E, exponential with mean 1, is drawn once for the body.

    share: probability of a photosite to be hot, 0 to 1.
    rate_e_per_s: mean dark current of the hot photosites [e-/s], >= 0, at the temperature `measured_at_k`.
    time_s: integration time [s]: the exposure time.
    temperature_k: of the sensor [K]. The rate follows it as dark current does; spikes of high fields follow it less (Janesick
        2001).
    measured_at_k: temperature of the measured rate [K].
    """

    stem: ClassVar[str] = "hot_pixels"
    neutral: ClassVar[dict[str, float]] = {"share": 0.0, "rate_e_per_s": 0.0, "time_s": 0.0}
    is_defect: ClassVar[bool] = True
    share: float
    rate_e_per_s: ElectronsPerSecond
    time_s: Annotated[Seconds, FromShot("exposure_time_s")] = 0.0
    temperature_k: Kelvins = 298.15
    measured_at_k: Kelvins = 298.15

    def __post_init__(self) -> None:
        require(0 <= self.share <= 1, "hot_pixels.share", self.share, "give a share from 0 to 1, such as 1e-4")
        rate = self.rate_e_per_s
        require(0 <= rate < 1e12, "hot_pixels.rate", f"{rate:g} e-/s", "a dark current is not negative")
        check_temperatures("hot_pixels", self.temperature_k, self.measured_at_k)

    def kernel_values(self) -> dict[str, float]:
        """Return the share, and the mean dark electrons of hot photosites."""
        ratio = rate_ratio(self.temperature_k, self.measured_at_k)
        return {"share": self.share, "mean_e": self.rate_e_per_s * ratio * self.time_s}

    def combined(self, side: int, codes: float) -> "HotPixels":
        """Return hot photosites among sums of side x side: the same mean dark current, in as many of them."""
        share = min(1.0, side**2 * self.share)
        rate = self.rate_e_per_s * side**2 * self.share / share if share > 0 else 0.0
        return replace(self, share=share, rate_e_per_s=rate)

    def of_photodiode(self, diode: Photodiode) -> Self:
        """Return the stage with the diode's own rate."""
        return replace(self, rate_e_per_s=diode.dark_current * self.rate_e_per_s)

    def moments(self, signal: Moments) -> Moments:
        """Return those of a photosite that is not hot."""
        return signal
