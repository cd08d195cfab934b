"""Read noise after the analog gain: output amplifier and ADC input (the sigma_post of a two-source model)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.stage import Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class ReadNoiseAfterGain(Stage):
    """signal += N(0, sigma), independent per photosite and frame; seen from the pixel it is sigma / K.

    sigma_dn: standard deviation [DN], >= 0.
    """

    stem: ClassVar[str] = "read_noise_after_gain"
    in_camera_stages: ClassVar[bool] = False
    sigma_dn: DigitalNumbers

    def __post_init__(self):
        rule = "a standard deviation is not negative"
        require(self.sigma_dn >= 0, "read_noise_after_gain.sigma", f"{self.sigma_dn} DN", rule)

    def moments(self, signal: Moments) -> Moments:
        """Give var + sigma^2 [DN^2]."""
        return Moments(signal.mean, signal.variance + self.sigma_dn**2)
