"""Dead leaves: disks that lie over one another, of random places, sizes and greys; detail of natural statistics."""

import math

import numpy as np

from simulator.scene.pixel_coverage import disk_coverage

LAYERS = 12.0  # mean number of leaves over a point; exp(-12) of the chart stays open
OPEN = 1e-6  # share of a pixel below which it is covered


def dead_leaves(width: int, height: int, smallest_px: float, largest_px: float, seed: int) -> np.ndarray:
    """Return greys of a picture of dead leaves, (height, width) float64, evenly distributed from 0 to 1.

    Radii r have the density r^-3 between the smallest and the largest (Lee, Mumford and Huang 2001), whose power spectrum falls
    with the square of the frequency between 1 / largest and 1 / smallest; the autocovariance is
    1/12 g(d) / (2 g(0) - g(d)), g the mean area that a leaf shares with itself moved by d (Gousseau and Roueff 2007).
    Leaves are drawn from the front to the back. A pixel that a leaf covers in part, exactly by area, shows what lies behind in
    the rest; so where several rims cross a pixel, their covers count as independent. What stays open is middle grey.
    """
    rng = np.random.default_rng(seed)
    room = height + 2 * largest_px, width + 2 * largest_px  # leaves whose centre lies outside reach in
    ratio = (smallest_px / largest_px) ** 2
    mean_area = math.pi * 2.0 * smallest_px**2 * math.log(largest_px / smallest_px) / (1.0 - ratio)
    count = math.ceil(LAYERS * room[0] * room[1] / mean_area)
    radii = smallest_px / np.sqrt(1.0 - rng.random(count) * (1.0 - ratio))
    ys, xs = (side * rng.random(count) - largest_px for side in room)
    greys = rng.random(count)
    picture, left_open = np.zeros((height, width)), np.ones((height, width))
    for x, y, radius, grey in zip(xs.tolist(), ys.tolist(), radii.tolist(), greys.tolist(), strict=True):
        left, top = max(math.floor(x - radius), 0), max(math.floor(y - radius), 0)
        right, bottom = min(math.ceil(x + radius), width), min(math.ceil(y + radius), height)
        if left >= right or top >= bottom:
            continue
        part = left_open[top:bottom, left:right]
        if part.max() < OPEN:
            continue
        share = part * disk_coverage(x, y, radius, left, top, right - left, bottom - top)
        picture[top:bottom, left:right] += grey * share
        part -= share
    return picture + 0.5 * left_open
