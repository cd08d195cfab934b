"""ADC: round to the nearest code, add the black level, clip to 0 ... 2^n - 1 (EMVA 1288 R4.0, 2.3)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.stage import Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class Adc(Stage):
    """code = clip(rint(signal + black level), 0, 2^bit_depth - 1), ties to even.

    bit_depth: 8 to 16.
    black_level_dn: pedestal [DN] that keeps the read noise of the dark off zero.
    """

    stem: ClassVar[str] = "adc"
    in_camera_stages: ClassVar[bool] = False
    bit_depth: int
    black_level_dn: DigitalNumbers

    def __post_init__(self):
        require(8 <= self.bit_depth <= 16, "adc.bit_depth", self.bit_depth, "raw files hold 8 to 16 bits")
        require(
            0 <= self.black_level_dn < self.max_code,
            "adc.black_level",
            f"{self.black_level_dn} DN",
            f"lies outside the codes 0 to {self.max_code}",
        )

    @property
    def max_code(self) -> int:
        """Largest code, 2^n - 1 [DN]."""
        return 2**self.bit_depth - 1

    def kernel_parameters(self) -> dict[str, float]:
        """Give the kernel, which clips, the largest code instead of the bit depth."""
        return {"ADC_BLACK_LEVEL_DN": float(self.black_level_dn), "ADC_MAX_CODE_DN": float(self.max_code)}

    def moments(self, signal: Moments) -> Moments:
        """Give mean + black, var + 1/12 DN^2 (uniform rounding error)."""
        return Moments(signal.mean + self.black_level_dn, signal.variance + 1.0 / 12.0)
