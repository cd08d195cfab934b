"""A mosaic as four planes of half its size, and back: what raw denoisers read.

The order of the planes is always named, because published code disagrees: ELD and LED stack R, G1, B, G2 (`rgbg`), the
AIM 2025 raw denoising challenge R, G1, G2, B (`rggb`). G1 is the green in the row of red, G2 the one in the row of blue.
"""

from typing import Literal, get_args

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.raw.raw_reader import plane_places
from simulator.sensor.camera.cfa import CfaName

Channels = Literal["mosaic", "rggb", "rgbg"]
_ORDERS = {"rggb": ("R", "Gr", "Gb", "B"), "rgbg": ("R", "Gr", "B", "Gb")}


def places(cfa: CfaName, channels: Channels) -> tuple[tuple[int, int], ...]:
    """Row and column, 0 or 1, of each plane's photosite in the 2x2 block, in the order of the planes.

    Raises PhotositeError for MONO, which has no colours to pack, and for an unknown order.
    """
    known = tuple(_ORDERS)
    require(channels in known, "writer.channels", channels, f"give one of {', '.join(get_args(Channels))}")
    if cfa == "MONO":
        raise PhotositeError("a MONO sensor has no colours to pack; use mosaic", key="writer.channels", value=channels)
    found = plane_places(cfa)
    return tuple(found[name] for name in _ORDERS[channels])


def pack(mosaic: np.ndarray, cfa: CfaName, channels: Channels) -> np.ndarray:
    """Split mosaics (..., height, width) into planes (..., 4, height / 2, width / 2) of the same type; "mosaic" leaves them.

    Raises PhotositeError for an odd height or width: a photosite would be lost.
    """
    if channels == "mosaic":
        return mosaic
    height, width = mosaic.shape[-2:]
    require(height % 2 == width % 2 == 0, "patch", f"{width} x {height} px", "an even width and height can be packed")
    return np.stack([mosaic[..., row::2, column::2] for row, column in places(cfa, channels)], axis=-3)


def unpack(planes: np.ndarray, cfa: CfaName, channels: Channels) -> np.ndarray:
    """Invert `pack`: planes (..., 4, h, w) to mosaics (..., 2 h, 2 w)."""
    if channels == "mosaic":
        return planes
    *lead, _, height, width = planes.shape
    mosaic = np.empty((*lead, 2 * height, 2 * width), planes.dtype)
    for plane, (row, column) in enumerate(places(cfa, channels)):
        mosaic[..., row::2, column::2] = planes[..., plane, :, :]
    return mosaic
