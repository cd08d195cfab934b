"""Executes the means of layers that shift apart over the width of photosites, in scenes of another scale."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.geometry.layer_phases import LayerPhases, reads_of, shares_along
from simulator.optics.optics_plan import OpticsPlan

SPAN, ROWS = 64, 8  # columns and rows of a work-item of kernels/layer_phases.cl
BAND_BYTES = 2**24  # of the means of a launch
LEAST_ROWS = 32


@dataclass(frozen=True)
class Grid:
    """Planes of each layer that a launch reads, their size [px], and the places of layers at instants of its lines.

    spots: (lines or 1, instants, layers) of `struct spot`, counted from the pixel with the photosite's own number.
    """

    planes: list[Buffer]
    width: int
    height: int
    spots: np.ndarray


def spots_of(places: np.ndarray) -> np.ndarray:
    """Return the places (...) of layers that are read between four pixels, at `places` (..., 2) x, y of the left upper one."""
    pixels = np.floor(places)
    past = places - pixels
    found = np.zeros(places.shape[:-1], declared_struct(kernel_source("swept_layers.cl"), "spot"))
    found["left"], found["row"] = pixels[..., 0], pixels[..., 1]
    found["right"], found["past"] = found["left"] + 1, past[..., 0]
    found["shares"][..., 0], found["shares"][..., 1] = 1.0 - past[..., 1], past[..., 1]
    return found


class LayerMeans:
    """Means of the rows of layers at the places between photosites that are planned."""

    def __init__(self, optics: OpticsPlan, phases: LayerPhases, device: Device, scene: list[Buffer], side: float) -> None:
        """scene: for each layer a device buffer, as for `swept_mosaic`. side: of a photosite's open part [photosites]."""
        self.optics, self.phases, self.device, self.scene = optics, phases, device, scene
        self.side_px = side * optics.projection.scale
        self.reads = reads_of(optics.projection, self.side_px)
        self.plane_count = optics.channels + int(optics.has_coverage)
        kept = sum(one.count for one in phases.layers) * self.plane_count
        row_bytes = 4.0 * kept * optics.projection.scale * (optics.window.width + 4 * SPAN)
        self.buffers: dict[int, Buffer] = {}
        self.sizes = [0] * len(phases.layers)
        self.band_rows = max(int(BAND_BYTES / row_bytes), LEAST_ROWS)

    def grid(self, ways: np.ndarray, x: int, columns: int, rows: range, step: int) -> Grid:
        """Return the means that rows of photosites of the sensor see, `columns` of them from column x on.

        ways: (rows or 1, instants, layers, 2) x, y [photosites]. step: sets of columns in which the planes have theirs.
        """
        projection, layers = self.optics.projection, len(self.phases.layers)
        down = np.array(rows)[:, None, None] + 0.5 + ways[..., 1]
        first, shares = shares_along(projection, projection.offset_y + projection.scale * down, self.side_px)
        begin = int(np.clip(first.min(), 0, projection.scene_height - 1))
        height = int(np.clip(first.max() + self.reads, begin + 1, projection.scene_height)) - begin
        numbers = [one.beside(ways[..., n, 0]) for n, one in enumerate(self.phases.layers)]
        split = [(one.split(left), one.split(right)) for one, (left, right, _) in zip(self.phases.layers, numbers, strict=True)]
        shifts = [pixels for pair in split for _, pixels in pair]
        aside = min(int(one.min()) for one in shifts)
        width = -(-(columns + max(int(one.max()) for one in shifts) - aside) // SPAN) * SPAN
        found = np.zeros(first.shape, declared_struct(kernel_source("swept_layers.cl"), "spot"))
        found["row"] = first - begin - np.array(rows)[:, None, None]
        found["shares"][..., : self.reads] = shares
        for n, (left, right) in enumerate(split):
            for name, (phase, pixels) in (("left", left), ("right", right)):
                found[name][..., n] = pixels - aside - x
                found[f"{name}_phase"][..., n] = phase * (self.plane_count * height * width)
            found["past"][..., n] = numbers[n][2]
        planes = [self._means(n, x + aside, width, begin, height, step) for n in range(layers)]
        return Grid(planes, width, height, found)

    def _buffer(self, layer: int, size: int) -> Buffer:
        """Buffer of a layer for so many means, the same one for all bands of rows if they fit."""
        if size > self.sizes[layer]:
            self.buffers[layer], self.sizes[layer] = self.device.empty((size,), np.float32), size
        return self.buffers[layer]

    def _means(self, layer: int, x: int, width: int, first_row: int, height: int, step: int) -> Buffer:
        """Means of a layer: device buffer (phases, planes, height, width) float32, from column x of the sensor on."""
        optics, projection, phases = self.optics, self.optics.projection, self.phases.layers[layer]
        places = phases.start_px + phases.step_px * np.arange(phases.count)
        middles = projection.offset_x + projection.scale * (x + np.arange(width) + 0.5 + places[:, None])
        first, shares = shares_along(projection, middles, self.side_px)
        pixels = np.clip(first[:, None] + np.arange(self.reads)[:, None], 0, projection.scene_width - 1)
        tables = self.device.upload(pixels.astype(np.int32)), self.device.upload(np.moveaxis(shares, -1, 1).astype(np.float32))
        means = self._buffer(layer, phases.count * self.plane_count * height * width)
        kernel = self.device.kernel("layer_phases", {"SPAN": SPAN, "ROWS": ROWS, "READS": self.reads, "STEP": step})
        colours = optics.cfa.colors
        parts = [(min(colours), max(colours) + 1 - min(colours))]
        if layer + 1 < len(self.phases.layers):
            parts.append((optics.channels, 1))
        for plane, count in parts:
            self.device.run(
                kernel,
                (width // SPAN, math.ceil(height / ROWS), count * phases.count),
                (1, 1, 1),
                planes=self.scene[layer],
                pixels=tables[0],
                shares=tables[1],
                means=means,
                phases={
                    "first_row": first_row,
                    "rows": height,
                    "columns": width,
                    "plane_count": self.plane_count,
                    "first_plane": plane,
                    "planes_written": count,
                    "scene_width": projection.scene_width,
                    "scene_height": projection.scene_height,
                },
            )
        self.device.finish()  # the tables are freed on return
        return means
