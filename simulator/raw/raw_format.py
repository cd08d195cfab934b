"""How a raw file holds a frame; what the picture is does not depend on it."""

from dataclasses import dataclass
from importlib.util import find_spec
from numbers import Integral
from typing import Literal, get_args

from simulator.errors import require

Payload = Literal["uncompressed", "packed", "lossless_jpeg"]


@dataclass(frozen=True)
class RawFormat:
    """How the DNG holds the frame.

    payload: uncompressed: 16 bits per code. packed: 8, 10, 12, 14 or 16 bits per code, the fewest that hold the camera's
        and with which a row fills whole bytes.
        lossless_jpeg: compressed without loss (ITU-T T.81, process 14), needs imagecodecs.
    orientation: how the camera was held, 1 to 8 (Exif 2.3, Orientation): 1 upright, 3 upside down; for an upright view
        6 is to be turned clockwise, 8 anticlockwise; 2, 4, 5 and 7 are mirrored. The codes stay as the sensor has them.
    black_per_place: tell the sensor's color_bias as four black levels, one for each place of the 2x2 block; else the DNG
        tells the camera's one level, and the bias is an error to be found.
    opcodes: tell converters how to undo the lens's distortion (DNG 1.4, WarpRectilinear in OpcodeList3).
    Raises PhotositeError for an unknown payload or orientation, and for a payload whose library is not installed: before
    the work, not after it.
    """

    payload: Payload = "uncompressed"
    orientation: int = 1
    black_per_place: bool = False
    opcodes: bool = True

    def __post_init__(self) -> None:
        known = get_args(Payload)
        require(self.payload in known, "raw.payload", self.payload, f"give one of {', '.join(known)}")
        there = self.payload != "lossless_jpeg" or find_spec("imagecodecs") is not None
        require(there, "raw.payload", self.payload, "needs imagecodecs: pip install 'photosite[lossless-jpeg]', or take packed")
        good = isinstance(self.orientation, Integral) and 1 <= self.orientation <= 8
        require(good, "raw.orientation", self.orientation, "give a whole number from 1 to 8, as Exif counts")
