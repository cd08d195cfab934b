"""What a quantity gives: figures, each with its unit, and curves."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from simulator.measurement.quantities.measured_frame import MeasuredFrame


@dataclass(frozen=True)
class Figure:
    """One measured number.

    value: nan where the frame does not show it. unit: "" of a ratio. sigma: standard error in the same unit, None where it is
        not known.
    """

    value: float
    unit: str
    sigma: float | None = None


@dataclass(frozen=True, eq=False)
class Curve:
    """A measured curve: y over x, both (points,) float64, with names and units ("" of a ratio)."""

    x: np.ndarray
    y: np.ndarray
    x_name: str
    x_unit: str
    y_name: str
    y_unit: str


@dataclass(frozen=True)
class Measured:
    """Figures and curves of one quantity in one frame, by name; the same names for every frame of a kind."""

    figures: dict[str, Figure]
    curves: dict[str, Curve] = field(default_factory=dict)


class Quantity(Protocol):
    """Something that can be measured in a frame. Its settings are fields of a frozen dataclass: the keys of a study file."""

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Measure a frame. Raises PhotositeError for a frame or a setting with which it cannot be measured."""
        ...
