"""Executes planes of layers between their rows, of which a point of aperture and time reads one row."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.geometry.rows_between import PHASES, rounded_rows
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.layer_means import FILE, SPAN, Grid, row_places

BAND_BYTES = 2**25  # of the planes of the rows of a launch
MOST_ROWS, LEAST_ROWS = 128, 16
SPOTS_AT_ONCE = 2**15  # of which tables stay in the cache


class LayerRowsBetween:
    """Planes of layers with a pixel for each photosite, PHASES of them between each two rows."""

    reads, side_px, is_square = 1, 1.0, True

    def __init__(self, optics: OpticsPlan, device: Device, scene: list[Buffer]) -> None:
        """scene: for each layer a device buffer, as for `swept_mosaic`."""
        self.optics, self.device, self.scene, self.layers = optics, device, scene, optics.covering_layers
        self.plane_count = optics.channels + int(optics.has_coverage)
        self.buffers: dict[int, Buffer] = {}
        self.sizes = [0] * self.layers
        row_bytes = 4.0 * PHASES * self.layers * self.plane_count * (optics.window.width + 4 * SPAN)
        self.band_rows = int(np.clip(BAND_BYTES / row_bytes, LEAST_ROWS, MOST_ROWS))

    def grid(self, ways: np.ndarray, x: int, columns: int, rows: range, step: int) -> Grid:
        """Return the planes that rows of photosites of the sensor see, `columns` of them from column x on.

        ways: (rows or 1, points, layers, 2) x, y [photosites]. step: sets of columns in which the planes have theirs.
        """
        wide, found = step * SPAN, self._spots(ways)
        (up, down), (before, after) = ((int(one.min()), int(one.max())) for one in (found["row"], found["left"]))
        first_row, first_column = rows.start + up, x + before // wide * wide
        height, width = len(rows) + down - up, -(-(x + columns + after + 2 - first_column) // wide) * wide
        found["row"] -= first_row
        found["left"] -= first_column
        found["phase"] *= self.plane_count * height * width
        planes = [self._between(n, (first_column, width), (first_row, height), step) for n in range(self.layers)]
        return Grid(planes, width, height, found, row_places(np.zeros(len(rows))))

    def _spots(self, ways: np.ndarray) -> np.ndarray:
        """Return `struct row_spot` of ways (lines, points, layers, 2), counted from a photosite's own pixel and phase 0."""
        projection = self.optics.projection
        found = np.empty(ways.shape[:-1], declared_struct(kernel_source(FILE), "row_spot"))
        lines = max(SPOTS_AT_ONCE // max(found[0].size, 1), 1)
        for first in range(0, len(ways), lines):
            own, part = found[first : first + lines], ways[first : first + lines]
            own["row"], own["phase"] = rounded_rows(part[..., 1] + projection.offset_y)
            across = part[..., 0] + projection.offset_x
            left = np.floor(across)
            own["left"], own["past"] = left, across - left
        return found

    def _between(self, layer: int, columns: tuple[int, int], rows: tuple[int, int], step: int) -> Buffer:
        """Return rows between those of a layer, device buffer (PHASES, planes, rows, columns) float32.

        columns, rows: first of the scene, and number.
        """
        optics, colours, size = self.optics, self.optics.cfa.colors, PHASES * self.plane_count * rows[1] * columns[1]
        if size > self.sizes[layer]:
            self.sizes[layer] = size + size // 8  # bands of rows see somewhat different parts
            self.buffers[layer] = self.device.empty((self.sizes[layer],), np.float32)
        parts = [(min(colours), max(colours) + 1 - min(colours))]
        if layer + 1 < self.layers:
            parts.append((optics.channels, 1))
        for plane, planes in parts:
            self.device.run(
                self.device.kernel("rows_between", {"SPAN": SPAN, "STEP": step, "PHASES": PHASES, "BENDS": 0}),
                (columns[1] // SPAN, rows[1], planes),
                (1, 1, 1),
                planes=self.scene[layer],
                between=self.buffers[layer],
                layer={
                    "first_row": rows[0],
                    "first_column": columns[0],
                    "rows": rows[1],
                    "columns": columns[1],
                    "plane_count": self.plane_count,
                    "first_plane": plane,
                    "scene_width": optics.projection.scene_width,
                    "scene_height": optics.projection.scene_height,
                },
            )
        return self.buffers[layer]
