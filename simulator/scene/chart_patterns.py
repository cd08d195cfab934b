"""Patterns of test charts: the share of bright in each pixel, 0 dark to 1 bright, means over the pixel's area.

All are 3 : 2, `width` pixels wide. Coordinates run from the middle of the chart, x to the right and y down.
"""

import math

import numpy as np

from simulator.scene.pixel_coverage import disk_coverage, half_plane_coverage

STAR_SHARE = 0.475  # radius of the star over the height of the chart


def centres(width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Return x (1, width) and y (height, 1) of the pixels' centres [px]."""
    return np.arange(width)[np.newaxis] + 0.5 * (1 - width), np.arange(height)[:, np.newaxis] + 0.5 * (1 - height)


def slanted_edge(width: int, height: int, angle_deg: float) -> np.ndarray:
    """A straight edge through the middle, bright on the right, whose top leans to the right by this angle; exact areas."""
    x, y = centres(width, height)
    angle = math.radians(angle_deg)
    return half_plane_coverage(x * math.cos(angle) + y * math.sin(angle), angle_deg)


def siemens_star(width: int, height: int, spokes: int) -> np.ndarray:
    """A star 1/2 + 1/2 cos(spokes phi), phi from the x axis, grey outside a circle of STAR_SHARE of the height.

    Means over pixels to first order: the star is a straight grating of its local frequency spokes / (2 pi r) within a pixel,
    whose mean is its value in the middle times a sinc along each axis. Where half a period is a pixel or less, it is grey.
    """
    x, y = centres(width, height)
    radius = np.hypot(x, y)
    reach = STAR_SHARE * height
    with np.errstate(divide="ignore", invalid="ignore"):
        frequency = spokes / (2.0 * math.pi * radius)
        wave = np.cos(spokes * np.arctan2(y, x)) * np.sinc(frequency * y / radius) * np.sinc(frequency * x / radius)
    shown = disk_coverage(0.5 * width, 0.5 * height, reach, 0, 0, width, height)
    return 0.5 + 0.5 * np.where(frequency < 0.5, wave, 0.0) * shown


def zone_plate(width: int, height: int, frequency: float) -> np.ndarray:
    """Rings 1/2 + 1/2 cos(pi k r^2), whose local frequency k r is `frequency` [cycles per width] at half the height.

    cos(a + b) with a of x and b of y: exact means over pixels are products of Fresnel integrals.
    """
    from scipy.special import fresnel

    k = (frequency / width) / (0.5 * height)  # cycles per px^2
    scale = math.sqrt(2.0 * k)

    def means(count: int) -> tuple[np.ndarray, np.ndarray]:
        sine, cosine = fresnel(scale * (np.arange(count + 1) - 0.5 * count))  # of pi/2 t^2
        return np.diff(cosine) / scale, np.diff(sine) / scale

    (cos_x, sin_x), (cos_y, sin_y) = means(width), means(height)
    return 0.5 + 0.5 * (np.outer(cos_y, cos_x) - np.outer(sin_y, sin_x))


def dots(width: int, height: int, columns: int, diameter: float) -> np.ndarray:
    """Dark disks on bright, `columns` of them across in a square lattice with one in the middle of each cell; exact areas.

    diameter: of a disk over their distance.
    """
    pitch = width / columns
    radius, bright = 0.5 * diameter * pitch, np.ones((height, width))
    rows = round(height / pitch)
    for row in range(rows):
        y = 0.5 * height + (row - 0.5 * (rows - 1)) * pitch
        for column in range(columns):
            draw_disk(bright, (column + 0.5) * pitch, y, radius)
    return bright


def draw_disk(bright: np.ndarray, x: float, y: float, radius: float) -> None:
    """Darken the pixels of a picture by the share that a disk covers, in place."""
    height, width = bright.shape
    left, top = max(math.floor(x - radius), 0), max(math.floor(y - radius), 0)
    right, bottom = min(math.ceil(x + radius), width), min(math.ceil(y + radius), height)
    if left < right and top < bottom:
        bright[top:bottom, left:right] *= 1.0 - disk_coverage(x, y, radius, left, top, right - left, bottom - top)
