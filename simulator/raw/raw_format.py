"""Storage options of a raw file, which do not change the frame's codes."""

from dataclasses import dataclass
from importlib.util import find_spec
from numbers import Integral
from typing import Literal, get_args

from simulator.errors import require

Payload = Literal["uncompressed", "packed", "lossless_jpeg"]


@dataclass(frozen=True)
class RawFormat:
    """Storage of a frame in a DNG.

    payload: uncompressed: 16 bits per code. packed: 8, 10, 12, 14 or 16 bits per code, the fewest that hold the camera's
        codes and with which a row fills whole bytes. lossless_jpeg: lossless compression (ITU-T T.81, process 14), which
        requires imagecodecs.
    orientation: of the camera, 1 to 8 (Exif 2.3, Orientation): 1 upright, 3 upside down; a viewer rotates 6 clockwise and 8
        anticlockwise; 2, 4, 5 and 7 are mirrored. The codes are stored in sensor orientation in any case.
    black_per_place: write the sensor's per-channel black offset (color_bias) as four black levels, one for each place of the
        2x2 block; else the DNG has the camera's one black level, and the offset is left for calibration to find.
    opcodes: write the correction of the lens's distortion (DNG 1.4, WarpRectilinear in OpcodeList3).
    Raises PhotositeError for an unknown payload or orientation, and for a payload whose library is not installed, so that
    the error comes before the simulation.
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
