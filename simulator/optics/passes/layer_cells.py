"""Executes the exact means of layers that shift apart, at photosites that an edge of a layer crosses."""

import math
from collections.abc import Sequence

import numpy as np

from simulator.device import Buffer, Device, Kernel
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.mixed_edges import SPAN, WIDE, crossed_spans
from simulator.optics.geometry.projection import ANY_CFA
from simulator.optics.optics_plan import MOST_SHIFTED_LAYERS, SAME_SCALE, OpticsPlan
from simulator.optics.passes.swept_layers import Find, Places
from simulator.sensor.camera.camera_sections import Window

FILE = "layer_cells.cl"
BAND_CELLS = 2**17  # of the table of a launch: lines times instants
LEAST_PART = 1e-7  # of a photosite's side that is no pixel more


def cells_mosaic(
    optics: OpticsPlan, find: Find, count: int, device: Device, planes: list[Buffer], means: Buffer | None
) -> Buffer:
    """Return the mosaic (height, width) float32 of layers that shift apart, exactly where an edge of one crosses photosites.

    find, count: places of the layers, and how many each line has. planes: as of `swept_mosaic`. means: composited means over
    photosites, which are overwritten where an edge crosses; None: all photosites are computed.
    """
    window, colors = optics.window, optics.cfa.colors
    found = device.empty((window.height, window.width), np.float32) if means is None else means
    cells = _Cells(optics, find, count, device, planes, window, 1, 2 if len(colors) > 1 else 1, means is None)
    cells.write(found, colors[:1])
    return found


def cells_planes(
    optics: OpticsPlan,
    find: Find,
    count: int,
    device: Device,
    planes: list[Buffer],
    window: Window,
    over: int,
    means: Buffer | None,
) -> Buffer:
    """Return planes (channels, over * height, over * width) as of `swept_planes`, else as `cells_mosaic`."""
    channels = optics.channels
    shape = channels, over * window.height, over * window.width
    found = device.empty(shape, np.float32) if means is None else means
    _Cells(optics, find, count, device, planes, window, over, 1, means is None).write(found, range(channels))
    return found


class _Cells:
    """Exact means of spans of a window, `over` samples per photosite and axis. step: from a photosite of a span to the next."""

    def __init__(
        self,
        optics: OpticsPlan,
        find: Find,
        count: int,
        device: Device,
        planes: list[Buffer],
        window: Window,
        over: int,
        step: int,
        is_everywhere: bool,
    ) -> None:
        self.optics, self.device, self.scene, self.window, self.over, self.step = optics, device, planes, window, over, step
        self.find, self.band_rows = find, max(BAND_CELLS // count, 1)
        self.projection, self.layers = optics.projection, optics.covering_layers
        self.scale = self.projection.scale / over
        is_square = self.projection.has_squares if over == 1 else self.projection.nearest or self.scale > 1.0 + SAME_SCALE
        self.side_px = self.scale * (self.projection.open_side if over == 1 else 1.0) if is_square else 1.0
        self.is_everywhere = is_everywhere

    def write(self, found: Buffer, colours: Sequence[int]) -> None:
        """Write one plane for each of some colours."""
        window, kernel = self.window, self._kernel()
        for first in range(0, window.height, self.band_rows):
            band = Window(window.x, window.y + first, window.width, min(self.band_rows, window.height - first))
            places = self.find(band)
            spans = self._spans(band, places)
            if not len(spans):
                continue
            cells = self._cells(places)
            buffers = {"instants": self.device.upload(cells), "spans": self.device.upload(spans), "mosaic": found}
            for number, colour in enumerate(colours):
                frame = self._frame(band, places, number, colour)
                surfaces = {f"layer_{n}": self.scene[min(n, self.layers - 1)] for n in range(MOST_SHIFTED_LAYERS)}
                self.device.run(kernel, (len(spans),), (1,), **surfaces, **buffers, frame=frame)
            self.device.finish()  # the tables are freed on return

    def _kernel(self) -> Kernel:
        reach = math.ceil(self.side_px - LEAST_PART) + 1
        line = math.floor(1.0 + self.step * self.scale * (SPAN - 1)) + reach + 1
        sizes = {"SPAN": SPAN, "STEP": self.step, "WIDTH": reach, "HEIGHT": reach, "LINE": line}
        sizes["WHOLE"] = round(self.step * self.scale) if self.scale == round(self.scale) else 0
        filter_ = self.optics.cfa_macros() if self.step == 2 else ANY_CFA
        layers = {"LAYERS": self.layers, "CHANNELS": self.optics.channels}
        return self.device.kernel("layer_cells", {**filter_, **layers, **sizes, "OVER": 1, "BENDS": 0}, file=FILE)

    def _frame(self, band: Window, places: Places, number: int, colour: int) -> dict[str, object]:
        projection, over, window = self.projection, self.over, self.window
        numbers = np.array([self.scale, projection.offset_x, projection.offset_y])
        return {
            "origin_x": over * window.x,
            "origin_y": over * window.y,
            "width": over * window.width,
            "mosaic_row": number * over * window.height,
            "colour": colour,
            "instants": places.ways.shape[1],
            "lines": len(places.ways),
            "first_row": over * (band.y - places.above),
            "line_rows": over * places.rows,
            "scene_width": projection.scene_width,
            "scene_height": projection.scene_height,
            "scale": self.scale,
            "offset_x": projection.offset_x,
            "offset_y": projection.offset_y,
            "rests": (numbers - numbers.astype(np.float32)).astype(np.float32),
            "inset": 0.5 * (self.scale - self.side_px),
            "side": self.side_px,
        }

    def _spans(self, band: Window, places: Places) -> np.ndarray:
        """Spans of rows of photosites, or of samples, in which an edge of a layer lies at any instant: (spans,) struct span."""
        over, step = self.over, self.step
        rows = np.arange(over * band.y, over * (band.y + band.height))
        columns = np.arange(over * band.x // WIDE * WIDE, over * (band.x + band.width), WIDE)
        crossed = np.ones((len(rows), len(columns)), bool)
        if not self.is_everywhere:
            least, most = (choose(places.ways, axis=1) for choose in (np.min, np.max))
            if len(least) > 1:
                line = (rows - over * (band.y - places.above)) // (over * places.rows)
                least, most = least[line], most[line]
            crossed = crossed_spans(self.optics.layer_edges, self.optics.projection, least, most, rows, columns, over)
        row, column = np.nonzero(crossed)
        begins = np.arange(2) * (1 if step == 2 else SPAN)
        found = np.zeros((len(row), 2), declared_struct(kernel_source(FILE), "span"))
        found["row"] = rows[row][:, None]
        found["column"] = columns[column][:, None] + begins
        return found.ravel()

    def _cells(self, places: Places) -> np.ndarray:
        """Table of the kernel, (lines, instants) struct cells."""
        ways = self.projection.scale * places.ways
        found = np.zeros(ways.shape[:2], declared_struct(kernel_source(FILE), "cells"))
        own = np.floor(ways[:, :, -1])
        for axis, (pixel, past, begins, numbers) in enumerate(
            (("column", "right", "across", "left"), ("row", "down", "below", "above"))
        ):
            found[pixel], found[past] = own[..., axis], ways[:, :, -1, axis] - own[..., axis]
            apart = ways[..., axis] - ways[:, :, -1:, axis]
            whole = np.floor(apart)
            border = 1.0 - (apart - whole)  # of the next pixel of each layer, within one of the last layer
            cuts = np.sort(np.where(border >= 1.0, 0.0, border), axis=-1)
            found[begins][..., : self.layers] = cuts
            found[begins][..., self.layers :] = 1.0
            for cell in range(self.layers):
                is_next = border <= cuts[..., cell, None]
                for layer in range(self.layers):
                    found[numbers][..., 4 * cell + layer] = whole[..., layer] + is_next[..., layer]
        found["weight"] = places.weights / self.side_px**2
        return found
