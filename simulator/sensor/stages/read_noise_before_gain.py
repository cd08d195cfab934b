"""Read noise before the analog gain: pixel source follower and column reset (EMVA 1288: part of sigma_d)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import Electrons


@dataclass(frozen=True)
class ReadNoiseBeforeGain(Stage):
    """electrons += N(0, sigma), independent per photosite and frame.

    sigma_e: standard deviation [e-], >= 0; the root mean square over photosites when they differ.
    spread: standard deviation of ln sigma from photosite to photosite, drawn once for the body, 0 to 1.
    """

    stem: ClassVar[str] = "read_noise_before_gain"
    in_camera_stages: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {"sigma_e": 0.0}
    sigma_e: Electrons
    spread: float = 0.0

    def __post_init__(self) -> None:
        require(self.sigma_e >= 0, "read_noise_before_gain.sigma", f"{self.sigma_e} e-", "a standard deviation is not negative")
        require(0 <= self.spread <= 1, "read_noise_before_gain.spread", self.spread, "give 0 to 1, such as 0.2")

    def kernel_switches(self) -> dict[str, int]:
        """Return whether sigma differs between photosites."""
        return {"spreads": int(self.spread > 0)}

    def moments(self, signal: Moments) -> Moments:
        """Give var + sigma^2 [e-^2]."""
        return signal.plus(variance=self.sigma_e**2)
