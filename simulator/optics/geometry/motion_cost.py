"""Predicts the time of a planned motion of the image from the work that it does.

The nanoseconds are processor time of all cores over two, of the reference machine of `simulator.pipeline.passes`.
"""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from simulator.optics.geometry.projection import Projection

if TYPE_CHECKING:
    from simulator.optics.geometry.motion_plan import MotionPlan

COST_NS = {
    "sweep launches": 7.0e5,  # of a frame that one kernel sweeps: paths and launches
    "sweep": 1.6,  # for each photosite, instant and layer
    "even sweep": 0.8,  # the same, of a scene with one pixel per photosite
    "shifting layers": 0.08,  # for each photosite, instant and plane of layers that move without a turn over such a scene
    "shift": 0.15,  # for each photosite, and photosite of a path and SHIFT_MARGIN_PX, of such a scene that moves without a turn
    "sweep by vector": 100.0,  # for each photosite and instant, where each pixel moves by itself
    "sweep by place": 2.5,  # for each photosite, instant, layer, and part of light between pixels, with PLACE more parts
    "sweep by square": 3.0,  # for each photosite, instant and layer of even squares, whose reads count beside it
    "moving launches": 3.0e6,  # of a frame whose points of the aperture carry instants: tables of points, launches
    "moving points": 0.25,  # for each photosite, point of the aperture and slab of radius
    "moving tables": 30.0,  # for each point of a cell and a layer, which the host makes
    "instant": 1.0e6,  # of each instant at which the optics run: its pose and its weights
}
SQUARE_READ, LEANING_READ = 0.11, 0.42  # of the time of a sample, for each scene pixel that it may touch
PLACE = 0.7  # parts whose time the place of a photosite takes
SHIFT_MARGIN_PX = 5.0  # by which a path counts as longer
FOUR_READ = 2.0  # times what layers that shift take, where points of aperture and time read between four pixels
TURNED, TURNED_TABLES = 4.0, 6.0  # times the work of points, and of their tables, that are bilinear over a cell
CLIPPED_TABLES = 30.0  # times that of points of a block whose pupil is clipped
DRIFTING = 1.5  # times what layers that shift take, where displacements change along a row


def sweep_cost_ms(key: str, count: float) -> float:
    """Return the predicted time of a swept frame [ms]. key: of COST_NS, by which so many units are counted."""
    return 1e-6 * (COST_NS["sweep launches"] + COST_NS[key] * count)


def place_work(projection: Projection, over: int) -> tuple[str, float]:
    """Work of one of `over` x `over` samples at a place of its own: key of COST_NS, and how many units."""
    if not projection.has_squares:
        return "sweep by place", PLACE + (-(-projection.samples // over)) ** 2
    posed = replace(projection, pose=(0.0,) * 10)
    leans = posed.has_leaning(over)
    return "sweep by square", 1.0 + (LEANING_READ if leans else SQUARE_READ) * posed.taps(1.0 / over, leans) ** 2


def row_work(projection: Projection, over: int) -> float:
    """Work of one of `over` x `over` samples of a row that is read along a span, in units of "sweep".

    Rows of even squares are blended over all pixels of the span; light between pixels is read at each sample's own place.
    """
    if projection.has_squares:
        return 0.2 + 0.7 * projection.scale / over
    return 2.5 if projection.is_bilinear else 1.0


def moving_cost_ms(points: float, tables: float) -> float:
    """Return the predicted time of points of the aperture that carry instants [ms]. points, tables: units of COST_NS."""
    return 1e-6 * (COST_NS["moving launches"] + COST_NS["moving points"] * points + COST_NS["moving tables"] * tables)


def instants_of(motion: "MotionPlan", lines: int) -> tuple[int, int]:
    """Return at how many instants the optics run, and how many of the lines each of them lights.

    Where lines open one after the other they share instants.
    """
    if motion.is_common:
        return motion.count, lines
    nodes = len(motion.shared_nodes())
    return nodes, min(math.ceil(lines * motion.even_count / nodes), lines)


def instants_cost_ms(nodes: int, each_ms: float) -> float:
    """Return the predicted time of running the optics at so many instants [ms]. each_ms: of the passes of one."""
    return (1e-6 * COST_NS["instant"] + each_ms) * nodes
