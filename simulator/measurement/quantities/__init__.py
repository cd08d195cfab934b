"""Quantities that can be measured in a frame: each a frozen dataclass whose fields are its keys in a study file."""

from simulator.measurement.quantities.blur_length import BlurLength
from simulator.measurement.quantities.clipped_share import ClippedShare
from simulator.measurement.quantities.color_error import ColorError
from simulator.measurement.quantities.dynamic_range import DynamicRange, PhotonsToPhotos
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.mtf import Mtf
from simulator.measurement.quantities.own_function import OwnFunction
from simulator.measurement.quantities.patch import Patch
from simulator.measurement.quantities.quantity import Curve, Figure, Measured, Quantity
from simulator.measurement.quantities.registry import QUANTITIES

__all__ = [
    "QUANTITIES",
    "Area",
    "BlurLength",
    "ClippedShare",
    "ColorError",
    "Curve",
    "DynamicRange",
    "Figure",
    "Measured",
    "MeasuredFrame",
    "Mtf",
    "OwnFunction",
    "Patch",
    "PhotonsToPhotos",
    "Plane",
    "Quantity",
]
