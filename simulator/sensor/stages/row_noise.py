"""Row noise: a temporal offset common to all photosites of a row (EMVA 1288 R4.0: temporal row noise)."""

import math
from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.sensor.stages.stage import Moments, Stage
from simulator.units import DigitalNumbers


@dataclass(frozen=True)
class RowNoise(Stage):
    """signal += N(0, sigma) of the row, new in each frame.

    sigma_dn: standard deviation over the rows [DN], >= 0.
    """

    stem: ClassVar[str] = "row_noise"
    neutral: ClassVar[dict[str, float]] = {"sigma_dn": 0.0}
    is_common_to_rows: ClassVar[bool] = True
    sigma_dn: DigitalNumbers

    def __post_init__(self) -> None:
        require(0 <= self.sigma_dn < 1e6, "row_noise.sigma", f"{self.sigma_dn:g} DN", "a standard deviation is not negative")

    def combined(self, side: int, codes: float) -> "RowNoise":
        """Return the offset of the mean of `side` rows: sigma / sqrt(side)."""
        return RowNoise(codes * self.sigma_dn / math.sqrt(side))

    def moments(self, signal: Moments) -> Moments:
        """Give var + sigma^2 [DN^2]; it is common to the row."""
        return signal.plus(variance=self.sigma_dn**2)
