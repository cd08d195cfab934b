"""Measured fall-off of a lens: its irradiance over the field as a polynomial, in place of the natural law and of rims."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulator.errors import PhotositeError, require


@dataclass(frozen=True)
class Falloff:
    """Irradiance relative to that on the axis, 1 + k1 r^2 + k2 r^4 + k3 r^6 (Adobe's and lensfun's vignetting model).

    It multiplies what `cos4` and `vignetting` leave; a fall-off that was measured holds both, so that those are switched off.
    k1, k2, k3: coefficients; k1 < 0 darkens the corners.
    unit: of r: half_diagonal of the sensor, as in lens profiles, or focal_length, the image distance.
    Raises PhotositeError for numbers that are not finite.
    """

    k1: float = 0.0
    k2: float = 0.0
    k3: float = 0.0
    unit: Literal["half_diagonal", "focal_length"] = "half_diagonal"

    def __post_init__(self) -> None:
        for key in ("k1", "k2", "k3"):
            require(math.isfinite(getattr(self, key)), f"lens.falloff.{key}", getattr(self, key), "give a finite number")

    def shares(self, radius: np.ndarray) -> np.ndarray:
        """Return the polynomial at radii in `unit`; 0 where it is negative, beyond the image circle.

        Raises PhotositeError where it exceeds 2 times that on the axis.
        """
        r2 = np.asarray(radius, np.float64) ** 2
        found = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        rule = "makes the field more than twice as bright as the axis; lessen k1, k2 or k3"
        if found.max(initial=0.0) > 2.0:
            raise PhotositeError(rule, key="lens.falloff", value=(self.k1, self.k2, self.k3))
        return np.maximum(found, 0.0)
