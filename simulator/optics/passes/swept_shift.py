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
    places, weights, products = _paths(optics, motion, window, over)
    kernel = device.kernel(
        "swept_shift", {**(optics.cfa_macros() if step == 2 else ANY_CFA), "SPAN": SPAN, "STEP": step, "BENDS": 0}, file=FILE
    )
    lines = len(weights)
    together = lines if lines == 1 else max(MOST_CELLS // _cells(places), 1)
    for first in range(0, lines, together):
        part = slice(first, first + together)
        taps = path_taps(places[part], weights[part], products[part])
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


def _paths(optics: OpticsPlan, motion: MotionPlan, window: Window, over: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places on the scene's grid on the way of each line, (lines or 1, places, 2) x, y; weights and products of each.

    They are those of `path_taps`. Places are counted from the pixel that has the number of the photosite, or sample, that sees
    them.
    """
    offset = np.array([optics.projection.offset_x, optics.projection.offset_y])
    own = motion.path.of_lines(motion.lines_of(window))
    if (way := own.straight_shift()) is not None:
        return straight_places(over * way[0] + offset, over * way[1] + offset)
    instants = own.of_shift().instants(max(motion.count, motion.lamp_count))
    return over * instants.pose_numbers + offset, instants.weights, np.zeros_like(instants.weights)


def straight_places(begin: np.ndarray, end: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return places on straight ways on a grid of pixels whose bilinear readings have the exact mean over the way.

    begin, end: (lines, 2) x, y [px]. Returns places (lines, places, 2), weights (lines, places), and the mean product of the
    distances in x and in y from each place over its piece of the way (lines, places). Pieces end at the lines through the
    middles of pixels: between them a reading is a quadratic function of the way, so that its mean follows from these three.
    """
    way = end - begin
    counts = [int(np.ceil(np.abs(way[:, axis]).max())) + 1 for axis in (0, 1)]
    borders, column = np.zeros((len(begin), 2 + sum(counts))), 2
    borders[:, 1] = 1.0
    for axis, count in enumerate(counts):
        own, first = way[:, axis, None], np.floor(np.minimum(begin, end)[:, axis, None]) + 1.0
        moves = np.abs(own) > 1e-9
        per_px = np.where(moves, 1.0 / np.where(moves, own, 1.0), 0.0)
        borders[:, column : column + count] = per_px * (np.arange(count) + (first - begin[:, axis, None]))
        column += count
    np.clip(borders, 0.0, 1.0, out=borders)
    borders.sort(axis=1)
    weights, middle = np.diff(borders, axis=1), 0.5 * (borders[:, 1:] + borders[:, :-1])
    return begin[:, None] + middle[..., None] * way[:, None], weights, way.prod(axis=1)[:, None] * weights**2 / 12.0


def _cells(places: np.ndarray) -> int:
    """Return how many pixels the rectangle around the path of any line holds, at most."""
    wide, high = (float(np.ptp(places[..., axis], axis=1).max()) for axis in (0, 1))
    return int((wide + 5.0) * (high + 4.0))


def path_taps(places: np.ndarray, weights: np.ndarray, products: np.ndarray | float = 0.0) -> np.ndarray:
    """Return the pixels that paths read bilinearly and their weights: (lines, taps) of `struct tap`, padded by weights of 0.

    places: (lines, instants, 2) float64 x, y on a grid of pixels. weights: (lines, instants) float64. products: of the
    distances in x and y from a place, mean of what it stands for; 0 for a single reading.
    """
    x, y = places[..., 0], places[..., 1]
    first, top = np.floor(x), np.floor(y)
    x, y = x - first, y - top
    base_x, base_y = first.min(axis=1, keepdims=True), top.min(axis=1, keepdims=True)
    first, top = first - base_x, top - base_y
    columns, rows = int(first.max()) + 3, int(top.max()) + 2  # the last column stays empty
    lines = len(places)
    cell = ((np.arange(lines)[:, None] * rows + top) * columns + first).astype(np.intp).ravel()
    below, right = weights * y, weights * x
    corner = weights * (x * y + products)
    shares = np.concatenate([weights - below - right + corner, right - corner, below - corner, corner], axis=None)
    four = np.concatenate([cell, cell + 1, cell + columns, cell + columns + 1])
    grid = np.bincount(four, shares, lines * rows * columns)
    is_read = (grid != 0.0).reshape(-1, columns)
    odd = is_read.argmax(axis=1) & 1  # pairs begin at the first pixel of a row
    is_right = (np.arange(columns) & 1).astype(bool) ^ odd.astype(bool)[:, None]
    is_left = ~is_right & is_read
    is_left[:, :-1] |= ~is_right[:, :-1] & is_read[:, 1:]
    left = np.flatnonzero(is_left)
    line, place = np.divmod(left, rows * columns)
    row, column = np.divmod(place, columns)
    struct = declared_struct(kernel_source(FILE), "tap")
    found = np.zeros(len(left), struct)
    found["row"], found["column"] = base_y[line, 0] + row, base_x[line, 0] + column
    found["left"], found["right"] = grid[left], grid[left + 1]
    held = np.bincount(line, minlength=lines)
    taps = np.zeros((lines, max(int(held.max()), 1)), struct)
    taps["row"], taps["column"] = base_y, base_x
    taps[np.arange(taps.shape[1]) < held[:, None]] = found
    return taps
