"""Quantities that can be measured in a frame: each a frozen dataclass whose fields are its keys in a study file."""

from simulator.measurement.quantities.clipped_share import ClippedShare
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.patch import Patch
from simulator.measurement.quantities.quantity import Curve, Figure, Measured, Quantity
from simulator.measurement.quantities.registry import QUANTITIES

__all__ = [
    "QUANTITIES",
    "Area",
    "ClippedShare",
    "Curve",
    "Figure",
    "Measured",
    "MeasuredFrame",
    "Patch",
    "Plane",
    "Quantity",
]
