"""OpcodeList3 of a DNG: operations of the converter on the demosaiced picture (DNG 1.4, chapter 7)."""

import struct

from simulator.raw.dng import tiff
from simulator.raw.dng.tags import Opcode, OpcodeFlag, Tag
from simulator.raw.raw_image import Raw

_SINCE_DNG = (1, 3, 0, 0)


def opcodes(raw: Raw) -> dict[Tag, tiff.Field]:
    """Return OpcodeList3 with the correction of the lens's distortion; {} without distortion or where it is turned off."""
    if raw.warp_rectilinear is None or not raw.format.opcodes:
        return {}
    planes, centre = raw.warp_rectilinear
    numbers = [number for plane in planes for number in plane] + list(centre)
    parameters = struct.pack(f">I{len(numbers)}d", len(planes), *numbers)
    head = struct.pack(">II4BII", 1, Opcode.WARP_RECTILINEAR, *_SINCE_DNG, OpcodeFlag.OPTIONAL, len(parameters))
    return {Tag.OPCODE_LIST_3: tiff.undefined(head + parameters)}
