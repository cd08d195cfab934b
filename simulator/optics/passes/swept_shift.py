"""Executes the motion of a sharp picture that shifts as a whole: a convolution with the weights of its path."""

from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.projection import ANY_CFA
from simulator.optics.optics_plan import OpticsPlan
from simulator.sensor.camera.camera_sections import Window

SPAN = 64  # photosites of a row and colour of a work-item
FILE = "swept_shift.cl"
MOST_CELLS = 2**21  # pixels around the paths of the lines of a launch, whose weights are found together


def shift_mosaic(optics: OpticsPlan, motion: MotionPlan, device: Device, plane: Buffer) -> Buffer:
    """Device buffer (height, width) float32: `swept_mosaic` of a picture for which `OpticsPlan.sweeps_shift` holds."""
    window = optics.window
    mosaic = device.empty((window.height, window.width), np.float32)
    colors = optics.cfa.colors
    if len(colors) > 1:
        _sweep(optics, motion, device, plane, mosaic, window, 1, 2, (0,))
    else:
        _sweep(optics, motion, device, plane, mosaic, window, 1, 1, colors)
    return mosaic


def shift_planes(optics: OpticsPlan, motion: MotionPlan, device: Device, plane: Buffer, window: Window, over: int) -> Buffer:
    """Device buffer (channels, over * height, over * width) float32: `swept_planes` of such a picture."""
    found = device.empty((optics.channels, over * window.height, over * window.width), np.float32)
    _sweep(optics, motion, device, plane, found, window, over, 1, range(optics.channels))
    return found


def _sweep(
    optics: OpticsPlan,
    motion: MotionPlan,
    device: Device,
    plane: Buffer,
    mosaic: Buffer,
    window: Window,
    over: int,
    step: int,
    colours: Sequence[int],
) -> None:
    """Write the swept light of a window, `over` samples per photosite and axis, one plane for each of some colours.

    step: columns from one photosite of a span to the next; 2: all colours of a filter in one plane.
    """
    x, y, width, rows, wide = over * window.x, over * window.y, over * window.width, over * window.height, step * SPAN
    aligned = x // wide * wide
    spans = -(-(x + width - aligned) // wide)
    places, weights = _paths(optics, motion, window, over)
    kernel = device.kernel(
        "swept_shift", {**(optics.cfa_macros() if step == 2 else ANY_CFA), "SPAN": SPAN, "STEP": step, "BENDS": 0}, file=FILE
    )
    lines = len(weights)
    together = lines if lines == 1 else max(MOST_CELLS // _cells(places), 1)
    for first in range(0, lines, together):
        part = slice(first, first + together)
        taps = path_taps(places[part], weights[part])
        count = rows if lines == 1 else over * len(taps)
        held = device.upload(taps)
        for number, colour in enumerate(colours):
            device.run(
                kernel,
                (spans, step * count),
                (spans, 1),
                planes=plane,
                taps=held,
                mosaic=mosaic,
                shift={
                    "origin_x": x,
                    "origin_y": y,
                    "width": width,
                    "first_column": aligned - x,
                    "first_row": over * first,
                    "mosaic_row": number * rows,
                    "colour": colour,
                    "tap_count": taps.shape[1],
                    "lines": len(taps),
                    "over": over,
                    "scene_width": optics.projection.scene_width,
                    "scene_height": optics.projection.scene_height,
                },
            )
    device.finish()  # the tables are freed on return


def _paths(optics: OpticsPlan, motion: MotionPlan, window: Window, over: int) -> tuple[np.ndarray, np.ndarray]:
    """Return places on the scene's grid on the way of each line, (lines or 1, places, 2) x, y, and their weights.

    Places are counted from the pixel that has the number of the photosite, or sample, that sees them.
    """
    offset, path = np.array([optics.projection.offset_x, optics.projection.offset_y]), motion.path
    lines = np.zeros(1, np.intp)
    if path.lines.axis == "rows" and not motion.is_common:
        lines = np.clip(np.arange(window.y, window.y + window.height), 0, len(path.lines.peak) - 1)
    own = path.of_lines(lines)
    if (way := own.straight_shift()) is not None:
        return straight_places(over * way[0] + offset, over * way[1] + offset)
    instants = own.of_shift().instants(max(motion.count, motion.lamp_count))
    return over * instants.pose_numbers + offset, instants.weights


def straight_places(begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return places on straight ways on a grid of pixels whose bilinear readings have the exact mean over the way, and weights.

    begin, end: (lines, 2) x, y [px]. Places are (lines, places, 2), weights (lines, places). Between the lines through the
    middles of pixels a reading is a quadratic function of the way, whose mean two places give (Gauss).
    """
    way, borders = end - begin, [np.zeros((len(begin), 1)), np.ones((len(begin), 1))]
    for axis in (0, 1):
        own, first = way[:, axis, None], np.floor(np.minimum(begin, end)[:, axis, None]) + 1.0
        crossed = first + np.arange(int(np.ceil(np.abs(own).max())) + 1)
        shares = np.divide(crossed - begin[:, axis, None], own, out=np.zeros(crossed.shape), where=np.abs(own) > 1e-9)
        borders.append(np.clip(shares, 0.0, 1.0))
    shares = np.sort(np.concatenate(borders, axis=1), axis=1)
    middle, half = 0.5 * (shares[:, 1:] + shares[:, :-1]), 0.5 * np.diff(shares, axis=1)
    nodes = np.concatenate([middle - half / np.sqrt(3.0), middle + half / np.sqrt(3.0)], axis=1)
    return begin[:, None] + nodes[..., None] * way[:, None], np.concatenate([half, half], axis=1)


def _cells(places: np.ndarray) -> int:
    """Return how many pixels the rectangle around the path of any line holds, at most."""
    wide, high = (float(np.ptp(places[..., axis], axis=1).max()) for axis in (0, 1))
    return int((wide + 5.0) * (high + 4.0))


def path_taps(places: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the pixels that paths read bilinearly and their weights: (lines, taps) of `struct tap`, padded by weights of 0.

    places: (lines, instants, 2) float64 x, y on a grid of pixels. weights: (lines, instants) float64.
    """
    x, y = np.moveaxis(places, -1, 0).copy()
    first, top = np.floor(x), np.floor(y)
    x, y = x - first, y - top
    base_x, base_y = first.min(axis=1, keepdims=True), top.min(axis=1, keepdims=True)
    first, top = first - base_x, top - base_y
    columns, rows = 2 * (int(first.max()) // 2 + 1) + 2, int(top.max()) + 2
    lines = len(places)
    cell = ((np.arange(lines)[:, None] * rows + top) * columns + first).astype(np.intp).ravel()
    below, right = weights * y, weights * x
    corner = below * x
    grid = np.zeros(lines * rows * columns)
    for step, share in (
        (columns + 1, corner),
        (columns, below - corner),
        (1, right - corner),
        (0, weights - below - right + corner),
    ):
        grid[step:] += np.bincount(cell, share.ravel(), len(grid))[: len(grid) - step]
    pairs = grid.reshape(lines, rows, columns // 2, 2)
    line, row, column = np.nonzero((pairs[..., 0] != 0.0) | (pairs[..., 1] != 0.0))
    held = np.bincount(line, minlength=lines)
    place = np.arange(len(line)) - (np.cumsum(held) - held)[line]
    taps = np.zeros((lines, max(int(held.max()), 1)), declared_struct(kernel_source(FILE), "tap"))
    taps["column"], taps["row"] = base_x, base_y
    taps["column"][line, place] += 2 * column
    taps["row"][line, place] += row
    taps["left"][line, place], taps["right"][line, place] = pairs[line, row, column].T
    return taps
