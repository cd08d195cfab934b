"""Layers that move apart, at many instants in float64: means over photosites that are composited, and what photosites see."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from simulator.optics.geometry.projection import Projection
from simulator.scene.scene import Scene

Way = tuple[float, float] | None


def means_along(plane: np.ndarray, is_smooth: bool) -> Callable[[np.ndarray, float], np.ndarray]:
    """Return a function that gives, for begins and a side, means of each row over [begin, begin + side).

    is_smooth: of light that is linear between the middles of squares, else of even squares.
    """
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

    return lambda begins, side: (integral(begins + side) - integral(begins)) / side


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
    common, is_smooth = bool(np.all(opens == opens[0])), scale < 1.0
    down_columns = [means_along(np.asarray(plane, np.float64).T, is_smooth) for plane in planes]

    def read(number: int, way_px, share: float) -> np.ndarray:
        across, down = way_px or (0.0, 0.0)
        found = np.empty((rows_there, columns))
        for rows in [slice(0, rows_there)] if common else [slice(row, row + 1) for row in range(rows_there)]:
            come = opens[rows][0] + share
            x = projection.offset_x + scale * np.arange(columns) - come * across
            y = projection.offset_y + scale * np.arange(rows_there)[rows] - come * down
            found[rows] = means_along(down_columns[number](y, scale).T, is_smooth)(x, scale)
        return found

    borders = np.linspace(0.0, 1.0, instants + 1) if isinstance(instants, int) else instants
    for begin, end in itertools.pairwise(borders.tolist()):
        share = 0.5 * (begin + end)
        front = read(0, ways_px[0], share)
        seen = front + (1.0 - read(1, ways_px[0], share)) * read(2, ways_px[1], share)
        total += (end - begin) * seen
    return total


def exact_layers(
    layers: Sequence[tuple[np.ndarray, np.ndarray | None]],
    projection: Projection,
    ways_px: Sequence[Way],
    opens: np.ndarray,
    columns: int,
    instants: int | np.ndarray,
    side: float = 1.0,
    aside: np.ndarray | float = 0.0,
) -> np.ndarray:
    """Mean over instants of layers of even squares, composited before means over photosites, (rows, columns) float64.

    layers: light (height, width), and coverage, of each, nearest first. side: of a photosite's open area. aside: x, y by which
    each layer is seen displaced at all times, (layers, 2) [px]. Arguments are else as of `dense_layers`. Borders of all pixels
    cut the picture into cells of even light, whose areas are exact.
    """
    total, scale = np.zeros((len(opens), columns)), projection.scale
    times = np.linspace(0.0, 1.0, instants + 1) if isinstance(instants, int) else instants
    common = bool(np.all(opens == opens[0]))
    for begin, end in itertools.pairwise(times.tolist()):
        for rows in [slice(0, len(opens))] if common else [slice(row, row + 1) for row in range(len(opens))]:
            come = opens[rows][0] + 0.5 * (begin + end)
            shifts = np.array([[-come * part for part in way or (0.0, 0.0)] for way in ways_px]) + aside
            across = _cells(columns, projection.offset_x, scale, side, shifts[:, 0])
            down = _cells(rows.stop - rows.start, projection.offset_y + scale * rows.start, scale, side, shifts[:, 1])
            x, y = (0.5 * (borders[1:] + borders[:-1]) for borders in (across[0], down[0]))
            seen, through = np.zeros((len(y), len(x))), np.ones((len(y), len(x)))
            for (light, coverage), (right, below) in zip(layers, shifts, strict=True):
                row = np.clip(np.floor(y + below).astype(int), 0, light.shape[0] - 1)[:, None]
                column = np.clip(np.floor(x + right).astype(int), 0, light.shape[1] - 1)
                seen += through * light[row, column]
                through *= 1.0 if coverage is None else 1.0 - coverage[row, column]
            total[rows] += (end - begin) * _over_photosites(_over_photosites(seen, *down).T, *across).T
    return total


def _cells(
    count: int, offset: float, scale: float, side: float, shifts: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Borders of cells along an axis [px of the scene], and the first and the last border of each photosite."""
    lows = offset + scale * (np.arange(count) + 0.5 * (1.0 - side))
    highs = lows + scale * side
    pixels = [np.arange(np.floor(lows[0] + shift), np.ceil(highs[-1] + shift) + 1.0) - shift for shift in shifts]
    borders = np.unique(np.concatenate([lows, highs, *pixels]))
    return borders, np.searchsorted(borders, lows), np.searchsorted(borders, highs)


def _over_photosites(values: np.ndarray, borders: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Means of the first axis of cells (cells, ...) over photosites, (photosites, ...)."""
    wide = np.diff(borders).reshape(-1, *(1,) * (values.ndim - 1))
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values * wide, axis=0)])
    return (sums[last] - sums[first]) / (borders[last] - borders[first]).reshape(-1, *(1,) * (values.ndim - 1))
