"""Irradiance on the sensor as a stage of the fused kernel; the lens gives its numbers."""

from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from simulator.errors import require
from simulator.lens.vignetting import light_by_radius
from simulator.stage import Moments, Stage


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
    solid_angle_sr: float
    tan2_per_px2: float
    centre_x_px: float
    centre_y_px: float
    vignetting: tuple[float, ...] = ()
    nodes_per_px: float = 0.0

    @classmethod
    def behind(cls, lens, pixel_pitch_um: float, width_px: int, height_px: int) -> Self:
        """Return the stage of a lens whose axis meets the middle of a sensor."""
        tangent_per_px = 1e-3 * pixel_pitch_um / lens.image_distance_mm
        corner_px = 0.5 * float(np.hypot(width_px, height_px))
        vignetting = light_by_radius(lens.pupil, tangent_per_px * corner_px)
        return cls(
            solid_angle_sr=lens.irradiance_per_radiance_sr(),
            tan2_per_px2=tangent_per_px**2 if lens.cos4 else 0.0,
            centre_x_px=0.5 * width_px,
            centre_y_px=0.5 * height_px,
            vignetting=vignetting,
            nodes_per_px=(len(vignetting) - 1) / corner_px if vignetting else 0.0,
        )

    def kernel_values(self) -> dict[str, float | tuple[float, ...]]:
        """The table only where there is one; without it the code is left out."""
        return {name: value for name, value in super().kernel_values().items() if self.vignetting or name not in _TABLE}

    def fall_off(self, radius_px):
        """Irradiance at this distance from the axis over that on the axis; of a number or an array."""
        cos4 = 1.0 / (1.0 + radius_px**2 * self.tan2_per_px2) ** 2
        table = self.vignetting
        return cos4 * (np.interp(radius_px * self.nodes_per_px, np.arange(len(table)), table) if table else 1.0)

    def moments(self, signal: Moments) -> Moments:
        """On the axis."""
        return Moments(signal.mean * self.solid_angle_sr, signal.variance * self.solid_angle_sr**2)


_TABLE = ("vignetting", "nodes_per_px")


def check_veiling_glare(share: float, key: str) -> None:
    """Raise PhotositeError unless 0 <= share < 1."""
    require(0 <= share < 1, key, share, "give the share of light that is scattered over the sensor, below 1, such as 0.02")
