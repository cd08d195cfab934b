"""Search of a raw frame for areas with one slanted edge and nothing else."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter

from simulator.errors import PhotositeError
from simulator.measurement.statistics.clipping import MOST_CLIPPED
from simulator.measurement.statistics.slanted_edge import locate_edge

CELL_PX = 4  # photosites of a side that are averaged before the search: whole 2x2 blocks, so that colours do not matter
SIDES_PX = (160, 96, 64, 48)  # of the areas that are tried, the largest first
STRIDE = 4  # of an area's side
LEAST_COHERENCE = 0.9  # of the gradient's directions in an area, 1 where all are parallel
ANGLES_DEG = (2.0, 43.0)  # between an edge and the nearer axis of the photosites
MOST_TRIED = 24  # areas of one size, those with most contrast
LEAST_EXPLAINED = 0.97  # share of the signal's variance that the distance from the edge explains


@dataclass(frozen=True)
class FoundEdge:
    """An area with one edge.

    area: top, left, height, width [photosites]. angle_deg: between the edge and the nearer axis.
    explained: share of the signal's variance that the distance from the edge explains.
    """

    area: tuple[int, int, int, int]
    angle_deg: float
    explained: float


def find_edges(signal: np.ndarray, clipped: np.ndarray, most: int = 1) -> list[FoundEdge]:
    """Return areas with one slanted edge, at most `most`, without overlap, those of most contrast first.

    All are squares of one size, the largest of SIDES_PX of which there is one.
    signal: (height, width) float64 above black; colours may differ in a factor. clipped: mask of the photosites that clip.
    The structure tensor (Bigün and Granlund 1987) of means over 4 x 4 photosites finds areas in which all gradients are
    parallel, at 2 to 43 degrees from an axis. Of these, an area counts where the distance from one straight line explains the
    signal.
    """
    height, width = (side // CELL_PX for side in signal.shape)
    cells = signal[: height * CELL_PX, : width * CELL_PX].reshape(height, CELL_PX, width, CELL_PX).mean(axis=(1, 3))
    found: list[FoundEdge] = []
    for side_px in SIDES_PX:
        if found or min(signal.shape) < side_px:
            continue
        for top, left in _candidates(cells, side_px // CELL_PX):
            area = (CELL_PX * top, CELL_PX * left, side_px, side_px)
            if len(found) < most and not any(_overlap(area, one.area) for one in found):
                edge = _check(signal, area, clipped)
                found += [] if edge is None else [edge]
    return found


def _candidates(cells: np.ndarray, side: int) -> list[tuple[int, int]]:
    """Return upper left cells of the areas whose gradients are parallel and slanted, those with most contrast first."""
    if min(cells.shape) < side:
        return []
    down, across = np.gradient(cells)
    parts = [uniform_filter(product, side, mode="nearest") for product in (across**2, down**2, across * down)]
    step = max(1, side // STRIDE)
    # The filter is centred; an area from (y, x) on has its value at its middle.
    places = [np.arange(0, count - side + 1, step) for count in cells.shape]
    xx, yy, xy = (part[np.ix_(places[0] + side // 2, places[1] + side // 2)] for part in parts)
    energy = xx + yy
    with np.errstate(invalid="ignore", divide="ignore"):
        coherence = ((xx - yy) ** 2 + 4.0 * xy**2) / energy**2
    direction = np.degrees(0.5 * np.arctan2(2.0 * xy, xx - yy))  # of the gradient, -90 to 90
    angle = np.abs(direction - 90.0 * np.rint(direction / 90.0))
    good = (coherence > LEAST_COHERENCE) & (angle > ANGLES_DEG[0]) & (angle < ANGLES_DEG[1])
    rows, columns = np.nonzero(good)
    order = np.argsort(-energy[rows, columns], kind="stable")[:MOST_TRIED]
    return [(int(places[0][rows[index]]), int(places[1][columns[index]])) for index in order]


def _check(signal: np.ndarray, area: tuple[int, int, int, int], clipped: np.ndarray) -> FoundEdge | None:
    """Return the edge of an area; None where there is none, or more than one, or the light clips.

    The means of 2 x 2 photosites are looked at, so that colours do not matter.
    """
    top, left, height, width = area
    place = slice(top, top + height), slice(left, left + width)
    part = signal[place]
    if clipped[place].mean() > MOST_CLIPPED:
        return None
    blocks = part.reshape(height // 2, 2, width // 2, 2).mean(axis=(1, 3))
    try:
        edge = locate_edge(blocks)
    except PhotositeError:
        return None
    bins = np.rint(edge.distance_px * 2.0).astype(int)
    bins -= bins.min()
    counts = np.maximum(np.bincount(bins), 1)
    scatter = edge.signal - (np.bincount(bins, edge.signal) / counts)[bins]
    explained = 1.0 - float(scatter.var() / max(edge.signal.var(), 1e-300))
    # An edge through a corner leaves too little on one side.
    inside = edge.reach_px > 0.25 * min(blocks.shape) and ANGLES_DEG[0] < edge.angle_deg < ANGLES_DEG[1]
    rows = edge.rows * math.tan(math.radians(edge.angle_deg)) >= 1.0
    return FoundEdge(area, edge.angle_deg, explained) if inside and rows and explained >= LEAST_EXPLAINED else None


def _overlap(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> bool:
    """Whether two areas share a photosite."""
    return all(one[axis] < other[axis] + other[axis + 2] and other[axis] < one[axis] + one[axis + 2] for axis in (0, 1))
