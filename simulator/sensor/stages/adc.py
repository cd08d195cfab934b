"""ADC: round to the nearest code, add the black level, clip (EMVA 1288 R4.0, 2.3)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Limits, Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class Adc(Stage):
    """code = clip(rint(signal + black level), 0, white level), ties to even.

    bit_depth: 8 to 16.
    black_level_dn: pedestal [DN] that keeps dark signal with its read noise above code 0.
    white_level_dn: code at which the ADC or what drives it clips [DN]; none: 2^bit_depth - 1.
    """

    stem: ClassVar[str] = "adc"
    in_camera_stages: ClassVar[bool] = False
    changes_mean: ClassVar[bool] = True
    is_required: ClassVar[bool] = True
    bit_depth: int
    black_level_dn: DigitalNumbers
    white_level_dn: DigitalNumbers | None = None

    def __post_init__(self) -> None:
        require(8 <= self.bit_depth <= 16, "adc.bit_depth", self.bit_depth, "raw files hold 8 to 16 bits")
        white_dn, largest = self.max_code, 2**self.bit_depth - 1
        rule = f"lies outside the codes 1 to {largest} of {self.bit_depth} bits"
        require(1 <= white_dn <= largest, "adc.white_level", f"{white_dn} DN", rule)
        rule = f"lies outside the codes 0 to {white_dn}"
        require(0 <= self.black_level_dn < white_dn, "adc.black_level", f"{self.black_level_dn} DN", rule)

    @property
    def max_code(self) -> int:
        """Largest code [DN]."""
        return 2**self.bit_depth - 1 if self.white_level_dn is None else int(self.white_level_dn)

    def kernel_values(self) -> dict[str, float]:
        """Return the black level, and the largest code instead of the bit depth."""
        return {"black_level_dn": self.black_level_dn, "white_level_dn": self.max_code}

    def moments(self, signal: Moments) -> Moments:
        """Give mean + black, var + 1/12 DN^2 (uniform rounding error)."""
        return signal.plus(mean=self.black_level_dn, variance=1.0 / 12.0)

    def clip_limits(self, before: Limits) -> Limits:
        """Return code 0 and the white level [DN]."""
        return 0.0, float(self.max_code)
