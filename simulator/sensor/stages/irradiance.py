"""Irradiance on the sensor as a stage of the fused kernel; the lens gives its numbers."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.sensor.stages.stage import Means, Moments, Region, Stage


@dataclass(frozen=True)
class Irradiance(Stage):
    """Electron irradiance on the sensor = electron radiance * solid angle * cos^4 of the field angle * open share of the pupil.

    solid_angle_sr: E / L on the axis [sr], from ThinLens.irradiance_per_radiance_sr.
    tan2_per_px2: (pixel pitch / image distance)^2, so that tan^2 of the field angle is r^2 of it; 0 without cos^4.
    centre_x_px, centre_y_px: the optical axis in photosites from the sensor's upper left corner.
    vignetting: open share of the pupil at even steps of the radius, from the axis on; empty: open everywhere.
    nodes_per_px: steps of that table per photosite.
    """

    stem: ClassVar[str] = "irradiance"
    acts_on_light: ClassVar[bool] = True
    in_camera_stages: ClassVar[bool] = False
    changes_mean: ClassVar[bool] = True
    solid_angle_sr: float
    tan2_per_px2: float
    centre_x_px: float
    centre_y_px: float
    vignetting: tuple[float, ...] = ()
    nodes_per_px: float = 0.0

    def kernel_values(self) -> dict[str, float | tuple[float, ...]]:
        """The table only where there is one; without it the code is left out."""
        return {name: value for name, value in super().kernel_values().items() if self.vignetting or name not in _TABLE}

    def relative_illumination(self, radius_px):
        """Irradiance at this distance from the axis over that on the axis; of a number or an array."""
        cos4 = 1.0 / (1.0 + radius_px**2 * self.tan2_per_px2) ** 2
        table = self.vignetting
        return cos4 * (np.interp(radius_px * self.nodes_per_px, np.arange(len(table)), table) if table else 1.0)

    def moments(self, signal: Moments) -> Moments:
        """On the axis."""
        return Moments(signal.mean * self.solid_angle_sr, signal.variance * self.solid_angle_sr**2)

    def mean_range(self, low: Means, high: Means, region: Region) -> tuple[Means, Means]:
        """From the region's farthest corner, since the fall-off never rises outwards, to the axis."""
        dx = max(abs(region.x - self.centre_x_px), abs(region.x + region.width - self.centre_x_px))
        dy = max(abs(region.y - self.centre_y_px), abs(region.y + region.height - self.centre_y_px))
        return low * (self.solid_angle_sr * self.relative_illumination(math.hypot(dx, dy))), high * self.solid_angle_sr


_TABLE = ("vignetting", "nodes_per_px")
