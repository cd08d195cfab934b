"""Motion behind a defocused lens: each point of the aperture carries an instant.

A camera's translation moves the image of a surface by an amount linear in its signed blur radius R, as a point of the aperture
does. So through the point u, at the instant t, a photosite at x sees the place of a surface
    x + R (u + aperture(t)) + place(t),
exactly where the surface is flat: `aperture` [pupil radii] and `place` [photosites] are those of its inverse distance. Light is
the mean over pairs of a point and an instant that mix well, which holds occlusion, blur and motion together; neither may be
computed before the other. Photosites share points in cells (`Cells`). Where the picture turns or stretches, shifts are bilinear
over a cell, from those of its corners, and u turns with the surface. The motion of a layer is affine at each instant, so that
this is exact but for what a rolling shutter bends.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from simulator.exposure.light_curve import collect
from simulator.exposure.line_times import LineTimes
from simulator.optics.geometry.image_motion import ImageMotion
from simulator.optics.geometry.instants import TimedPath
from simulator.optics.lens.lens import Lens

CELL_PX = 0.03  # largest difference of an image's path within a cell whose points are the same [photosites]
BEND_PX = 0.01  # largest distance of a path from bilinear ones within a cell whose points turn, along either axis [photosites]
WIDEST_CELL_PX = 2048  # cells are no wider and no higher
LEAST_CELL_ROWS, MOST_CELL_ROWS = 2, 8  # of a rolling shutter: rows of the colours of a filter's block; of points that grow
MOST_BEYOND_PX = 0.2  # farthest beyond its samples that a ray of a growing cell is read [photosites]
PROBED = 257  # instants at which paths are measured
STRAIGHT_PX = 0.002  # largest distance of a path from the straight pieces by which points follow it [photosites]
LEAST_NODES, MOST_NODES = 8, 4096  # of those pieces
FLICKER_STRATA = 512  # parts of equal light of a line whose light is uneven over time


@dataclass(frozen=True)
class BlurLaw:
    """Signed blur radius of a distance Z: R = at_infinity_px - growth_px / Z [photosites, m]."""

    at_infinity_px: float
    growth_px: float


@dataclass(frozen=True)
class Cells:
    """Cells of photosites that share points of aperture and time, from the sensor's corner on.

    columns, rows: of a cell. points: how they differ within a cell: not at all; from row to row; or from place to place, as a
    bilinear function. error_px: largest error of a path in a cell [photosites].
    """

    columns: int
    rows: int
    points: Literal["even", "rows", "places"]
    error_px: float


@dataclass(frozen=True)
class JointMotion:
    """Motion of the images of a scene's layers, nearest first, while lines of the sensor are open.

    path: of the images, with lines and light. law: of the blur. radii_px: (layers, 2) least and greatest signed blur radius of
    each layer [photosites]. wider: width of the photosites of the blur in photosites of the camera, as in `Defocus`.
    """

    path: TimedPath
    law: BlurLaw
    radii_px: np.ndarray
    wider: int = 1

    def on_wider_photosites(self) -> Self:
        """Return the same motion as photosites see it that are twice as wide."""
        law = BlurLaw(0.5 * self.law.at_infinity_px, 0.5 * self.law.growth_px)
        return replace(self, law=law, radii_px=0.5 * self.radii_px, wider=2 * self.wider)

    @property
    def layers(self) -> int:
        """Number of layers."""
        return len(self.radii_px)

    @property
    def image(self) -> ImageMotion:
        """Geometry of the images."""
        return self.path.motion

    @property
    def _centre_px(self) -> np.ndarray:
        """Place of the optical axis from the sensor's corner, in photosites of the camera."""
        return 0.5 * np.array([self.image.geometry.width_px, self.image.geometry.height_px])

    def shifts(self, numbers: np.ndarray, places_px: np.ndarray) -> np.ndarray:
        """Return shifts of aperture and place, (layers, ..., places, 4) float64: x, y [pupil radii], x, y [photosites].

        numbers: (..., numbers) of `ImageMotion.pose_numbers`. places_px: (places, 2) from the sensor's corner [photosites].
        """
        from_axis = self.wider * np.asarray(places_px, np.float64) - self._centre_px
        found = []
        for layer in range(self.layers):
            surface = min(layer, len(self.image.surfaces) - 1)  # background that is continued moves as the last one
            infinity, shift = self.image.parallax(numbers, surface, from_axis)
            infinity, shift = (infinity - from_axis) / self.wider, shift / self.wider
            aperture = -shift / self.law.growth_px
            place = infinity - self.law.at_infinity_px * aperture
            least, greatest = self.radii_px[layer]
            if least == greatest:  # all of its way is one of the place
                aperture, place = np.zeros_like(aperture), place + least * aperture
            found.append(np.concatenate([aperture, place], axis=-1))
        return np.stack(found)

    @cached_property
    def _probes(self) -> tuple[np.ndarray, np.ndarray]:
        """Times [s] and the shifts at the sensor's corners and middles, (layers, times, 9, 4)."""
        step = max(1, (len(self.path.times_s) - 1) // (PROBED - 1))
        numbers = self.path.poses[::step]
        places = (self.image.geometry.corners() + self._centre_px) / self.wider
        return self.path.times_s[::step], self.shifts(numbers, places)

    @cached_property
    def _ends(self) -> np.ndarray:
        """Way of the image of the least and the greatest blur radius of each layer, (2, layers, times, 9, 2) [photosites]."""
        _, shifts = self._probes
        return self.radii_px.T[:, :, None, None, None] * shifts[..., :2] + shifts[..., 2:]

    @cached_property
    def rest_px(self) -> np.ndarray:
        """Whole photosites by which each layer is read aside of its place at rest, (layers, 2) int: most of its way so far.

        A layer that has come far is read where it is, so that the margin of the blur holds only what it moves meanwhile.
        """
        ends = self._ends
        return np.rint(0.5 * (ends.max(axis=(0, 2, 3)) + ends.min(axis=(0, 2, 3)))).astype(int)

    @cached_property
    def largest_aperture(self) -> float:
        """Largest shift of the aperture [pupil radii]."""
        return float(_length(self._probes[1][..., :2]).max())

    @cached_property
    def _farthest_px(self) -> float:
        """Largest way of an image beside `rest_px` [photosites]."""
        return float(_length(self._ends - self.rest_px[:, None, None]).max())

    def reach_px(self, radius_px: float) -> float:
        """Largest way of an image beside `rest_px`, read at blur radii up to this [photosites]."""
        return self._farthest_px + self.largest_aperture * max(radius_px - float(np.abs(self.radii_px).max()), 0.0)

    @cached_property
    def _paths(self) -> tuple[float, float, float]:
        """Longest way while a line is open: of the aperture [pupil radii], of the place, and of any image [photosites]."""
        times, shifts = self._probes
        lines, ways = self.path.lines, []
        for part in (shifts[..., :2], shifts[..., 2:], self._ends):
            steps = _length(np.diff(part, axis=-3))
            steps = steps.max(axis=tuple(axis for axis in range(steps.ndim) if axis != steps.ndim - 2), initial=0.0)
            sums = np.concatenate([[0.0], np.cumsum(steps)])
            ways.append(float((np.interp(lines.closed_s, times, sums) - np.interp(lines.opens_s, times, sums)).max()))
        return ways[0], ways[1], ways[2]

    def path_px(self, radius_px: np.ndarray) -> np.ndarray:
        """Longest way of the image of a surface with blur circles of this radius while a line is open [photosites]."""
        aperture, place, longest = self._paths
        return np.minimum(aperture * np.abs(radius_px) + place, longest)

    def least_path_px(self, radius_px: np.ndarray) -> np.ndarray:
        """Shortest way of the image of a surface of these signed blur radii while a line is open, (radii,) [photosites].

        Shortest of all layers and over the sensor's corners and middles.
        """
        times, shifts = self._probes
        ends = radius_px[:, None, None, None, None] * shifts[..., :2] + shifts[..., 2:]
        lines = self.path.lines
        share = float((lines.closed_s - lines.opens_s).min()) / max(float(times[-1] - times[0]), 1e-300)
        return share * _length(np.diff(ends, axis=2)).sum(axis=2).min(axis=(1, 2))

    @cached_property
    def _tilt(self) -> tuple[float, float]:
        """Largest change of a way per photosite, across and down."""
        grid = self._ends.reshape(*self._ends.shape[:3], 3, 3, 2)  # rows from top to bottom
        geometry = self.image.geometry
        across = np.abs(np.diff(grid, axis=4)).max(initial=0.0) / (0.5 * geometry.width_px / self.wider)
        down = np.abs(np.diff(grid, axis=3)).max(initial=0.0) / (0.5 * geometry.height_px / self.wider)
        return float(across), float(down)

    @property
    def lean(self) -> float:
        """Largest change of a way per photosite, along either axis: the sine of an angle, or a growth."""
        return max(self._tilt)

    @cached_property
    def skew_px(self) -> float:
        """Largest way of an image from one row of photosites to the next [photosites]; 0 where all are open at once."""
        return self._speed_px_per_s * self._row_s if self._row_s else 0.0

    @cached_property
    def _speed_px_per_s(self) -> float:
        """Largest speed of an image [photosites/s]."""
        times, _ = self._probes
        return float(_length(np.diff(self._ends, axis=2)).max(initial=0.0)) / float(times[1] - times[0])

    @cached_property
    def _is_evenly_lit(self) -> bool:
        """Whether each line has one opening and its light is even over time."""
        return len(self.path.openings) == 1 and bool(np.all(self.path.light == self.path.light[0]))

    @cached_property
    def _bend(self) -> tuple[float, float]:
        """Largest second difference of a way, across, and down with the time of each row [photosites per photosite^2]."""
        times, _ = self._probes
        grid = self._ends.reshape(*self._ends.shape[:3], 3, 3, 2)  # rows from top to bottom
        half = 0.5 * self.image.geometry.width_px / self.wider, 0.5 * self.image.geometry.height_px / self.wider
        across = float(np.abs(np.diff(grid, 2, axis=4)).max(initial=0.0)) / half[0] ** 2
        down = float(np.abs(np.diff(grid, 2, axis=3)).max(initial=0.0)) / half[1] ** 2
        if not self._row_s:
            return across, down
        row_s, step_s = self._row_s, float(times[1] - times[0])
        late_s = max(
            float(np.abs(np.diff(one, 2)).max(initial=0.0)) for one in (self.path.lines.opens_s, self.path.lines.closed_s)
        )
        turn = float(np.abs(np.diff(np.diff(grid, axis=3), axis=2)).max(initial=0.0)) / (half[1] * step_s)
        bend = float(np.abs(np.diff(grid, 2, axis=2)).max(initial=0.0)) / step_s**2
        return across, down + 2.0 * row_s * turn + row_s**2 * bend + self._speed_px_per_s * self.wider**2 * late_s

    @cached_property
    def _row_s(self) -> float:
        """Longest time from a row to the next, of photosites of the blur [s]; 0 where all are open at once."""
        lines = self.path.lines
        if lines.is_common or len(lines.opens_s) < 2:
            return 0.0
        return self.wider * max(float(np.abs(np.diff(one)).max()) for one in (lines.opens_s, lines.closed_s))

    def cells(self, block_columns: int, block_rows: int) -> Cells:
        """Return the cells in which photosites share points; they hold whole blocks, or some rows of one.

        Points are the same where paths differ little across a block. They grow over the rows of a block where these differ
        more, as under a rolling shutter. They are bilinear over the cell where rows differ by more still, or where columns do,
        as where the picture turns.
        """
        (across, down), least = self._tilt, min(block_rows, LEAST_CELL_ROWS)
        down += self.skew_px
        columns = _largest(lambda side: 0.5 * across * (side - (side <= block_columns)) <= CELL_PX, block_columns)
        rows = _largest(lambda side: 0.5 * down * (side - (side <= block_rows)) <= CELL_PX, least)
        grown = _largest(lambda side: (0.5 * side - 1.0) * down <= MOST_BEYOND_PX, least, block_rows)
        error_px = 0.5 * (across * columns + down * (rows - 1))
        if 0.5 * across * (block_columns - 1) > CELL_PX or (rows < block_rows and grown <= least):
            return self.turned_cells(block_columns, least)
        return Cells(columns, rows, "even", error_px) if rows >= block_rows else Cells(columns, grown, "rows", error_px)

    def turned_cells(self, least_columns: int, least_rows: int, bend_px: float = BEND_PX) -> Cells:
        """Return the largest cells over which points are bilinear, of at least so many columns and rows.

        bend_px: largest distance of a path from bilinear ones along either axis, where cells are larger [photosites].
        """
        across, down = self._bend
        most_rows = WIDEST_CELL_PX if not self._row_s else MOST_CELL_ROWS if self._is_evenly_lit else least_rows
        columns = _largest(lambda side: _beside_chord(across, side) <= bend_px, least_columns)
        rows = _largest(lambda side: _beside_chord(down, side) <= bend_px, least_rows, most_rows)
        return Cells(columns, rows, "places", _beside_chord(across, columns) + _beside_chord(down, rows))

    def cells_of(self, x_px: np.ndarray, y_px: np.ndarray, cells: Cells) -> tuple[np.ndarray, np.ndarray]:
        """Return which cell each photosite lies in, (2, n) int, and the cells' middles, (n, 2) [photosites].

        x_px, y_px: (n,) int from the sensor's corner. Cells end at the edge of the sensor; those whose points
        differ within them have the middle of all of their places.
        """
        size = np.array([cells.columns, cells.rows])
        edge = np.array([self.image.geometry.width_px, self.image.geometry.height_px])
        number = np.stack([x_px, y_px], axis=-1) // size
        first, last = number * size, (number + 1) * size
        held = np.where(first < edge / self.wider, np.minimum(last, edge / self.wider), last)
        if cells.points != "even":
            held[:, 1] = last[:, 1]
        if cells.points == "places":
            held[:, 0] = last[:, 0]
        return number.T, 0.5 * (first + held)

    def rows_inside(self, y_px: np.ndarray, apart_px: float) -> tuple[np.ndarray, np.ndarray]:
        """Return two places so far apart, evenly above and below others; of those on the sensor no place beyond it.

        y_px: (cells,) of the cells' middles from the sensor's corner.
        """
        edge, half = self.image.geometry.height_px / self.wider, 0.5 / self.wider
        first, last = y_px - 0.5 * apart_px, y_px + 0.5 * apart_px
        inside = (first < edge - half) & (last > half)
        return np.where(inside, np.maximum(first, half), first), np.where(inside, np.minimum(last, edge - half), last)

    def at(self, places_px: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """Return shifts at places less `rest_px`, when these shares of the light have come.

        (places, layers, shares, 4) float32.
        places_px: (places, 2), x and y from the sensor's corner [photosites]. shares: (n,), 0 to 1.
        """
        poses, line_of = self._node_poses(places_px[:, 1])
        nodes = np.empty((len(places_px), self.layers, poses.shape[1], 4), np.float32)
        for line, numbers in enumerate(poses):
            own = np.flatnonzero(line_of == line)
            shifts = self.shifts(numbers, places_px[own])
            shifts[..., 2:] -= self.rest_px[:, None, None]
            nodes[own] = np.moveaxis(shifts, 2, 0)
        return self._follow(nodes, shares)

    def turns_at(self, y_px: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """Return `ImageMotion.turns` of each layer in some rows, as of `at`: (rows, layers, shares, 2, 2) float32."""
        poses, line_of = self._node_poses(y_px)
        surfaces = [min(layer, len(self.image.surfaces) - 1) for layer in range(self.layers)]
        nodes = np.stack([self.image.turns(poses, surface) for surface in surfaces], axis=1).astype(np.float32)
        return self._follow(nodes, shares)[line_of]

    def _node_poses(self, y_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return poses at the nodes of the lines of some rows, (lines, nodes, numbers), and the line of each row."""
        lines, line_of = np.unique(self._lines(y_px), return_inverse=True)
        times = self.quantiles(lines, np.linspace(0.0, 1.0, self._nodes + 1))
        columns = [np.interp(times, self.path.times_s, column) for column in self.path.poses.T]
        return np.stack(columns, axis=-1) if columns else np.zeros((*times.shape, 0)), line_of.reshape(-1)

    def _follow(self, nodes: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """Return values at some shares of the light, linear between those at nodes (n, layers, nodes, ...)."""
        place = np.clip(shares, 0.0, 1.0) * self._nodes
        node = np.minimum(place.astype(np.intp), self._nodes - 1)
        found = nodes[:, :, node]
        late = (place - node).astype(np.float32).reshape(-1, *(1,) * (nodes.ndim - 3))
        found += late * (nodes[:, :, node + 1] - found)
        return found

    @cached_property
    def _nodes(self) -> int:
        """Parts of equal light of a line in which the image of every surface is taken to move evenly along a straight line."""
        path = self.path
        lines, cell_s = path.lines, float(path.times_s[1] - path.times_s[0])
        if not self._is_evenly_lit:
            return FLICKER_STRATA
        bend_px = float(_length(np.diff(path.displacement_px, 2, axis=0)).max(initial=0.0)) / self.wider
        cells = math.sqrt(8.0 * STRAIGHT_PX / max(bend_px, 1e-12))  # over which a path lies this near to its chord
        edges = lines.open_s - lines.opens_s, lines.closed_s - lines.closes_s  # where light grows unevenly with time
        least = FLICKER_STRATA if max(float(edge.max()) for edge in edges) > 0.0 else LEAST_NODES
        open_s = float((lines.closed_s - lines.opens_s).max())
        return int(min(max(math.ceil(open_s / (cell_s * cells)), least), MOST_NODES))

    def _lines(self, y_px: np.ndarray) -> np.ndarray:
        """Place of each cell's middle among the lines, in lines; 0 where all are open at once."""
        if self.path.lines.is_common:
            return np.zeros(len(y_px))
        return np.clip(self.wider * np.asarray(y_px, np.float64) - 0.5, 0.0, len(self.path.lines.opens_s) - 1.0)

    def layer_shifts(self, lines: np.ndarray, points: np.ndarray, radii_px: Sequence[float | np.ndarray]) -> np.ndarray:
        """Return the places of layers that move without a turn, seen through points of `moving_samples`.

        lines: as of `quantiles`. radii_px: signed blur radius of each layer; a background that is continued moves as the
        last one. Displacements (lines, points, layers, 2) float64
        [photosites].
        """
        times_s = self.quantiles(lines, points[:, 5])
        surfaces = len(self.path.motion.surfaces)
        found = np.empty((*times_s.shape, len(radii_px), 2))
        for layer, radius in enumerate(radii_px):
            surface, seen = min(layer, surfaces - 1), np.asarray(radius) * points[:, :2]
            found[:, :, layer] = seen if self.image.is_at_rest(surface) else self.path.shift_at(times_s, surface) + seen
        return found

    def quantiles(self, lines: np.ndarray, shares: np.ndarray) -> np.ndarray:
        """Return the times after the release when these shares of a line's light have come, (lines, shares) [s].

        lines: (lines,) places among the lines, whole at the middle of one.
        """
        path = self.path
        first = lines_at(path.openings[0], lines)
        is_box = bool(np.all(first.open_s == first.opens_s) and np.all(first.closed_s == first.closes_s))
        if is_box and self._is_evenly_lit:
            return first.opens_s[:, None] + (first.closed_s - first.opens_s)[:, None] * shares
        middles = np.empty((len(lines), FLICKER_STRATA))
        for line in range(len(lines)):
            only = [lines_at(one, lines[[line]]) for one in path.openings]
            lit = lines_at(path.lines, lines[[line]])
            inside = np.linspace(lit.opens_s[0], lit.closed_s[0], 16 * FLICKER_STRATA + 1)
            come = np.sum([collect(path.curve, one, path.start_s, path.start_s + inside)[0] for one in only], axis=0)
            sums = np.maximum.accumulate(come)  # in the dark differences round to either side
            if sums[-1] <= 0.0:
                sums = np.linspace(0.0, 1.0, len(inside))
            middles[line] = np.interp((np.arange(FLICKER_STRATA) + 0.5) / FLICKER_STRATA * sums[-1], sums, inside)
        place = shares * FLICKER_STRATA - 0.5
        return np.stack([np.interp(place, np.arange(FLICKER_STRATA), one) for one in middles])


def _length(vectors: np.ndarray) -> np.ndarray:
    """Lengths of vectors (..., 2)."""
    return np.hypot(vectors[..., 0], vectors[..., 1])


def lines_at(lines: LineTimes, places: np.ndarray) -> LineTimes:
    """Return the times between lines, linear in their place."""
    number = np.arange(len(lines.opens_s))
    parts = lines.opens_s, lines.open_s, lines.closes_s, lines.closed_s, lines.peak
    return LineTimes(lines.axis, *(np.interp(places, number, part) for part in parts))


def _largest(fits: Callable[[int], bool], least: int, most: int = WIDEST_CELL_PX) -> int:
    """Return the largest side that fits, `most` halved as often as needed, or `least`."""
    side = most
    while side > least and not fits(side):
        side //= 2
    return side


def _beside_chord(bend: float, side: int) -> float:
    """Return how far a path of this second difference lies from its chord at the middles of so many photosites, at most."""
    return bend * max(side * (side - 2), 0) / 8.0


def plan_joint_motion(
    path: TimedPath, lens: Lens, pixel_pitch_um: float, radii_px: Sequence[float | np.ndarray]
) -> JointMotion:
    """Return the motion of layers with these signed blur radii [photosites], floats or maps, behind a lens.

    path: of the images of as many surfaces.
    """
    at_infinity, at_a_metre = (float(lens.blur_radius_um(depth_m)) / pixel_pitch_um for depth_m in (math.inf, 1.0))
    ranges = np.array([(float(np.min(radius)), float(np.max(radius))) for radius in radii_px])
    return JointMotion(path, BlurLaw(at_infinity, at_infinity - at_a_metre), ranges)
