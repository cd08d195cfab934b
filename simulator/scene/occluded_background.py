"""The background that near objects occlude in a single picture with depth.

A lens sees past a depth edge (disocclusion), so a blurred picture needs the occluded background. It is assumed to continue
behind the edge as it looks beside it: the mean of colour and of inverse depth over an area beside the edge, whose size is the
pixel's distance from the edge. The picture holds no data there; `disoccluded_pixels` finds the pixels that depend on it.
"""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from simulator.scene.nearest_pixels import nearest_pixels
from simulator.scene.scene import Layer, Scene, is_depth_map

Places = tuple[np.ndarray, np.ndarray]  # rows and columns of pixels, (n,) each

Hidden = Annotated[
    Literal["none", "extend"],
    "what a lens sees behind the edges of near things: nothing but what the picture shows, or the background continued",
]
EDGE_PX = 1.0  # difference of the blur radii above which two neighbours lie on different surfaces
MOST_ESTIMATED = 1_000_000  # pixels from which the share of a larger picture is estimated

# Places beside the edge where the background is sampled, (across, along) the edge, in units of the pixel's distance from the
# edge. The first, which is the background pixel at the edge itself, always counts.
TAPS = ((0.0, 0.0), *((0.5, along) for along in (-0.75, -0.25, 0.25, 0.75)))


@dataclass(frozen=True)
class DepthEdges:
    """Depth edges: 4-connected neighbours on different surfaces.

    near: (height, width) bool, pixels with a neighbour on a farther surface.
    far: (height, width) bool, pixels with a neighbour on a nearer one.
    down, right: (height, width) int8, step from a near pixel to its farthest neighbour; 0 elsewhere.
    """

    near: np.ndarray
    far: np.ndarray
    down: np.ndarray
    right: np.ndarray


def depth_edges(inverse: np.ndarray, step: float) -> DepthEdges:
    """Find the edges of inverse depth (height, width) float32 [1/m], where neighbours differ by more than `step` [1/m]."""
    farthest = np.full(inverse.shape, step, np.float32)  # largest drop of 1/depth to a neighbour so far
    near, far = np.zeros(inverse.shape, bool), np.zeros(inverse.shape, bool)
    down, right = np.zeros(inverse.shape, np.int8), np.zeros(inverse.shape, np.int8)
    everything = slice(None)
    for axis in (0, 1):
        first = (slice(-1), everything) if axis == 0 else (everything, slice(-1))
        second = (slice(1, None), everything) if axis == 0 else (everything, slice(1, None))
        drop = inverse[first] - inverse[second]
        for here, there, sign in ((first, second, 1), (second, first, -1)):
            own = sign * drop
            far[there] |= own > step
            deeper = own > farthest[here]
            near[here] |= deeper
            np.copyto(farthest[here], own, where=deeper)
            np.copyto(down[here], np.int8(sign * (axis == 0)), where=deeper)
            np.copyto(right[here], np.int8(sign * (axis == 1)), where=deeper)
    return DepthEdges(near, far, down, right)


def extend_background(scene: Scene, px_per_dioptre: float) -> Scene:
    """Add the occluded background to a scene of one layer whose `hidden` is "extend"; return any other scene as it is.

    px_per_dioptre: how much the signed blur radius [scene px] grows per 1/m of inverse depth.
    """
    depth_m = scene.depth_m
    if scene.hidden == "none" or scene.behind or not is_depth_map(depth_m):
        return scene
    inverse = _inverse_depth(depth_m)
    reach_px = px_per_dioptre * float(inverse.max() - inverse.min()) + 1.0
    layer = occluded_background(scene.planes, depth_m, reach_px, EDGE_PX / px_per_dioptre)
    return scene if layer is None else replace(scene, behind=(layer,))


def disoccluded_share(
    depth_m: np.ndarray, px_per_dioptre: float, focus_distance_m: float, most_pixels: int = MOST_ESTIMATED
) -> float:
    """Return the share of pixels that `disoccluded_pixels` finds; above `most_pixels`, estimated from every kth row and column.

    The signed blur radius is px_per_dioptre * (1 / focus_distance_m - 1 / depth) [scene px], as of a thin lens.
    """
    every = math.ceil(math.sqrt(depth_m.size / most_pixels))
    thinned = depth_m[::every, ::every]
    per_dioptre = px_per_dioptre / every  # in pixels of the thinned picture
    radius_px = np.float32(per_dioptre) * (np.float32(1.0 / focus_distance_m) - _inverse_depth(thinned))
    # k pixels apart a slope rises k times as much.
    return float(disoccluded_pixels(thinned, radius_px, EDGE_PX / per_dioptre).mean())


def occluded_background(planes: np.ndarray, depth_m: float | np.ndarray, reach_px: float, step: float) -> Layer | None:
    """Return the layer behind a picture (height, width, bands) with depth (height, width) [m]; None without depth edges.

    It covers the near side's pixels up to `reach_px` from an edge. There it has the colour and the depth of the background
    beyond the nearest point of the edge. It also covers the far side's pixels at the edge, as the picture shows them, so that
    between the two sides, where it is interpolated, no gap is left.
    reach_px: largest difference of the signed blur radii across an edge, so far does a lens see behind it [px].
    step: difference of 1/depth between neighbours above which they lie on two surfaces [1/m].
    """
    if not is_depth_map(depth_m) or reach_px <= 0:
        return None
    inverse = _inverse_depth(depth_m)
    edges = depth_edges(inverse, step)
    if not edges.near.any():
        return None
    edge_rows, edge_columns, squared_px = nearest_pixels(edges.near | edges.far, reach_px)
    within = squared_px <= reach_px**2
    rows, columns = np.nonzero(within & edges.near[edge_rows, edge_columns])
    edge = edge_rows[rows, columns], edge_columns[rows, columns]
    step_across = edges.down[edge], edges.right[edge]
    colour, behind = _background(planes, inverse, (rows, columns), edge, step_across, np.float32(step))
    occluded = inverse[rows, columns] > behind + np.float32(0.5 * step)
    rows, columns = rows[occluded], columns[occluded]
    filled, depth, coverage = np.zeros_like(planes), depth_m.copy(), np.zeros(inverse.shape, np.float32)
    with np.errstate(divide="ignore"):
        filled[rows, columns], depth[rows, columns] = colour[occluded], 1.0 / behind[occluded]
    coverage[rows, columns] = 1.0
    beside = edges.far & (coverage == 0.0)
    filled[beside], coverage[beside] = planes[beside], 1.0
    return Layer(filled, depth, coverage)


def disoccluded_pixels(depth_m: float | np.ndarray, radius_px: np.ndarray, step: float) -> np.ndarray:
    """Find the pixels of the blurred picture that receive light from occluded background, (height, width) bool.

    Beside an edge between blur radii s_near < s_far (signed, positive behind the plane in focus) the lens sees past the edge
    from max(0, -s_near) on the near side to max(0, s_far) on the far side: there a pupil point u exists with x + s_near u
    outside the foreground and x + s_far u behind it. Each pixel's own radius is taken as that of its side.
    radius_px: (height, width) signed blur radius [scene px]. step: as in `occluded_background`.
    """
    if not is_depth_map(depth_m):
        return np.zeros(radius_px.shape, bool)
    edges = depth_edges(_inverse_depth(depth_m), step)
    if not edges.near.any():
        return np.zeros(radius_px.shape, bool)
    rows, columns, squared_px = nearest_pixels(edges.near | edges.far, float(np.abs(radius_px).max()))
    away_px = np.sqrt(squared_px, dtype=np.float32) + np.float32(0.5)  # the edge lies between two pixels
    return away_px < np.where(edges.near[rows, columns], -radius_px, radius_px)


def _inverse_depth(depth_m: np.ndarray) -> np.ndarray:
    return np.float32(1.0) / depth_m.astype(np.float32, copy=False)


def _background(
    planes: np.ndarray, inverse: np.ndarray, own: Places, edge: Places, step_across: Places, step: np.float32
) -> tuple[np.ndarray, np.ndarray]:
    """Estimate colour (n, bands) and 1/depth (n,) of the background behind n pixels of the near side.

    The mean of samples of the background beside the edge, over an area as large as the pixel's distance from the edge: far
    from the edge the mean of a texture has the least error. own, edge: rows and columns of the pixels and of their nearest
    edge pixels. step_across: steps down and right across that edge. step: see `occluded_background` [1/m].
    """
    height, width = inverse.shape
    down, right = step_across
    first = edge[0] + down, edge[1] + right
    distance_px = np.hypot(own[0] - edge[0], own[1] - edge[1], dtype=np.float32)
    limit = inverse[first] + step
    flat_planes, flat_inverse = planes.reshape(height * width, -1), inverse.ravel()
    colour, behind = np.zeros((len(distance_px), planes.shape[2]), np.float32), np.zeros(len(distance_px), np.float32)
    count = np.zeros(len(distance_px), np.float32)
    for away, along in TAPS:
        row = np.rint(first[0] + distance_px * (away * down + along * right)).astype(np.intp)
        column = np.rint(first[1] + distance_px * (away * right + along * down)).astype(np.intp)
        tap = np.clip(row, 0, height - 1) * width + np.clip(column, 0, width - 1)
        farther = (flat_inverse.take(tap) <= limit).astype(np.float32)  # else the sample lies on a nearer surface
        colour += flat_planes.take(tap, axis=0) * farther[:, None]
        behind += flat_inverse.take(tap) * farther
        count += farther
    return colour / count[:, None], behind / count
