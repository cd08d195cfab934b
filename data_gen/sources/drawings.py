"""Drawings: scenes made of numbers alone, each a function (rng, paint, height, width) -> (height, width, channels).

`rng` is a random generator, `paint` gives colours of surfaces and lamps, see `data_gen.sources.paint`. Values are camera
signal, 1 for a perfect white surface in the channel that sees it brightest; lamps are brighter.
"""

import numpy as np

from data_gen.sources.paint import Paint
from simulator.color.reproducible import weighted_sum

LEAF_RADII_PX = (3.0, 96.0)
LEAF_LAYERS = 5.0  # mean number of leaves over a pixel; exp(-5) = 0.7 % of the ground is left to be seen
_STAMPED_PX = 12.0  # leaves below this radius are drawn many at a time


def leaf_radii(rng: np.random.Generator, count: int) -> np.ndarray:
    """Radii [px] with density r^-3 between LEAF_RADII_PX: the law of scale invariance (Lee, Mumford, Huang 2001, section 3)."""
    least, largest = (radius**-2.0 for radius in LEAF_RADII_PX)
    return (least - rng.random(count) * (least - largest)) ** -0.5


def leaf_numbers(rng: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Number of the leaf on top of each pixel, from 1 in the order they fall, (height, width) int32; 0 is bare ground."""
    least, largest = LEAF_RADII_PX
    sides = np.array([height + 2 * largest, width + 2 * largest])  # leaves whose centre lies outside reach in
    mean_area = 2.0 * np.pi * np.log(largest / least) / (least**-2.0 - largest**-2.0)
    count = int(LEAF_LAYERS * sides.prod() / mean_area)
    radius = leaf_radii(rng, count)
    y, x = (rng.random((count, 2)) * sides - largest).T
    return _uppermost(y, x, radius, height, width)


def dead_leaves(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Disks that fall on one another (A. B. Lee, D. Mumford, J. Huang, "Occlusion models for natural images", IJCV 41, 2001).

    The light over them is up to one stop brighter or darker towards the corners.
    """
    leaves = leaf_numbers(rng, height, width)
    colours = paint.surfaces(rng, 509)[leaves % 509]  # enough to look endless, few enough to mix quickly
    tilt_y, tilt_x = rng.uniform(-0.5, 0.5, 2)
    light_y, light_x = (2.0 ** (tilt * np.linspace(-1, 1, side)) for tilt, side in ((tilt_y, height), (tilt_x, width)))
    return colours * (light_y[:, None] * light_x).astype(np.float32)[..., None]


def gradients(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Colours that pass smoothly into one another: a grid of 2 to 6 colours a side, linear between them."""
    rows, columns = rng.integers(2, 7, 2)
    colours = paint.surfaces(rng, rows * columns).reshape(rows, columns, -1)
    weights_y, weights_x = _linear_weights(height, rows), _linear_weights(width, columns)
    lines = weighted_sum(colours, weights_y.T[..., None, None])  # (height, columns, channels)
    planes = (lines[..., channel].T[..., None] for channel in range(colours.shape[2]))  # (columns, height, 1)
    return np.stack([weighted_sum(plane, weights_x.T) for plane in planes], axis=-1)


def slanted_edges(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Tiles of 64 to 128 px, each with an edge that leans 2 to 43 degrees from the rows or columns (ISO 12233 uses 5).

    A pixel on the edge has the share of it that lies on either side, to first order.
    """
    side = int(rng.integers(64, 129))
    rows, columns = -(-height // side), -(-width // side)
    angle = np.radians(rng.uniform(2.0, 43.0, (rows, columns)) + 90.0 * rng.integers(0, 4, (rows, columns)))
    offset = rng.uniform(-0.2 * side, 0.2 * side, (rows, columns))
    one, other = paint.surfaces(rng, 2 * rows * columns).reshape(2, rows, columns, -1)
    (tile_y, in_y), (tile_x, in_x) = (np.divmod(np.arange(length), side) for length in (height, width))
    tile = np.ix_(tile_y, tile_x)
    from_centre = in_y[:, None] - 0.5 * (side - 1), in_x - 0.5 * (side - 1)
    distance = from_centre[0] * np.sin(angle)[tile] + from_centre[1] * np.cos(angle)[tile] - offset[tile]
    share = np.clip(distance + 0.5, 0.0, 1.0).astype(np.float32)[..., None]
    return share * one[tile] + (1.0 - share) * other[tile]


def color_patches(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Rectangles of even colours, 8 to 20 a side, like a chart with unequal fields."""
    rows, columns = rng.integers(8, 21, 2)
    colours = paint.surfaces(rng, rows * columns).reshape(rows, columns, -1)
    field_y, field_x = (
        np.searchsorted(np.sort(rng.integers(1, side, fields - 1)), np.arange(side), side="right")
        for side, fields in ((height, rows), (width, columns))
    )
    return colours[np.ix_(field_y, field_x)]


def text(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Lines of characters of 5 x 7 random dots, in paragraphs of their own ink, paper and size: 1 to 4 px per dot."""
    planes = np.empty((height, width, paint.measured.shape[1]), np.float32)
    top = 0
    while top < height:
        scale = int(rng.integers(1, 5))
        lines, letters = int(rng.integers(2, 6)), -(-width // (6 * scale))
        dots = np.zeros((lines, 10, letters, 6), bool)  # a line of 7 dots and 3 of space; a letter of 5 and 1
        dots[:, 1:8, :, :5] = rng.random((lines, 7, letters, 5)) < 0.45
        dots &= (rng.random((lines, letters)) < 0.85)[:, None, :, None]  # blanks between words
        ink = dots.reshape(10 * lines, 6 * letters).repeat(scale, axis=0).repeat(scale, axis=1)[: height - top, :width]
        planes[top : top + len(ink)] = paint.surfaces(rng, 2)[ink.astype(np.intp)]
        top += len(ink)
    return planes


def point_lights(rng: np.random.Generator, paint: Paint, height: int, width: int) -> np.ndarray:
    """Lamps before a dim ground, 1 to 1000 times as bright as white at their centres, with a halo.

    The profile (1 + (r / a)^2)^-2 has tails that fall with r^-4 (Moffat 1969, A&A 3, 455), a between 0.7 and 3 px.
    """
    planes = 0.05 * gradients(rng, paint, height, width)
    for _ in range(int(rng.integers(5, 25))):
        y, x = rng.random(2) * (height, width)
        width_px, peak = rng.uniform(0.7, 3.0), 10.0 ** rng.uniform(0.0, 3.0)
        reach = width_px * (peak / 1e-4) ** 0.25  # where the halo has fallen to 1e-4 of white
        rows, columns = (slice(max(0, int(centre - reach)), int(centre + reach) + 1) for centre in (y, x))
        part = planes[rows, columns]
        dy = (np.arange(part.shape[0]) + rows.start + 0.5 - y) / width_px
        dx = (np.arange(part.shape[1]) + columns.start + 0.5 - x) / width_px
        glow = peak / np.square(1.0 + np.square(dy)[:, None] + np.square(dx))
        part += glow[..., None].astype(np.float32) * paint.lamp(rng)
    return planes


DRAWINGS = {each.__name__: each for each in (dead_leaves, gradients, slanted_edges, color_patches, text, point_lights)}


def _linear_weights(side: int, knots: int) -> np.ndarray:
    """Weights (side, knots) float32 of linear interpolation between knots at the ends and evenly between."""
    position = np.linspace(0, knots - 1, side)
    return np.maximum(0.0, 1.0 - np.abs(position[:, None] - np.arange(knots))).astype(np.float32)


def _uppermost(y: np.ndarray, x: np.ndarray, radius: np.ndarray, height: int, width: int) -> np.ndarray:
    """Number of the last disk over each pixel, counted from 1, (height, width) int32; 0 where there is none."""
    edge = int(2 * _STAMPED_PX) + 4  # stamps may reach over the border
    owner = np.zeros((height + 2 * edge, width + 2 * edge), np.int32)
    seen = (y > -radius) & (y < height + radius) & (x > -radius) & (x < width + radius)
    low = LEAF_RADII_PX[0]
    while low < _STAMPED_PX:
        chosen = np.flatnonzero(seen & (radius >= low) & (radius < 2 * low))
        _stamp(owner, chosen + 1, y[chosen] + edge, x[chosen] + edge, radius[chosen], int(2 * low) + 1)
        low *= 2
    owner = owner[edge:-edge, edge:-edge]
    for disk in np.flatnonzero(seen & (radius >= low)):
        rows, columns = (slice(max(0, int(c - radius[disk])), max(0, int(c + radius[disk]) + 1)) for c in (y[disk], x[disk]))
        part = owner[rows, columns]
        dy = np.arange(rows.start, rows.start + part.shape[0]) + 0.5 - y[disk]
        dx = np.arange(columns.start, columns.start + part.shape[1]) + 0.5 - x[disk]
        inside = (dy**2)[:, None] + dx**2 <= radius[disk] ** 2
        np.maximum(part, inside * np.int32(disk + 1), out=part)
    return owner


def _stamp(owner: np.ndarray, number: np.ndarray, y: np.ndarray, x: np.ndarray, radius: np.ndarray, reach: int) -> None:
    """Write the numbers of small disks, where they are larger than what is there."""
    offsets = np.arange(-reach, reach + 1)
    rows, columns = (np.floor(centre).astype(np.int64)[:, None] + offsets for centre in (y, x))
    dy2, dx2 = (rows + 0.5 - y[:, None]) ** 2, (columns + 0.5 - x[:, None]) ** 2
    disk, row, column = np.nonzero(dy2[:, :, None] + dx2[:, None, :] <= (radius**2)[:, None, None])
    places = rows[disk, row] * owner.shape[1] + columns[disk, column]
    np.maximum.at(owner.reshape(-1), places, number[disk].astype(np.int32))
