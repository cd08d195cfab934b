"""Irradiance on the sensor as a stage of the fused kernel; the lens gives its numbers."""

from dataclasses import dataclass
from typing import ClassVar

from simulator.stage import Moments, Stage


@dataclass(frozen=True)
class Irradiance(Stage):
    """Electron irradiance on the sensor = electron radiance * solid angle * cos^4 of the field angle.

    solid_angle_sr: E / L on the axis [sr], from ThinLens.irradiance_per_radiance_sr.
    tan2_per_px2: (pixel pitch / image distance)^2, so that tan^2 of the field angle is r^2 of it; 0 without cos^4.
    centre_x_px, centre_y_px: the optical axis in photosites from the sensor's upper left corner.
    """

    stem: ClassVar[str] = "irradiance"
    solid_angle_sr: float
    tan2_per_px2: float
    centre_x_px: float
    centre_y_px: float

    def moments(self, signal: Moments) -> Moments:
        """On the axis."""
        return Moments(signal.mean * self.solid_angle_sr, signal.variance * self.solid_angle_sr**2)
