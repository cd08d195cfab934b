"""Places between photosites at which rows of layers that shift apart are averaged once, in scenes of any scale.

A photosite's mean along a row, over where it lies, is a chain of straight lines where the scene's pixels are even squares: it
bends where a side of the photosite passes from one pixel to the next. Read between two places that lie `step_px` apart, an edge
of contrast C is wrong by at most C step / 4 at an instant where the bend lies between the two. Where light is bilinear between
pixels, the mean is smooth, and wrong by at most C step^2 / 8 while the edge lies in the photosite. Neither is wrong where all
bends lie at the places. The share of the instants for which that holds is counted along the path.
"""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.geometry.instants import instants_error
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import Projection

LEAST_SCALE, MOST_SCALE = 0.25, 4.0  # scene pixels per photosite and axis
STEPS = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24)  # between photosites, or of a way that is shorter than one
FINER = (
    1.0,
    1.15,
    1.3,
    1.5,
    1.75,
    2.0,
    2.5,
)  # more instants than planned, which make up for the error of reading between places
ROUNDED = 1e-9  # part of a number by which it differs as rounded
SHORTEST_PX = 1e-6  # of a way that is none [photosites]
READ_NS = 0.13  # of a row and plane at an instant
PIXEL_NS, MEAN_NS = 0.7, 1.0  # of a pixel and of a mean of a row of a plane
PLANE_NS, SWEEP_NS = 0.2, 4.0  # of a plane at an instant: with a pixel for each photosite; swept by itself


@dataclass(frozen=True)
class Phases:
    """Places at which a layer's rows are averaged: start_px + number * step_px right of each photosite [photosites].

    count: of places. per_photosite: of those before the next photosite's; 0: all that are needed lie between its own.
    """

    start_px: float = 0.0
    step_px: float = 1.0
    count: int = 1
    per_photosite: int = 0

    def beside(self, ways_px: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return numbers of the two places beside ways, which go on from photosite to photosite, and how far between them."""
        place = (ways_px - self.start_px) / self.step_px
        number = np.floor(place)
        if not self.per_photosite:
            number = np.clip(number, 0, max(self.count - 2, 0))
            return number.astype(np.intp), np.minimum(number + 1, self.count - 1).astype(np.intp), place - number
        return number.astype(np.intp), number.astype(np.intp) + 1, place - number

    def split(self, number: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the phase, and by how many photosites to the right, of places by their numbers."""
        if not self.per_photosite:
            return number, np.zeros_like(number)
        return number % self.per_photosite, number // self.per_photosite


@dataclass(frozen=True)
class LayerPhases:
    """Places of each layer, nearest first, and how many instants then keep the planned error.

    work: of a planned instant and plane, in units of that of a scene with a pixel for each photosite.
    """

    layers: tuple[Phases, ...]
    instants: int
    work: float


def reads_of(projection: Projection, side_px: float) -> int:
    """Most scene pixels that a photosite of this open side [px] touches on an axis."""
    return math.ceil(side_px - 1e-4) + 1 if projection.has_squares else 3


def shares_along(projection: Projection, middles_px: np.ndarray, side_px: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the first pixel that photosites around places on an axis touch (...), and the shares of all (..., reads).

    side_px: of the photosite's open part, in the scene [px]. Shares are those of kernels/photosite_area.h, in float64.
    """
    if projection.has_squares:
        low = middles_px - 0.5 * side_px
        first = np.floor(low)
        begins = first[..., None] + np.arange(reads_of(projection, side_px))
        high = np.minimum(begins + 1.0, (low + side_px)[..., None])
        return first.astype(np.intp), np.maximum(high - np.maximum(begins, low[..., None]), 0.0) / side_px
    own = np.floor(middles_px)
    past = middles_px - own - 0.5
    bend = np.maximum(0.5 * side_px - np.abs(past), 0.0) ** 2 / (2.0 * side_px)
    before, after = np.maximum(-past, 0.0) + bend, np.maximum(past, 0.0) + bend
    return own.astype(np.intp) - 1, np.stack([before, 1.0 - before - after, after], axis=-1)


def plan_phases(plan: MotionPlan, projection: Projection, layers: int, moving: int, planes: int) -> LayerPhases | None:
    """Plan the places at which layers are averaged so that the predicted error of a motion holds; None: none are worth it.

    projection: without distortion, whose light is either of even squares or bilinear. moving: first layers that do not rest.
    planes: of a layer's light and coverage.
    """
    scale, path = projection.scale, plan.path
    allowed = _at_edges(plan, min(plan.edge_count or plan.count, plan.count))
    last = len(path.lines.peak) - 1
    lines = np.unique(np.array([0, last // 2, last])) if not plan.is_common else np.zeros(1, np.intp)
    own = path.of_lines(lines)
    spans_px = [np.ptp(path.shift_at(path.times_s, layer)[:, 0]) for layer in range(layers)]
    starts_px = [float(path.shift_at(path.times_s, layer)[:, 0].min()) for layer in range(layers)]
    read = 2 * moving - (moving == layers)  # planes of light and coverage, at each instant
    best, best_ns = None, SWEEP_NS * plan.count * read
    for finer in FINER:
        count = math.ceil(finer * plan.count)
        ways_px, weights = own.shifts(count, range(layers))
        rest = max(allowed - _at_edges(plan, count), 1e-9)
        read_ns = READ_NS * count * read * reads_of(projection, scale)
        for steps in STEPS:
            phases = tuple(
                _phases(steps, spans_px[layer] if layer < moving else 0.0, starts_px[layer], plan.is_common, projection)
                for layer in range(layers)
            )
            cost_ns = read_ns + scale * planes * sum(_row_ns(one, projection) for one in phases)
            if cost_ns >= best_ns:
                break
            ways_of = ((phases[n], ways_px[:, :, n, 0]) for n in range(moving))
            if all(_error(one, ways, weights, projection, rest) <= rest for one, ways in ways_of):
                best, best_ns = LayerPhases(phases, count, cost_ns / (PLANE_NS * plan.count * read)), cost_ns
                break
    return best


def _at_edges(plan: MotionPlan, count: int) -> float:
    """Return the largest error of so many instants at edges of contrast 1, measured where the path turns back."""
    turns_back = plan.length.passages > 1.0 + ROUNDED
    return plan.path.instants_error(count, plan.length, 1.0) if turns_back else instants_error(count, plan.length, 1.0)


def _row_ns(phases: Phases, projection: Projection) -> float:
    """Return the time of the means of a row of a plane at all places of a photosite [ns]."""
    slots = projection.scale * (phases.count - 1) * phases.step_px + reads_of(projection, projection.scale)
    return PIXEL_NS * slots + MEAN_NS * phases.count


def _phases(steps: int, span_px: float, start_px: float, is_common: bool, projection: Projection) -> Phases:
    """Return `steps` places per photosite; or, of a way within one, steps between its ends."""
    if span_px < SHORTEST_PX:
        return Phases(start_px)
    if is_common and span_px < 1.0:
        return Phases(start_px, span_px / steps, steps + 1)
    on_pixel = (math.ceil(projection.offset_x) - projection.offset_x) / projection.scale
    return Phases(on_pixel, 1.0 / steps, steps, steps)


def _error(phases: Phases, ways_px: np.ndarray, weights: np.ndarray, projection: Projection, allowed: float) -> float:
    """Return the largest error at edges of contrast 1 of reading a layer between places, or any that exceeds `allowed`.

    ways_px, weights: (lines, instants), displacement to the right and share of the light.
    """
    is_square, side = projection.has_squares, projection.open_side
    if phases.count == 1 and not phases.per_photosite:
        return 0.0
    per_step = phases.step_px * projection.scale
    has_bends_at_places = phases.per_photosite > 0 and side == 1.0 and abs(1.0 / per_step - round(1.0 / per_step)) < ROUNDED
    if is_square and has_bends_at_places:
        return 0.0
    half, each = 0.5 * (phases.step_px if is_square else 1.0), 0.25 * phases.step_px if is_square else 0.125 * phases.step_px**2
    worst = float(weights.max())  # of one instant
    if worst * each / side > allowed:
        return worst * each / side
    for ways, shares in zip(ways_px, weights, strict=True):  # a bend, or an edge, lies where one of the instants sees it
        apart = np.abs(ways[:, None] - ways[None, :]) / half
        seen = np.maximum(1.0 - apart, 0.0) if is_square else (apart <= 2.0) & (ways[:, None] <= ways[None, :])
        worst = max(worst, float((seen @ shares).max()))
    return worst * each / side
