"""Colour bias: a per-channel black offset (Wei et al. 2021, ELD: colour-biased read noise)."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class ColorBias(Stage):
    """signal += per-channel black offset, one for each photosite of the 2x2 block of the colour filter array.

    offsets_dn: black offsets [DN] in the sensor's upper left 2x2 block, row by row.
    """

    stem: ClassVar[str] = "color_bias"
    in_camera_stages: ClassVar[bool] = False
    offsets_dn: tuple[DigitalNumbers, ...]

    def __post_init__(self) -> None:
        rule = "give 4 offsets between -1e6 and 1e6 DN"
        good = len(self.offsets_dn) == 4 and all(abs(offset) < 1e6 for offset in self.offsets_dn)
        require(good, "color_bias.offsets", self.offsets_dn, rule)

    def moments(self, signal: Moments) -> Moments:
        """Give mean + mean offset, fixed var + variance of the offsets [DN^2]."""
        mean_dn = sum(self.offsets_dn) / 4.0
        return signal.plus(mean=mean_dn, fixed_variance=sum((offset - mean_dn) ** 2 for offset in self.offsets_dn) / 4.0)

    @property
    def black_offsets_dn(self) -> tuple[float, ...]:
        """Black offsets [DN] of the 2x2 block, row by row."""
        return self.offsets_dn
