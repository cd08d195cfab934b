"""Two layers that move apart: exact means over photosites, composited at many instants in float64."""

import itertools
from collections.abc import Sequence

import numpy as np

from simulator.optics.geometry.projection import Projection
from simulator.scene.scene import Scene

Way = tuple[float, float] | None


def mean_along(plane: np.ndarray, begins: np.ndarray, side: float, is_smooth: bool) -> np.ndarray:
    """Means of each row over [begin, begin + side), of even squares or of light that is linear between their middles."""
    width = plane.shape[1]
    if is_smooth:  # its integral is a parabola between the middles
        knots, wide = np.arange(-1.0, width + 1.0) + 0.5, np.pad(plane, ((0, 0), (1, 1)), "edge")
        sums = np.concatenate([np.zeros((len(plane), 1)), np.cumsum(0.5 * (wide[:, 1:] + wide[:, :-1]), axis=1)], axis=1)
    else:
        knots, wide = np.arange(width + 1.0), np.pad(plane, ((0, 0), (0, 1)), "edge")
        sums = np.concatenate([np.zeros((len(plane), 1)), np.cumsum(plane, axis=1)], axis=1)

    def integral(places: np.ndarray) -> np.ndarray:
        cell = np.clip(np.searchsorted(knots, places, side="right") - 1, 0, len(knots) - 2)
        past = places - knots[cell]
        bend = 0.5 * past**2 * (wide[:, cell + 1] - wide[:, cell]) if is_smooth else 0.0
        inside = sums[:, cell] + past * wide[:, cell] + bend
        outside = np.where(places < knots[0], wide[:, :1], wide[:, -1:])
        beyond = np.where(places < knots[0], places - knots[0], places - knots[-1])
        end = np.where(places < knots[0], sums[:, :1], sums[:, -1:])
        return np.where((places < knots[0]) | (places > knots[-1]), end + beyond * outside, inside)

    return (integral(begins + side) - integral(begins)) / side


def dense_layers(
    scene: Scene, projection: Projection, ways_px: Sequence[Way], opens: np.ndarray, columns: int, instants: int | np.ndarray
) -> np.ndarray:
    """Mean over instants of exact means over photosites of two layers, composited front to back, (rows, columns) float64.

    ways_px: of the layers to the right and down in the exposure [px of the scene]; None: at rest. opens: (rows,) times at which
    rows open, in units of the exposure time. instants: how many, evenly; or borders of intervals with an instant in the middle,
    as shares of the exposure. At one pixel per photosite squares are means, too.
    """
    rows_there = len(opens)
    planes = [scene.planes[..., 0], scene.coverage, scene.behind[0].planes[..., 0]]
    scale, total = projection.scale, np.zeros((rows_there, columns))
    common = bool(np.all(opens == opens[0]))

    def read(plane: np.ndarray, way_px, share: float) -> np.ndarray:
        across, down = way_px or (0.0, 0.0)
        found = np.empty((rows_there, columns))
        for rows in [slice(0, rows_there)] if common else [slice(row, row + 1) for row in range(rows_there)]:
            come = opens[rows][0] + share
            x = projection.offset_x + scale * np.arange(columns) - come * across
            y = projection.offset_y + scale * np.arange(rows_there)[rows] - come * down
            along = mean_along(np.asarray(plane, np.float64), x, scale, scale < 1.0)
            found[rows] = mean_along(along.T, y, scale, scale < 1.0).T
        return found

    borders = np.linspace(0.0, 1.0, instants + 1) if isinstance(instants, int) else instants
    for begin, end in itertools.pairwise(borders.tolist()):
        share = 0.5 * (begin + end)
        front = read(planes[0], ways_px[0], share)
        seen = front + (1.0 - read(planes[1], ways_px[0], share)) * read(planes[2], ways_px[1], share)
        total += (end - begin) * seen
    return total


def dense_points(
    scene: Scene, projection: Projection, ways_px: Sequence[Way], shape: tuple[int, int], instants: int, points: int = 12
) -> np.ndarray:
    """As `dense_layers`, composited at points x points places of each photosite, whose pixels are even squares."""
    rows, columns = shape
    y, x = ((np.mgrid[: rows * points, : columns * points] + 0.5) / points) * projection.scale
    planes = [scene.planes[..., 0], scene.coverage, scene.behind[0].planes[..., 0]]

    def read(plane: np.ndarray, way_px: Way, share: float) -> np.ndarray:
        across, down = way_px or (0.0, 0.0)
        row, column = (
            np.clip(np.floor(place + begin - share * way).astype(int), 0, size - 1)
            for place, begin, way, size in (
                (y, projection.offset_y, down, plane.shape[0]),
                (x, projection.offset_x, across, plane.shape[1]),
            )
        )
        return plane[row, column].astype(np.float64)

    total = np.zeros(x.shape)
    for share in (np.arange(instants) + 0.5) / instants:
        through = 1.0 - read(planes[1], ways_px[0], share)
        total += read(planes[0], ways_px[0], share) + through * read(planes[2], ways_px[1], share)
    return total.reshape(rows, points, columns, points).mean(axis=(1, 3)) / instants
