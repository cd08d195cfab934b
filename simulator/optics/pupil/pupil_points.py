"""Points of the pupil at many fields at once."""

import math
from functools import reduce

import numpy as np

from simulator.optics.pupil.convex_area import disk_span
from simulator.optics.pupil.pupil import Pupil

STRIPS = 512  # rows across each pupil: they give positions to 1e-4 except at the corners of blades


def points_of(pupil: Pupil, fields: np.ndarray, square: np.ndarray) -> np.ndarray:
    """Points (count, 2) of the unit square as `Pupil.map_unit_square` maps them, for many fields (n, 2): (n, count, 2) float64.

    The pupil is open at each of the fields.
    """
    rows, left, widths = _spans_of(pupil, fields)
    pieces = 0.5 * (widths[:, 1:] + widths[:, :-1]) * np.diff(rows, axis=1)
    areas = np.concatenate([np.zeros((len(fields), 1)), np.cumsum(pieces, axis=1)], axis=1)
    points = np.empty((len(fields), len(square), 2))
    chosen, across = square.T
    for own, row, start, width, area in zip(points, rows, left, widths, areas, strict=True):
        own[:, 1] = np.interp(chosen * area[-1], area, row)
        own[:, 0] = np.interp(own[:, 1], row, start) + across * np.interp(own[:, 1], row, width)
    return points


def _spans_of(pupil: Pupil, fields: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows across the pupil at each field, their left ends and their widths: (n, STRIPS) each."""
    x, y = fields[:, :1], fields[:, 1:]
    low, high, number = np.full((len(fields), 1), -2.0), np.full((len(fields), 1), 2.0), np.arange(STRIPS)
    rows = left = right = np.empty(0)
    first = last = np.empty(0, np.intp)
    for _ in range(3):
        rows = 0.5 * (low + high) - 0.5 * (high - low) * np.cos(np.linspace(0.0, math.pi, STRIPS))
        ends = [part.span(rows) for part in pupil.opening]
        ends += [disk_span(stop.shift * x, stop.shift * y, stop.radius, rows) for stop in pupil.stops]
        left, right = reduce(np.maximum, (end[0] for end in ends)), reduce(np.minimum, (end[1] for end in ends))
        is_open = right > left
        first, last = is_open.argmax(axis=1)[:, None], STRIPS - 1 - is_open[:, ::-1].argmax(axis=1)[:, None]
        borders = np.maximum(first - 1, 0), np.minimum(last + 1, STRIPS - 1)
        low, high = (np.take_along_axis(rows, border, axis=1) for border in borders)
    left = np.take_along_axis(left, np.clip(number, first, last), axis=1)
    return rows, left, np.where((number < first) | (number > last), 0.0, right - left)
