"""Exposure as a stage of the fused kernel: mean photoelectrons that a photosite collects while the shutter is open."""

from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Self

from simulator.sensor.stages.stage import FromShot, Moments, Photodiode, Stage
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

    def of_photodiode(self, diode: Photodiode) -> Self:
        """Return the stage of a diode that collects another share of the light."""
        return replace(self, collecting_area_um2=diode.light * self.collecting_area_um2)

    def moments(self, signal: Moments) -> Moments:
        """Light has no noise before it is counted."""
        scale = self.time_s * self.collecting_area_um2
        return Moments(signal.mean * scale, signal.variance * scale**2)
