"""How a raw file holds a frame; what the picture is does not depend on it."""

from dataclasses import dataclass
from importlib.util import find_spec
from typing import Literal, get_args

from simulator.errors import require

Payload = Literal["uncompressed", "packed", "lossless_jpeg"]


@dataclass(frozen=True)
class RawFormat:
    """How the DNG holds the frame.

    payload: uncompressed: 16 bits per code. packed: 8, 10, 12, 14 or 16 bits per code, the fewest that hold the camera's
        and with which a row fills whole bytes.
        lossless_jpeg: compressed without loss (ITU-T T.81, process 14), needs imagecodecs.
    Raises PhotositeError for an unknown payload, and for one whose library is not installed: before the work, not after it.
    """

    payload: Payload = "uncompressed"

    def __post_init__(self):
        known = get_args(Payload)
        require(self.payload in known, "raw.payload", self.payload, f"give one of {', '.join(known)}")
        there = self.payload != "lossless_jpeg" or find_spec("imagecodecs") is not None
        require(there, "raw.payload", self.payload, "needs imagecodecs: pip install 'photosite[lossless-jpeg]', or take packed")
