"""The quantities that a study can ask for, by their word in YAML."""

from simulator.measurement.quantities.blur_length import BlurLength
from simulator.measurement.quantities.clipped_share import ClippedShare
from simulator.measurement.quantities.color_error import ColorError
from simulator.measurement.quantities.dynamic_range import DynamicRange, PhotonsToPhotos
from simulator.measurement.quantities.mtf import Mtf
from simulator.measurement.quantities.own_function import OwnFunction
from simulator.measurement.quantities.patch import Patch

QUANTITIES: dict[str, type] = {
    "patch": Patch,
    "clipped_share": ClippedShare,
    "dynamic_range": DynamicRange,
    "photons_to_photos": PhotonsToPhotos,
    "mtf": Mtf,
    "blur_length": BlurLength,
    "color_error": ColorError,
    "python": OwnFunction,
}
