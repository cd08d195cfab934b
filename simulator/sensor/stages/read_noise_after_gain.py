"""Read noise after the analog gain: output amplifier and ADC input (the sigma_post of a two-source model)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.sensor.stages.tukey_lambda_polynomial import GREATEST_LAMBDA, LEAST_LAMBDA, tukey_polynomial
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class ReadNoiseAfterGain(Stage):
    """signal += noise of standard deviation sigma, independent per photosite and frame; referred to electrons it is sigma / K.

    sigma_dn: standard deviation [DN], >= 0, whatever the distribution.
    tukey_lambda: shape of a Tukey-lambda distribution, -0.3 to 0.25 (0.14 is nearly normal, less has longer tails);
        none: normal. Published "scales" of such fits are sigma / scipy.stats.tukeylambda.std(tukey_lambda).
    """

    stem: ClassVar[str] = "read_noise_after_gain"
    in_camera_stages: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {"sigma_dn": 0.0}
    sigma_dn: DigitalNumbers
    tukey_lambda: float | None = None

    def __post_init__(self) -> None:
        rule = "a standard deviation is not negative"
        require(self.sigma_dn >= 0, "read_noise_after_gain.sigma", f"{self.sigma_dn} DN", rule)
        shape = self.tukey_lambda
        good = shape is None or LEAST_LAMBDA <= shape <= GREATEST_LAMBDA
        require(good, "read_noise_after_gain.tukey_lambda", shape, f"give {LEAST_LAMBDA} to {GREATEST_LAMBDA}, or none")

    def kernel_values(self) -> dict[str, float | tuple[float, ...]]:
        """Return sigma, and the polynomial that converts a normal number to a Tukey-lambda one."""
        shape = () if self.tukey_lambda is None else tukey_polynomial(self.tukey_lambda)
        return {"sigma_dn": self.sigma_dn, "shape": shape}

    def moments(self, signal: Moments) -> Moments:
        """Give var + sigma^2 [DN^2]."""
        return signal.plus(variance=self.sigma_dn**2)
