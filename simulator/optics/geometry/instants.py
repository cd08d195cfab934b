"""The instants at which a moving image is sampled: how many are enough, when, and with what weight on each line of the sensor.

The laws, for a path of L photosites, N instants and a photosite's even square: a step edge of contrast C is wrong by at most
C L / (8 N^2) where neighbouring instants lie within a photosite, else by (C / 2N) (1 - N / 2L); detail of frequency f aliases
above f = N / (2L) [cycles per photosite]. With speed that varies, intervals of equal integrals of sqrt(speed), each represented
by its mean position and weighted by its light, keep the first law with (integral of sqrt(speed))^2 / T <= L instead of L. On a
path that turns back an edge is passed several times, and the errors of the passages add: all of them where passages are alike,
far less where a hand trembles, so that such a path's own error at edges is measured. A border at which one surface covers
another within a picture, without coverage, is seen or not at the photosite's centre: wrong by at most C / (2N), however short
the path.
"""

import math
from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from simulator.exposure.light_curve import LightCurve, SteadyLight
from simulator.exposure.line_times import LineTimes
from simulator.optics.geometry.end_spacing import EndSpacing
from simulator.optics.geometry.fixed_blur import Skew
from simulator.optics.geometry.image_motion import ImageMotion
from simulator.optics.geometry.lit_integrals import LitIntegrals, cell_light

LEAST_CELLS, MOST_CELLS = 512, 131072  # of the time in which any line is open, in which a path is straight
CELLS_PER_LINE = 256  # of the time for which a line is open
CELLS_PER_S = 200.0
CELLS_PER_PERIOD = 32  # of the fastest motion, which is then wrong by 1/200 of its way to either side
FINER_BORDERS = 16  # times as many places as instants at which light that jumps is looked at
PULSED = 4.0  # times as large as of even light is the error of pulses at both ends of an interval, or that end on the way
JUMP = 0.05  # of the brightest light, by which light in the middle of a cell differs from its mean where it jumps
UNEVEN_TURN = 0.38  # of a period in a cell, beside whole ones, where they are too many: whole ones alone would look like rest
MOST_INSTANTS = 4096
STRAIGHT_PX = 1e-4  # largest distance of a way from a straight one at an even speed [photosites]
EDGE_CELLS, EDGE_DIRECTIONS, EDGE_FINER = 16, 4, 16  # of measured errors at edges: per photosite; over 180 deg; instants
EDGE_MARGIN = 2.0  # by which the error at other places of the picture may be larger than measured; 1.55 was found
MIDDLE = 4  # number of the sensor's middle among `ImageGeometry.corners`
VIEWS = 18  # of `ImageMotion.displacements` of a surface: corners at its nearest and at its farthest distance

STEADY = SteadyLight()


@dataclass(frozen=True)
class Instants:
    """Sampling of a moving image over time.

    axis: of the lines, as of `LineTimes`. weights: (lines, instants) float64, share of a line's light, of sum 1.
    times_s: (lines, instants) float64, mean time of each interval on the shot's clock, weighted by its light [s].
    pose_numbers: (lines, instants, numbers) float64, mean poses of the intervals (`ImageMotion.pose_numbers`).
    """

    axis: Literal["rows", "columns", "all"]
    weights: np.ndarray
    times_s: np.ndarray
    pose_numbers: np.ndarray

    @property
    def count(self) -> int:
        """Instants of each line."""
        return self.weights.shape[1]


@dataclass(frozen=True)
class PathLength:
    """Length of a path of images.

    longest_px: of the longest path over the frame [photosites]. even_px: length of an even path that needs as many instants,
    (integral of sqrt(speed) dt)^2 / T [photosites]. passages: mean number of times that the path passes a place of its own.
    """

    longest_px: float
    even_px: float
    passages: float = 1.0


class TimedPath:
    """A path of images under a shutter, as straight pieces: how far it reaches, and the instants that represent it."""

    def __init__(
        self, motion: ImageMotion, openings: LineTimes | tuple[LineTimes, ...], start_s: float, curve: LightCurve = STEADY
    ) -> None:
        """openings: when each line is open, from the release at start_s on the shot's clock on [s]; several add up.

        curve: light over the shot's clock.
        """
        self.openings = (openings,) if isinstance(openings, LineTimes) else openings
        self.motion, self.start_s, self.curve = motion, start_s, curve
        lines = self.lines = self._lit_span()
        first, last = float(lines.opens_s.min()), float(lines.closed_s.max())
        open_s = lines.closed_s - lines.opens_s
        line_s = float(open_s.min(initial=last - first, where=open_s > 0.0))
        wanted = max(CELLS_PER_LINE / max(line_s, 1e-12), CELLS_PER_S) * (last - first)
        periods = motion.fastest_hz * (last - first)
        cells = int(min(max(wanted, CELLS_PER_PERIOD * periods, LEAST_CELLS), MOST_CELLS))
        self.is_followed = cells >= math.floor(CELLS_PER_PERIOD * periods)
        turn, whole = math.modf(periods / cells)
        if 2.0 * periods > cells and abs(turn - 0.5) > 0.2:
            cells = math.ceil(periods / (whole + (turn > 0.5) + UNEVEN_TURN))
        self.times_s = np.linspace(first, last, cells + 1)
        self.poses = motion.pose_numbers(start_s + self.times_s)
        self.light = cell_light(curve, start_s + self.times_s)
        ramps = any(bool((one.open_s > one.opens_s).any() or (one.closed_s > one.closes_s).any()) for one in self.openings)
        in_middle = curve.brightness(start_s + 0.5 * (self.times_s[1:] + self.times_s[:-1]))  # no mean where light jumps
        self.is_pulsed = bool(np.abs(in_middle - self.light).max() > JUMP * self.light.max())
        self.is_evenly_lit = len(self.openings) == 1 and not ramps and bool(np.all(self.light == self.light[0]))
        self.displacement_px = motion.displacements(self.poses)
        steps = np.linalg.norm(np.diff(self.displacement_px, axis=0), axis=-1)
        self.steps_px = steps.max(axis=1, initial=0.0)
        self.goes_on = False  # beyond the sensor's border
        self.straight_px = STRAIGHT_PX
        self.spacing: EndSpacing | None = None  # of `instants` by speed
        self.late_s = np.zeros(1)  # of lines beyond it, after those at the border

    def going_on(self) -> Self:
        """Return the same path, which goes on evenly beyond the sensor's border, as lines would that lie there."""
        found = copy(self)
        found.goes_on = True
        return found

    def at_spot(self, x_px: float, y_px: float) -> Self:
        """Return the same path as photosites see it that lie so far from these."""
        found = copy(self)
        found.motion = replace(self.motion, spot_px=(x_px, y_px))
        return found

    def straight_within(self, straight_px: float) -> Self:
        """Return the same path, whose ways count as straight only within this distance [photosites], up to STRAIGHT_PX."""
        found = copy(self)
        found.straight_px = min(straight_px, STRAIGHT_PX)
        return found

    def spaced(self, spacing: EndSpacing | None) -> Self:
        """Return the same path, whose instants by speed are denser at its ends; None: they are not."""
        found = copy(self)
        found.spacing = spacing
        return found

    def borders(self, count: int) -> np.ndarray:
        """Return the borders of so many intervals by speed as shares of the path, (count + 1,) from 0 to 1."""
        return np.linspace(0.0, 1.0, count + 1) if self.spacing is None else self.spacing.borders(count)

    def of_lines(self, lines: np.ndarray) -> Self:
        """Return the same path under the shutter of some lines (lines,) of the sensor, with the same pieces.

        Lines beyond its border are those at the border, or go on (`going_on`).
        """
        found, last = copy(self), len(self.lines.peak) - 1
        asked, lines = lines, np.clip(lines, 0, last)
        if self.goes_on and last > 0:
            step_s = float(self.lines.opens_s[-1] - self.lines.opens_s[0]) / last
            found.late_s = step_s * (asked - lines)
        found.openings = tuple(
            LineTimes(
                own.axis, own.opens_s[lines], own.open_s[lines], own.closes_s[lines], own.closed_s[lines], own.peak[lines]
            )
            for own in self.openings  # of the same lines
        )
        found.lines = found._lit_span()
        return found

    def of_shift(self, surfaces: Sequence[int] = (0,)) -> Self:
        """Return the same path whose poses are the displacements x, y of surfaces in the sensor's middle [photosites].

        Where an image moves without a turn that is the way of all of its places, and means over an interval are exact.
        """
        found = copy(self)
        found.poses = np.concatenate([self._ways(surface) for surface in surfaces], axis=-1)
        return found

    def _ways(self, surface: int) -> np.ndarray:
        """Displacement of a surface in the sensor's middle at each of `times_s`, (times, 2) [photosites]."""
        return self.displacement_px[:, VIEWS * surface + MIDDLE]

    def _even_speed(self, ways: np.ndarray) -> np.ndarray | None:
        """Return the speed x, y of ways at each of `times_s`, (times, 2), that are straight and even; None: they are not."""
        come = (self.times_s - self.times_s[0])[:, None]
        speed = (ways[-1] - ways[0]) / max(float(come[-1, 0]), 1e-300)
        return speed if np.abs(ways[0] + speed * come - ways).max() <= self.straight_px else None

    @property
    def bend_px(self) -> float:
        """Largest distance of the nearest surface's way from a straight and even one between its ends [photosites]."""
        ways, come = self._ways(0), (self.times_s - self.times_s[0])[:, None]
        even = ways[0] + (ways[-1] - ways[0]) * (come / max(float(come[-1, 0]), 1e-300))
        return float(np.abs(even - ways).max())

    def shift_at(self, times_s: np.ndarray, surface: int) -> np.ndarray:
        """Return the displacement x, y of a surface in the sensor's middle at times from the release, (..., 2) [photosites]."""
        ways = self._ways(surface)
        if (speed := self._even_speed(ways)) is not None:
            return ways[0] + speed * (times_s - self.times_s[0])[..., None]
        return np.stack([np.interp(times_s, self.times_s, way) for way in ways.T], axis=-1)

    def straight_shift(self, surface: int = 0) -> tuple[np.ndarray, np.ndarray] | None:
        """Return both ends, (lines, 2) [photosites], of the way that `of_shift` goes while each line is open; None: it bends.

        It is straight where speed and light are even and the shutter opens and closes at once.
        """
        lines, ways = self.openings[0], self._ways(surface)
        if not self.is_evenly_lit:
            return None
        if (speed := self._even_speed(ways)) is None:
            return None
        began, ended = (times[:, None] - self.times_s[0] for times in (lines.opens_s, lines.closed_s))
        return ways[0] + speed * (began + self.late_s[:, None]), ways[0] + speed * (ended + self.late_s[:, None])

    def shifts(self, count: int, surfaces: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return where surfaces that move without a turn lie at so many instants of each line, and the instants' weights.

        Displacements x, y (lines, count, surfaces, 2) float64 [photosites]; weights (lines, count).
        """
        straight = [ends for surface in surfaces if (ends := self.straight_shift(surface)) is not None]
        if len(straight) < len(surfaces):
            found = self.of_shift(surfaces).instants(count)
            return found.pose_numbers.reshape(*found.weights.shape, len(surfaces), 2), found.weights
        begin, end = (np.stack(ends, axis=1)[:, None] for ends in zip(*straight, strict=True))
        borders = self.borders(count)
        shares, weights = 0.5 * (borders[1:] + borders[:-1]), np.broadcast_to(np.diff(borders), (len(begin), count))
        return begin + shares[:, None, None] * (end - begin), weights

    def _lit_span(self) -> LineTimes:
        """Return the first opening and the last closing of each line in the light, without ramps of several openings."""
        first, *others = self.openings
        if others:
            opens = np.min([one.opens_s for one in self.openings], axis=0)
            closed = np.max([one.closed_s for one in self.openings], axis=0)
            first = LineTimes(first.axis, opens, opens, closed, closed, np.ones(len(opens)))
        begin, end = (instant - self.start_s for instant in self.curve.span_s)
        edges = np.clip([first.opens_s, first.open_s, first.closes_s, first.closed_s], begin, end)
        return LineTimes(first.axis, edges[0], edges[1], edges[2], edges[3], first.peak)

    @property
    def missed_px(self) -> float:
        """Largest distance of the image from its straight pieces where they are too few to follow it; else 0 [photosites]."""
        bends = np.diff(self.displacement_px, 2, axis=0)
        return 0.0 if self.is_followed else float(np.linalg.norm(bends, axis=-1).max(initial=0.0)) / 8.0

    @property
    def farthest_px(self) -> float:
        """Largest distance of the image from that at rest, while any line is open [photosites]."""
        return float(np.linalg.norm(self.displacement_px, axis=-1).max(initial=0.0))

    @property
    def skew(self) -> Skew:
        """Way of the places seen from one line of the sensor to the next; 0 where all are open at once."""
        lines = self.lines
        if lines.is_common or len(lines.opens_s) < 2:
            return Skew()
        steps_s = [np.diff(one) for one in (lines.opens_s, lines.closed_s)]
        speeds = np.diff(self.displacement_px, axis=0).reshape(-1, 2) / float(self.times_s[1] - self.times_s[0])
        ways = np.concatenate([speeds * step_s for step_s in (np.min(steps_s), np.max(steps_s))])
        middle = 0.5 * (ways.min(axis=0) + ways.max(axis=0))
        apart, largest = (float(np.linalg.norm(one, axis=-1).max()) for one in (ways - middle, ways))
        return Skew(float(middle[0]), float(middle[1]), apart, largest, lines.axis == "rows")

    def _cumulated(self, steps: np.ndarray, times_s: np.ndarray) -> np.ndarray:
        """Sum of steps, one for each cell, up to some times."""
        return np.interp(times_s, self.times_s, np.concatenate([[0.0], np.cumsum(steps)]))

    def _reach(self, steps: np.ndarray) -> np.ndarray:
        """Sum of steps, one for each cell, while each line is open, (lines,)."""
        return self._cumulated(steps, self.lines.closed_s) - self._cumulated(steps, self.lines.opens_s)

    @property
    def length(self) -> "PathLength":
        """Length of the path while one line is open, the greatest of all lines."""
        lines, lengths = self.lines, self._reach(self.steps_px)
        effective = self._reach(self._root_steps()) ** 2 / np.maximum(lines.closed_s - lines.opens_s, 1e-300)
        longest = int(lengths.argmax())
        first, last = np.searchsorted(self.times_s, (lines.opens_s[longest], lines.closed_s[longest]))
        here = self.displacement_px[max(first - 1, 0) : last + 1]
        extent = float(np.linalg.norm(np.ptp(here, axis=0), axis=-1).max(initial=0.0))
        length = float(lengths[longest])
        passages = max(length / extent, 1.0) if extent > 0.0 else 1.0
        if self.is_evenly_lit:
            return PathLength(length, min(float(effective.max()), length), passages)
        return PathLength(length, length, passages * (PULSED if self.is_pulsed or len(self.openings) > 1 else 1.0))

    @property
    def crowding(self) -> float:
        """Most light in a time over its mean while a line is open, of the line with most; 1 where it is even."""
        if self.is_evenly_lit:
            return 1.0
        span_s = np.maximum(self.lines.closed_s - self.lines.opens_s, 1e-300)
        lit = float((self._reach(self.light * np.diff(self.times_s)) / span_s).max())
        widest = np.max([one.peak for one in self.openings], axis=0)
        opened = span_s * widest / np.maximum(np.sum([one.effective_s for one in self.openings], axis=0), 1e-300)
        return max(float(self.light.max()) / max(lit, 1e-300) * float(opened.max()), 1.0)

    @property
    def slant(self) -> float:
        """Product of the cosine and the sine of the angle of any way to the right, the largest of all, up to 1/2."""
        across, down = np.ptp(self.displacement_px, axis=0).T
        return float((across * down / np.maximum(across**2 + down**2, 1e-300)).max(initial=0.0))

    def instants_error(self, count: int, length: "PathLength", contrast: float) -> float:
        """Return the predicted error of so many instants at edges, as `instants_error`.

        It is measured where the path turns back or light jumps, unless light ends in the dark between several openings.
        """
        law = instants_error(count if self.spacing is None else count / self.spacing.excess, length, contrast)
        return (
            min(law, EDGE_MARGIN * contrast * self.edge_error(count))
            if length.passages > 1.0 and len(self.openings) == 1
            else law
        )

    def longest_places(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return displacements x, y (count, 2) [photosites] and weights (count,) of so many instants of the longest path."""
        own = self.of_lines(np.array([self._reach(self.steps_px).argmax()]))
        ways_px = np.linalg.norm(np.ptp(self.displacement_px, axis=0), axis=-1)
        own.poses = self.displacement_px[:, int(ways_px.argmax())]
        found = own.instants(count)
        return found.pose_numbers[0], found.weights[0]

    def edge_error(self, count: int) -> float:
        """Return the largest error that so many instants make at straight edges of contrast 1, wherever these lie.

        It is that of the longest path, in EDGE_DIRECTIONS directions, on a photosite's even square along the edge, beside
        EDGE_FINER times as many instants.
        """
        sampled = [self.longest_places(number) for number in (count, EDGE_FINER * count)]
        worst = 0.0
        for angle in np.arange(EDGE_DIRECTIONS) * math.pi / EDGE_DIRECTIONS:
            along = [(places @ [math.cos(angle), math.sin(angle)], weights) for places, weights in sampled]
            first = min(float(places.min()) for places, _ in along) - 1.0
            cells = int(EDGE_CELLS * (max(float(places.max()) for places, _ in along) - first + 2.0))
            few, many = (np.cumsum(_spread_over(EDGE_CELLS * (places - first), weights, cells)) for places, weights in along)
            passed = np.cumsum(few - many)
            worst = max(worst, float(np.abs(passed[EDGE_CELLS:] - passed[:-EDGE_CELLS]).max()) / EDGE_CELLS)
        return worst

    def _root_steps(self) -> np.ndarray:
        """Integral of sqrt(speed) over each cell."""
        return np.sqrt(self.steps_px * np.diff(self.times_s))

    def even_nodes(self, count: int) -> np.ndarray:
        """Return the borders of so many intervals of equal integrals of sqrt(speed), from first opening to last closing.

        (count + 1,) [s from the release].
        """
        measure = self._measure()
        return np.interp(np.linspace(0.0, measure[-1], count + 1), measure, self.times_s)

    def node_weights(self, nodes_s: np.ndarray) -> np.ndarray:
        """Return the weights of images at nodes in the light of each line, (lines, nodes) of sum 1, or 0 in the dark.

        The image is taken as linear in time between nodes, so that the mean time of a line's light is kept exactly.
        """
        edges = np.broadcast_to(nodes_s, (len(self.lines.peak), len(nodes_s)))
        sums = self._integrals(edges)[..., :2]
        light, late = sums[..., 0], (sums[..., 1] - nodes_s[:-1] * sums[..., 0]) / np.diff(nodes_s)
        weights = np.zeros(edges.shape)
        weights[:, 1:] += late
        weights[:, :-1] += light - late
        total = weights.sum(axis=1, keepdims=True)
        return weights / np.where(total > 0.0, total, 1.0)  # a line without light sees nothing

    def _measure(self) -> np.ndarray:
        """Integral of sqrt(speed) up to each of `times_s`, which also grows a little where nothing moves."""
        root = self._root_steps()
        even = np.diff(self.times_s) * (max(root.sum(), 1e-12) / (self.times_s[-1] - self.times_s[0]))
        return np.concatenate([[0.0], np.cumsum(root + 1e-6 * even)])

    def instants(self, count: int, spacing: Literal["speed", "light"] = "speed") -> Instants:
        """Return so many instants of each line, at the mean poses of their intervals.

        spacing: intervals of equal integrals of sqrt(speed), or denser at the ends (`spaced`), or of equal light, whose
        weights are all 1 / count.
        """
        lines, share = self.lines, np.linspace(0.0, 1.0, count + 1)
        opens, closed = lines.opens_s[:, None], lines.closed_s[:, None]
        if spacing == "light":
            edges = self._equal_light(share)
        elif not self.is_evenly_lit:
            edges = self._lit_borders(self.borders(count))
        else:
            measure = self._measure()
            share = self.borders(count)
            first, last = (np.interp(times, self.times_s, measure) for times in (opens, closed))
            edges = np.interp(first + (last - first) * share, measure, self.times_s)
            edges[:, 0], edges[:, -1] = opens[:, 0], closed[:, 0]
        sums = self._integrals(edges)
        light = sums[..., 0]
        total = light.sum(axis=1, keepdims=True)
        dark = light <= 1e-9 * np.where(total > 0.0, total, 1.0)
        middles = 0.5 * (edges[:, 1:] + edges[:, :-1])
        means = sums[..., 1:] / np.where(dark, 1.0, light)[..., None]
        if dark.any():  # intervals without light have no weight, but a pose
            columns = np.concatenate([self.times_s[:, None], self.poses], axis=1)
            for column, values in enumerate(columns.T):
                means[..., column][dark] = np.interp(middles[dark], self.times_s, values)
        weights = np.where(total > 0.0, light / np.where(total > 0.0, total, 1.0), 1.0 / count)
        speeds = (self.poses[-1] - self.poses[0]) / max(float(self.times_s[-1] - self.times_s[0]), 1e-300)
        poses = means[..., 1:] + speeds * self.late_s[:, None, None]
        return Instants(lines.axis, weights, self.start_s + means[..., 0] + self.late_s[:, None], poses)

    def _lit_borders(self, share: np.ndarray) -> np.ndarray:
        """Return the borders of intervals of equal sums of the shares of a line's way and of its light, (lines, borders) [s].

        share: of all of it, (borders,). The product of both shares of an interval is then at most that of even light.
        """
        found, moved = np.empty((len(self.lines.peak), len(share))), np.concatenate([[0.0], np.cumsum(self.steps_px)])
        fine = np.linspace(0.0, 1.0, FINER_BORDERS * len(share)) if self.is_pulsed else np.array([0.0, 1.0])
        for line, (opens, closed) in enumerate(zip(self.lines.opens_s, self.lines.closed_s, strict=True)):
            first, last = np.searchsorted(self.times_s, (opens, closed))
            times = np.sort(np.concatenate([opens + (closed - opens) * fine, self.times_s[first:last]]))
            clock_s, middles = self.start_s + times, 0.5 * (times[1:] + times[:-1])
            come = np.diff(self.curve.mean_integral(clock_s, clock_s)) + self.curve.steady * np.diff(clock_s)
            passing = np.zeros(len(middles))
            for own in self.openings:
                corners = [one[line] for one in (own.opens_s, own.open_s, own.closes_s, own.closed_s)]
                passing += own.peak[line] * np.interp(middles, corners, [0.0, 1.0, 1.0, 0.0])
            parts = passing * np.maximum(come, 0.0), np.diff(np.interp(times, self.times_s, moved))
            steps = 1e-6 * np.diff(times) / max(closed - opens, 1e-300)
            steps = steps + np.sum([one / max(float(one.sum()), 1e-300) for one in parts], axis=0)
            measure = np.concatenate([[0.0], np.cumsum(steps)])
            found[line] = np.interp(share * measure[-1], measure, times)
            found[line, [0, -1]] = opens, closed
        return found

    def _equal_light(self, share: np.ndarray) -> np.ndarray:
        """Return the borders of intervals of equal light on each line, (lines, borders) [s]."""
        lines, found = self.lines, []
        fine = np.linspace(0.0, 1.0, 16 * len(share))
        times = lines.opens_s[:, None] + (lines.closed_s - lines.opens_s)[:, None] * fine
        corners = [one[:, None] for own in self.openings for one in (own.open_s, own.closes_s)]
        times = np.sort(np.concatenate([times, *corners], axis=1), axis=1)
        light = np.cumsum(self._integrals(times)[..., 0], axis=1)
        for own, sums in zip(times, light, strict=True):
            sums = np.concatenate([[0.0], sums])
            found.append(np.interp(share * sums[-1], sums, own))
        return np.array(found)

    def _integrals(self, edges: np.ndarray) -> np.ndarray:
        """Integrals of light under the shutter, and of time and poses times it, between edges (lines, edges) [s].

        Returns (lines, edges - 1, 2 + numbers of poses). The shutter's trapezoid is three pieces, each linear in time.
        """
        values = np.concatenate([np.ones((len(self.times_s), 1)), self.times_s[:, None], self.poses], axis=1)
        found = np.sum([self._integrals_of(own, edges, values) for own in self.openings], axis=0)
        found[..., 0] = np.maximum(found[..., 0], 0.0)  # in the dark differences round to either side
        return found

    def _integrals_of(self, lines: LineTimes, edges: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Part of `_integrals` of one opening of each line. values: (times, values), linear between `times_s`."""
        opens, open_, closes, closed = (
            times[:, None] for times in (lines.opens_s, lines.open_s, lines.closes_s, lines.closed_s)
        )
        rises, falls = open_ - opens, closed - closes
        found = np.zeros((*np.subtract(edges.shape, (0, 1)), values.shape[1]))
        plain = self._integrals_until(values)
        flat = plain(np.clip(edges, open_, closes))
        found += lines.peak[:, None, None] * np.diff(flat, axis=1)
        if not (rises.any() or falls.any()):
            return found
        moment = self._integrals_until(values * self.times_s[:, None])
        ramps = ((opens, open_, rises, opens, 1.0), (closes, closed, falls, closed, -1.0))
        for begin, end, length, zero, sign in ramps:
            places = np.clip(edges, begin, end)
            slope = np.where(length > 0.0, sign * lines.peak[:, None] / np.where(length > 0.0, length, 1.0), 0.0)[..., None]
            found += slope * (np.diff(moment(places), axis=1) - zero[..., None] * np.diff(plain(places), axis=1))
        return found

    def _integrals_until(self, values: np.ndarray) -> LitIntegrals:
        """Integrals of values (times, values), linear between `times_s`, times light."""
        return LitIntegrals(self.times_s, values, self.curve, self.light, self.start_s)


def _spread_over(places: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Return weights at places (n,) between cells 0 to count - 1, shared between the two beside each: (count,)."""
    first = np.floor(places).astype(np.intp)
    share = places - first
    return np.bincount(first, weights * (1.0 - share), count) + np.bincount(first + 1, weights * share, count)


def needed_instants(length: PathLength, contrast: float, allowed: float, cut_off: float) -> int:
    """Return how many instants keep the error of a path below what is allowed.

    contrast: of the scene's edges over one photosite, as a share of the brightest light. allowed: error as a share of the
    brightest light, > 0. cut_off: highest frequency that is seen [cycles per photosite].
    """
    longest, contrast = length.longest_px, contrast * length.passages
    edges = math.sqrt(contrast * length.even_px / (8.0 * allowed))
    if edges < longest:  # instants may lie farther apart than photosites
        edges = min(longest, contrast / (2.0 * allowed + 0.5 * contrast / longest))
    texture = 2.0 * cut_off * longest if contrast > allowed else 0.0
    return min(max(math.ceil(max(edges, texture) - 1e-9), 1), MOST_INSTANTS)


def needed_cuts(contrast: float, allowed: float) -> int:
    """Return how many instants keep the error at borders that are seen or not below what is allowed; as `needed_instants`."""
    return min(max(math.ceil(0.5 * contrast / allowed - 1e-9), 1), MOST_INSTANTS)


def cut_error(count: int, contrast: float) -> float:
    """Return the predicted error of so many instants at borders that are seen or not, as a share of the brightest light."""
    return 0.5 * contrast / count


def instants_error(count: float, length: PathLength, contrast: float) -> float:
    """Return the predicted error of so many instants at edges, as a share of the brightest light. contrast: as above."""
    longest, passed = length.longest_px, contrast * length.passages
    if count >= (1.0 - 1e-9) * longest:
        return passed * length.even_px / (8.0 * count**2)
    return 0.5 * passed / count * (1.0 - 0.5 * count / longest)
