"""Where clean pictures come from. A source lists names cheaply and in a fixed order, and reads one of them at a time."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from simulator.sensor.camera.cfa import CfaName


@dataclass(frozen=True)
class CleanImage:
    """Noise-free camera signal, linear: 0 without light, 1 where the reference exposure saturates.

    signal: (height, width, 3) float32 camera R, G, B at every pixel, or (height, width) float32, a mosaic. Finite; above 1
        is light that the sensor will clip.
    cfa: colours of the mosaic's upper left 2x2 block; None for three planes.
    white_balance: gains of R, G, B that make the light's white neutral, green = 1.
    color_matrix: (3, 3) XYZ to camera under D65; None when not known.
    """

    signal: np.ndarray
    cfa: CfaName | None
    white_balance: tuple[float, float, float]
    color_matrix: tuple[tuple[float, ...], ...] | None = None


@runtime_checkable
class PictureSource(Protocol):
    """A collection of clean pictures."""

    def names(self) -> tuple[str, ...]:
        """Names of all pictures, unique, in an order that does not depend on the machine."""
        ...

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one picture. `rng` makes the source's random choices, such as the colour matrix of an inverse ISP.

        Raises PhotositeError that names the file and what is wrong with it.
        """
        ...
