"""Exposure as a stage of the fused kernel: mean photoelectrons that a photosite collects while the shutter is open."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from simulator.sensor.stages.stage import FromShot, Moments, Stage
from simulator.units import Seconds


@dataclass(frozen=True)
class Integration(Stage):
    """Mean electrons of a photosite = electron irradiance * collecting area * time.

    time_s: exposure time [s].
    collecting_area_um2: pixel pitch squared times fill factor [um^2].
    """

    stem: ClassVar[str] = "exposure"
    acts_on_light: ClassVar[bool] = True
    in_camera_stages: ClassVar[bool] = False
    changes_mean: ClassVar[bool] = True
    time_s: Annotated[Seconds, FromShot("exposure_time_s")]
    collecting_area_um2: float

    def moments(self, signal: Moments) -> Moments:
        """Light has no noise before it is counted."""
        scale = self.time_s * self.collecting_area_um2
        return Moments(signal.mean * scale, signal.variance * scale**2)
