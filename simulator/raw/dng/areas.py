"""DNG tags of default crop, active area and optical black of a raw frame."""

from simulator.errors import require
from simulator.raw.dng import tiff
from simulator.raw.dng.tags import Tag
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import Cfa


def areas(raw: Raw) -> dict[Tag, tiff.Field]:
    """Return DefaultCrop, and ActiveArea and MaskedAreas (top, left, bottom, right) of a frame with optical black.

    Converters take black from MaskedAreas instead of BlackLevel, so it has only photosites that no charge reaches. Where charge
    reaches all of them MaskedAreas is left out, and converters take BlackLevel.
    Raises PhotositeError for an active area outside the frame, or one that begins within a period of the filter pattern: LibRaw
    moves a Bayer pattern, and the pattern of the tags begins with the active area.
    """
    top, left, bottom, right = raw.edges
    height, width = raw.dn.shape
    rows, columns = Cfa.named(raw.cfa).period
    inside = 0 <= top < bottom <= height and 0 <= left < right <= width and top % rows == left % columns == 0
    begin = "even rows and columns" if (rows, columns) == (2, 2) else f"multiples of {rows} rows and {columns} columns"
    require(inside, "active_area", raw.edges, f"lies within the frame and begins at {begin}", part=raw.name)
    border = min(8, 2 * (min(bottom - top, right - left) // 16))  # even; 8 px hide what demosaicing does at the edge
    tags = {
        Tag.DEFAULT_CROP_ORIGIN: tiff.long(border, border),  # x, y in the active area
        Tag.DEFAULT_CROP_SIZE: tiff.long(right - left - 2 * border, bottom - top - 2 * border),
    }
    if raw.edges == (0, 0, height, width):
        return tags
    tags[Tag.ACTIVE_AREA] = tiff.long(*raw.edges)
    dark = masked_areas(raw)
    return tags | ({Tag.MASKED_AREAS: tiff.long(*[edge for area in dark for edge in area])} if dark else {})


def masked_areas(raw: Raw) -> list[tuple[int, int, int, int]]:
    """Return rectangles (top, left, bottom, right) of optical black: above and below over the whole width, then beside.

    They begin an even number of photosites from the active area, which keeps the phase of a Bayer pattern, and have only those
    that `Raw.charge_reach_px` does not reach.
    """
    beside, above = (reach + reach % 2 for reach in raw.charge_reach_px)
    top, left, bottom, right = raw.edges
    height, width = raw.dn.shape
    bands = [
        (0, 0, top - above, width),
        (bottom + above, 0, height, width),
        (top, 0, bottom, left - beside),
        (top, right + beside, bottom, width),
    ]
    return [band for band in bands if band[0] < band[2] and band[1] < band[3]]
