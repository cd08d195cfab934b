"""Chooses where on the sensor kernels that vary over the field are made, by what the light between these places has wrong.

Photosites get the light of the kernels of four nodes, interpolated. A spot that moves from node to node is two fainter ones
between them. The error is the second difference of the kernels, which grows as the square of the distance of the nodes.
"""

import itertools
import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from simulator.optics.psf.field_psf import FIELD_STEPS, FieldPsf
from simulator.optics.psf.fraunhofer import odd
from simulator.optics.psf.psf_table import PsfTable
from simulator.optics.psf.slab_tails import Keyed
from simulator.optics.psf.visibility import Visibility

SHARE = 0.3  # of the allowed error, for the light between nodes
HEIGHTS = (0.125, 0.875)  # field radii at which it is measured, beside those of a table
WIDEST = 0.125  # distance of a place from the nodes beside it at which it is measured first [half diagonals]
NEAREST = WIDEST / 4.0  # the same at last
FALLS = 0.35  # share of the error at twice the distance, from which on it falls as the square
CROSSED = 1.5  # times the error beside a bar along each axis, of random pixels, which have corners and edges of any way
LEAST_NODES = 3  # along an axis
MOST_MADE = 64  # kernels of a colour that are made; the others are their mirror images


def choose_nodes(psf: FieldPsf, channels: int, seen: Visibility) -> FieldPsf:
    """Return the PSF with the nodes, and the field radii of computed kernels, at which the light between them is as allowed.

    `field_error` is what it is predicted to have wrong, which is more than SHARE where MOST_MADE kernels are too few.
    seen: how that shows, in the noise of the dark, too.
    """
    if psf.nodes == (1, 1):
        return psf
    measured, error = _measured(Keyed(psf.key, psf), channels, seen)
    away = measured * math.sqrt(SHARE * seen.allowed / error) if error > 0.0 else math.inf
    away = min(away, 2.0 * WIDEST)
    while _made(nodes := _nodes(psf, away), psf.has_mirrored_nodes) > MOST_MADE:
        away *= 1.05
    half_px = math.hypot(*psf.sensor_px)  # 2 half diagonals
    apart = [side / (count - 1) / half_px for side, count in zip(psf.sensor_px[::-1], nodes, strict=True)]
    steps = max(math.ceil(0.5 / max(apart)), FIELD_STEPS)
    left = error * sum((one / measured) ** 2 for one in apart) / 2.0
    return replace(psf, nodes=nodes, field_steps=steps, field_error=left)


def _nodes(psf: FieldPsf, away: float) -> tuple[int, int]:
    """Rows and columns of nodes from which no place between two is farther than this along an axis [half diagonals]."""
    between_px = away * math.hypot(*psf.sensor_px)
    columns, rows = (max(odd(side / between_px + 1.0), LEAST_NODES) for side in psf.sensor_px)
    return rows, columns


def _made(nodes: tuple[int, int], mirrors: bool) -> int:
    """Kernels of a colour that are made for so many rows and columns."""
    return math.prod((count + 1) // 2 if mirrors else count for count in nodes)


@lru_cache(maxsize=16)
def _measured(of: Keyed, channels: int, seen: Visibility) -> tuple[float, float]:
    """Distance from the nodes along both axes [half diagonals], and the error in the middle of four, as of `own_error`.

    The distance is halved until the error is allowed, or falls as its square.
    """
    psf, away, before = of.psf, WIDEST, math.inf
    places = list(itertools.product(range(channels), _heights(psf)))
    while True:
        errors = {place: _error(psf, *place, away, seen) for place in places}
        error = max(errors.values())
        if error <= max(SHARE * seen.allowed, FALLS * before) or away <= NEAREST:
            return away, error
        places = [place for place in places if errors[place] >= 0.5 * error]
        away, before = 0.5 * away, error


def _heights(psf: FieldPsf) -> tuple[float, ...]:
    """Field radii at which the error is measured: a table may bend at its own."""
    if not isinstance(psf.lens_psf, PsfTable):
        return HEIGHTS
    inner = [float(one) for one in psf.lens_psf.fields if WIDEST <= one <= 1.0 - WIDEST]
    return (*HEIGHTS, *inner[:: max(1, -(-len(inner) // 4))])


def _error(psf: FieldPsf, channel: int, height: float, away: float, seen: Visibility) -> float:
    """Error of the mean of the kernels beside a place on the x axis, so far away along x and along y."""
    slab = int(np.argmin(np.abs(psf.radii_px)))
    here = psf.computed_kernel(slab, channel, (height, 0.0))
    error = 0.0
    for x, y in ((away, 0.0), (0.0, away)):
        ends = [psf.computed_kernel(slab, channel, (height + way * x, way * y)) for way in (-1, 1)]
        error += CROSSED * seen.own_error(0.5 * (ends[0] + ends[1]) - here, here)
    return error
