"""Sizes of sensors by the names that cameras are sold under.

Sizes and crop factors: D. Carr, "Common Digital Sensor Sizes and Crop Factors", shuttermuse.com (read 2026); 1" as 13.2 mm x
8.8 mm, the 3:2 size that cameras carry, from Wikipedia, "Image sensor format". Makers differ by a few tenths of a millimetre
under one name, and names in inches are no sizes: they go back to the tubes of television cameras.
"""

import math
from dataclasses import dataclass

from simulator.optics.lens.perspective import crop_factor


@dataclass(frozen=True)
class SensorFormat:
    """A size of sensor. title: for people. width_mm, height_mm: of the active area [mm]."""

    title: str
    width_mm: float
    height_mm: float

    @property
    def crop_factor(self) -> float:
        """Diagonal of 36 mm x 24 mm over this one's."""
        return crop_factor(math.hypot(self.width_mm, self.height_mm))


SENSOR_FORMATS = {
    "medium_format": SensorFormat("medium format", 53.7, 40.4),
    "medium_format_cropped": SensorFormat("medium format, cropped", 43.8, 32.9),
    "full_frame": SensorFormat("full frame, 35 mm", 36.0, 24.0),
    "aps_h": SensorFormat("APS-H", 27.9, 18.6),
    "aps_c": SensorFormat("APS-C", 23.6, 15.6),
    "aps_c_canon": SensorFormat("APS-C, Canon", 22.2, 14.8),
    "type_1.5": SensorFormat('1.5"', 18.7, 14.0),
    "four_thirds": SensorFormat("Four Thirds", 17.3, 13.0),
    "type_1": SensorFormat('1"', 13.2, 8.8),
    "type_2_3": SensorFormat('2/3"', 8.8, 6.6),
    "type_1_2.3": SensorFormat('1/2.3"', 6.17, 4.55),
}
