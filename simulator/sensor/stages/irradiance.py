"""Irradiance on the sensor as a stage of the fused kernel; its parameters follow from the lens."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.sensor.stages.stage import Means, Moments, Region, Stage


@dataclass(frozen=True)
class Irradiance(Stage):
    """Electron irradiance = electron radiance * effective solid angle * cos^4 of the field angle * vignetting factor.

    effective_solid_angle_sr: irradiance over radiance on the axis [sr]: the projected solid angle of the exit pupil times the
        transmittance of the lens (lens.irradiance_per_radiance_sr()).
    tan2_per_px2: (pixel pitch / image distance)^2; times the squared distance from the axis [px^2] it is tan^2 of the field
        angle. 0 switches the cos^4 law off.
    centre_x_px, centre_y_px: the optical axis [px], counted from the sensor's upper left corner.
    vignetting: unobstructed share of the pupil area times a measured fall-off, sampled at evenly spaced distances from the
        axis, from 0 on; empty: no vignetting.
    nodes_per_px: samples of that table per photosite.
    """

    stem: ClassVar[str] = "irradiance"
    acts_on_light: ClassVar[bool] = True
    in_camera_stages: ClassVar[bool] = False
    changes_mean: ClassVar[bool] = True
    effective_solid_angle_sr: float
    tan2_per_px2: float
    centre_x_px: float
    centre_y_px: float
    vignetting: tuple[float, ...] = ()
    nodes_per_px: float = 0.0

    def kernel_values(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return all fields; those of the vignetting table only where there is one, so that its code is compiled only then."""
        return {name: value for name, value in super().kernel_values().items() if self.vignetting or name not in _TABLE}

    def relative_illumination(self, radius_px: Means) -> Means:
        """Return the irradiance at this distance from the axis [px] relative to that on the axis."""
        cos4 = 1.0 / (1.0 + radius_px**2 * self.tan2_per_px2) ** 2
        table = self.vignetting
        return cos4 * (np.interp(radius_px * self.nodes_per_px, np.arange(len(table)), table) if table else 1.0)

    def moments(self, signal: Moments) -> Moments:
        """Return the moments on the optical axis."""
        return Moments(signal.mean * self.effective_solid_angle_sr, signal.variance * self.effective_solid_angle_sr**2)

    def mean_range(self, low: Means, high: Means, region: Region) -> tuple[Means, Means]:
        """Return the range over the region; without a measured fall-off it is greatest on the axis and least in the corner."""
        dx = max(abs(region.x - self.centre_x_px), abs(region.x + region.width - self.centre_x_px))
        dy = max(abs(region.y - self.centre_y_px), abs(region.y + region.height - self.centre_y_px))
        farthest_px, sr = math.hypot(dx, dy), self.effective_solid_angle_sr
        reached = np.array(self.vignetting[: math.ceil(farthest_px * self.nodes_per_px) + 1])
        least, most = self.relative_illumination(farthest_px), 1.0
        if len(reached) and (np.diff(reached) > 0).any():
            cos4 = 1.0 / (1.0 + farthest_px**2 * self.tan2_per_px2) ** 2
            least, most = min(least, cos4 * float(reached.min())), max(1.0, float(reached.max()))
        return low * (sr * least), high * (sr * most)


_TABLE = ("vignetting", "nodes_per_px")
