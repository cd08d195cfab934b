"""Contrast of the light beside the depth edges of one picture, and of what lies hidden behind them.

Beside an edge at 0 between signed blur radii s < t a photosite at x sees what is hidden through the points u of the aperture,
-1 to 1 across the edge, through which it looks past the nearer surface, x + s u > 0, and behind it, x + t u < 0. Where the
focus lies between both surfaces, or on one of them, that is half of the aperture at most. Else it is most at the rim of the
smaller circle, through what lies beyond the ratio of the radii: the part of a disk beyond a chord. Over the places of x its sum
is the difference of the radii times the mean of |u| over half the disk, 2 / (3 pi).

Beside things smaller than their blur circles it is more. What is hidden is seen past the nearer surface, and lies behind it: at
most through the part of the nearer surface's circle that it leaves open, and of the farther one's circle that it covers. It
counts by the light of the most that differs within the largest circle.

What is assumed there is the mean of what else is seen, where rays that meet no surface are left out, what `scene.hidden`
continues, or the light at which a ray last saw the surface (kernels/lens_height_field.cl): beside an edge that of few pixels.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import hidden_error
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, STEEPEST_PX, Defocus
from simulator.optics.defocus.scene_light import LAMP, MOST, seen_contrast
from simulator.scene.occluded_background import EDGE_PX, MOST_ESTIMATED, depth_edges
from simulator.scene.scene import Scene, is_depth_map
from simulator.scene.window_filters import window_maximum, window_mean, window_minimum

BESIDE = 2.0 / (3.0 * math.pi)  # sum over places beside an edge of the part of the aperture that sees past it [radii]
UNKNOWN = 0.5  # contrast of layers whose surfaces have steps
LAST_SEEN_PX = 3.0  # side of the square beside an edge over which light is assumed to go on behind it, at least [photosites]
WIDEST_PX = 129  # widest surroundings of a depth edge whose mean is its background [pixels of the thinned picture]


@dataclass(frozen=True)
class DepthEdgeContrast:
    """Contrasts of the light where a depth edge lies within the largest radius, as shares of the brightest light.

    beside: quantile 0.99 of its deviation from its mean around it, there or in all blocks that sample the aperture. behind,
    hidden: as of `SceneContrast`.
    """

    beside: float = 0.0
    behind: float = 0.0
    hidden: float = 0.0


def depth_edge_contrast(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> DepthEdgeContrast:
    """Measure the contrasts of a scene of one picture; of several layers they are those of the laws.

    What half of the aperture sees beside an edge lies within a radius of it, and so does what is assumed in its place: the
    light of a photosite, mean over its area and over half of the farther surface's circle, is compared with that which differs
    most within half a radius, mean over as much, or over LAST_SEEN_PX.
    """
    if scene.behind or not is_depth_map(scene.depth_m):
        hidden = hidden_error(UNKNOWN, defocus.largest_px)
        return DepthEdgeContrast(UNKNOWN, *((UNKNOWN, hidden) if defocus.guessed else (0.0, 0.0)))
    picture = _edged_picture(scene, to_share, defocus)
    if not picture.around.any():
        return DepthEdgeContrast()
    mean = window_mean(picture.light, picture.width)
    deviation = seen_contrast(picture.light - mean, mean, defocus.accuracy)
    beside = max(float(np.quantile(deviation[places], 0.99)) for places in (picture.around, picture.sampled))
    if not defocus.guessed:
        return DepthEdgeContrast(beside)
    scale = defocus.scale / picture.every
    side = max(round(scale), round(math.sqrt(0.5 * math.pi) * picture.far_px * scale), 1)
    light = window_mean(picture.light, side, "nearest")
    length = min(math.ceil(defocus.largest_px * scale), WIDEST_PX)
    local = window_mean(picture.light, max(round(LAST_SEEN_PX * scale), round(0.5 * length), 1), "nearest")
    greatest, least = window_maximum(local, length, "nearest"), window_minimum(local, length, "nearest")
    most = np.maximum(greatest - light, light - least)
    every = seen_contrast(most, mean, defocus.accuracy)
    seen, near = every[picture.around], window_maximum(every, picture.width, "nearest")[picture.around]
    least_px, greatest_px = (ends[picture.around] for ends in picture.ends_px)
    whole, small = 4.0 * BESIDE * (greatest_px - least_px), picture.past_small
    straight = np.minimum(hidden_share(least_px, greatest_px), whole) * seen
    of_frame = max(1.0 - (1.0 - MOST) / float(picture.around.mean()), 0.0)  # what is not beside an edge hides nothing
    hidden = np.maximum(straight, np.minimum(small, whole) * near)
    return DepthEdgeContrast(beside, float(np.quantile(seen, MOST)), float(np.quantile(hidden, of_frame)))


def hidden_share(least_px: np.ndarray, greatest_px: np.ndarray) -> np.ndarray:
    """Largest part of the aperture that sees what is hidden behind a straight edge between two signed radii [photosites]."""
    small, large = (join(np.abs(least_px), np.abs(greatest_px)) for join in (np.minimum, np.maximum))
    t = small / np.maximum(large, 1e-9)
    beyond = 0.5 - (t * np.sqrt(1.0 - t * t) + np.arcsin(t)) / math.pi
    return np.where(least_px * greatest_px < 0.0, 0.5, beyond)


def share_past_small(
    radius_px: np.ndarray, places: np.ndarray, least_px: np.ndarray, greatest_px: np.ndarray, scale: float
) -> np.ndarray:
    """Part of the aperture that sees what is hidden behind things smaller than their circles; 0 where it is at most a half.

    radius_px: (rows, columns), signed. places: (rows, columns) bool, some n of them. least_px, greatest_px: (n,), of the edges
    around them [photosites]. scale: pixels per photosite. What is nearer than the middle of both is the nearer surface; means
    are over squares as large as the circles.
    """
    rows, columns = np.nonzero(places)
    middle = np.full(radius_px.shape, np.median(least_px + greatest_px))
    middle[rows, columns] = least_px + greatest_px
    sums = np.zeros((radius_px.shape[0] + 1, radius_px.shape[1] + 1))
    np.cumsum(np.cumsum(2.0 * radius_px < middle, axis=0), axis=1, out=sums[1:, 1:])

    def mean(circle_px: np.ndarray) -> np.ndarray:
        half = np.rint(0.5 * math.sqrt(math.pi) * np.abs(circle_px) * scale).astype(int)
        top, left = np.maximum(rows - half, 0), np.maximum(columns - half, 0)
        below, right = np.minimum(rows + half + 1, radius_px.shape[0]), np.minimum(columns + half + 1, radius_px.shape[1])
        inside = sums[below, right] - sums[top, right] - sums[below, left] + sums[top, left]
        return np.asarray(inside / ((below - top) * (right - left)))

    found = np.minimum(1.0 - mean(least_px), mean(greatest_px))
    return np.where(found > 0.5, found, 0.0)


@dataclass(frozen=True)
class _EdgedPicture:
    """A picture with depth of which every so many pixels are taken.

    light: (rows, columns), of the channel with most, that of lamps left out. around: (rows, columns) bool, whether a depth edge
    lies within the largest radius, width: of a square around its circle [px]. sampled: whether it may lie in a block with such
    a place. ends_px: least and greatest signed blur radius at the edges there [photosites]. far_px: radius that all but a
    hundredth of the farther sides of edges have at least [photosites]. past_small: `share_past_small` there.
    """

    light: np.ndarray
    around: np.ndarray
    sampled: np.ndarray
    width: int
    every: int
    far_px: float
    ends_px: tuple[np.ndarray, np.ndarray]
    past_small: np.ndarray


def _edged_picture(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> _EdgedPicture:
    """Return a scene of one picture with depth, and where its depth has edges."""
    every = math.ceil(math.sqrt(scene.planes[..., 0].size / MOST_ESTIMATED))
    light = np.minimum((scene.planes[::every, ::every] @ to_share).max(axis=2), LAMP)
    radius = defocus.radii_px[0]
    assert isinstance(radius, np.ndarray)  # depth is a map, and steps were found in its radius
    own = radius[::every, ::every]
    edges = depth_edges(-own, min(EDGE_PX, STEEPEST_PX / defocus.scale))
    either = edges.near | edges.far
    width = min(2 * math.ceil(defocus.largest_px * defocus.scale / every) + 1, WIDEST_PX)
    far_px = float(np.quantile(np.abs(own[edges.far]), 0.01)) if edges.far.any() else 0.0
    ends_px = window_minimum(np.where(either, own, np.inf), width), window_maximum(np.where(either, own, -np.inf), width)
    around = np.isfinite(ends_px[0])
    least_px, greatest_px = (ends[around] for ends in ends_px)
    past_small = np.zeros(0)
    if around.any():
        past_small = share_past_small(own, around, least_px, greatest_px, defocus.scale / every)
    sampled = around
    for axis, side in enumerate((BLOCK_ROWS, BLOCK_COLUMNS)):
        sampled = window_maximum(sampled, 2 * math.ceil(side * defocus.scale / every) + 1, axes=(axis,))
    return _EdgedPicture(light, around, sampled, width, every, far_px, ends_px, past_small)
