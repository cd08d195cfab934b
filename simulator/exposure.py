"""Exposure: how long the shutter is open. H = E t (ISO 12232:2019), and the electrons it gathers."""

import math
from dataclasses import dataclass
from typing import ClassVar

from simulator.errors import require
from simulator.stage import Moments, Stage
from simulator.units import Seconds


@dataclass(frozen=True)
class Exposure:
    """What the photographer sets; all rows are exposed at once.

    time_s: open time of the shutter [s], > 0.
    iso: exposure index; it chooses the camera's analog gain.
    Raises PhotositeError when time or ISO is not positive, or time not finite.
    """

    time_s: Seconds
    iso: int = 100

    def __post_init__(self):
        rule = "the shutter must open and close: give a time above 0 s, such as 1/125 s"
        require(0 < self.time_s < math.inf, "exposure.time", f"{self.time_s:g} s", rule)
        require(self.iso > 0, "exposure.iso", self.iso, "give a positive ISO, such as 100")


@dataclass(frozen=True)
class Integration(Stage):
    """Mean electrons of a photosite = electron irradiance * collecting area * time.

    time_s: exposure time [s].
    collecting_area_um2: pixel pitch squared times fill factor [um^2].
    """

    stem: ClassVar[str] = "exposure"
    time_s: float
    collecting_area_um2: float

    def moments(self, signal: Moments) -> Moments:
        """Light has no noise before it is counted."""
        scale = self.time_s * self.collecting_area_um2
        return Moments(signal.mean * scale, signal.variance * scale**2)
