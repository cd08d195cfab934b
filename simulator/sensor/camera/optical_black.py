"""Optical black: the covered edge of a sensor, from which converters take the black level."""

from dataclasses import dataclass, fields

from simulator.errors import require


@dataclass(frozen=True)
class OpticalBlack:
    """Photosites covered by metal at the edges: without light, but with dark current, read noise and pedestal.

    They are part of the camera's width and height. Each side is even, and left and top are whole periods of a larger pattern,
    so that the colour filter pattern of the active area starts like that of the sensor.

    left_px: covered columns at the left edge.
    top_px: covered rows at the upper edge.
    right_px: covered columns at the right edge.
    bottom_px: covered rows at the lower edge.
    """

    left_px: int = 0
    top_px: int = 0
    right_px: int = 0
    bottom_px: int = 0

    def __post_init__(self) -> None:
        for field in fields(self):
            side, key = getattr(self, field.name), f"camera.optical_black.{field.name.removesuffix('_px')}"
            require(side >= 0 and side % 2 == 0, key, side, "give an even number of photosites, 0 or more")

    def __str__(self) -> str:
        sides = (f"{getattr(self, field.name)} px {field.name.removesuffix('_px')}" for field in fields(self))
        return "no light at " + ", ".join(sides)
