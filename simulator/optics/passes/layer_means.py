"""Executes the means of layers that shift apart over the width of photosites, in scenes of another scale."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.geometry.layer_phases import LayerPhases, reads_of, shares_along
from simulator.optics.optics_plan import OpticsPlan

SPAN, ROWS = 64, 8  # columns and rows of a work-item of kernels/layer_phases.cl
ALIGNED = 16  # columns of which tables begin at multiples, which bands of rows then share
BAND_BYTES, MOST_BYTES = 2**25, 2**27  # of the means of a launch: where these are many rows; where they are few
LEAST_ROWS, MANY_ROWS = 32, 128
FILE = "swept_layers.cl"


@dataclass(frozen=True)
class Grid:
    """Planes of each layer that a launch reads, their size [px], and the places of layers at instants of its lines.

    spots: (lines or 1, instants, layers) of `struct spot`, counted from the pixel with the photosite's own number, or from
    places: (rows,) of `struct row_place`, where photosites of the launch's rows see the scene at rest, if a pixel is none.
    """

    planes: list[Buffer]
    width: int
    height: int
    spots: np.ndarray
    places: np.ndarray


def row_places(places: np.ndarray) -> np.ndarray:
    """Return places (...) down the scene [px] as `struct row_place`."""
    found = np.zeros(places.shape, declared_struct(kernel_source(FILE), "row_place"))
    found["row"] = np.floor(places)
    found["below"] = places - found["row"]
    return found


def spots_of(places: np.ndarray) -> np.ndarray:
    """Return the places (...) of layers that are read between four pixels, at `places` (..., 2) x, y of the left upper one."""
    pixels = np.floor(places)
    past = places - pixels
    found = np.zeros(places.shape[:-1], declared_struct(kernel_source(FILE), "spot"))
    found["left"], found["row"] = pixels[..., 0], pixels[..., 1]
    found["right"], found["past"], found["below"] = found["left"] + 1, past[..., 0], past[..., 1]
    return found


@dataclass(frozen=True)
class _Tables:
    """Arguments of kernels/layer_phases.cl on the device, and its macros."""

    buffers: dict[str, Buffer]
    defines: dict[str, object]


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
        self.kept: dict[tuple[int, int, int], _Tables] = {}
        self.band_rows = max(int(BAND_BYTES / row_bytes), min(int(MOST_BYTES / row_bytes), MANY_ROWS), LEAST_ROWS)

    @property
    def is_square(self) -> bool:
        """Whether the scene's pixels are even squares."""
        return self.optics.projection.has_squares

    def grid(self, ways: np.ndarray, x: int, columns: int, rows: range, step: int) -> Grid:
        """Return the means that rows of photosites of the sensor see, `columns` of them from column x on.

        ways: (rows or 1, instants, layers, 2) x, y [photosites]. step: sets of columns in which the planes have theirs.
        """
        projection, layers = self.optics.projection, len(self.phases.layers)
        begins = (
            projection.offset_y + projection.scale * (np.array(rows) + 0.5) - (0.5 * self.side_px if self.is_square else 0.0)
        )
        down, places = row_places(projection.scale * ways[..., 1]), row_places(begins)
        down["row"] -= 0 if self.is_square else 1  # the first of the rows beside that in the middle
        lowest, highest = (down["row"].min(axis=(1, 2)), down["row"].max(axis=(1, 2)))
        begin = int(np.clip((places["row"] + lowest).min(), 0, projection.scene_height - 1))
        last = int((places["row"] + highest).max()) + 1 + self.reads
        height = int(np.clip(last, begin + 1, projection.scene_height)) - begin
        numbers = [one.beside(ways[..., n, 0]) for n, one in enumerate(self.phases.layers)]
        split = [(one.split(left), one.split(right)) for one, (left, right, _) in zip(self.phases.layers, numbers, strict=True)]
        shifts = [pixels for pair in split for _, pixels in pair]
        aside = min(int(one.min()) for one in shifts) // ALIGNED * ALIGNED
        width = -(-(columns + max(int(one.max()) for one in shifts) - aside) // SPAN) * SPAN
        found = np.zeros(down.shape, declared_struct(kernel_source(FILE), "spot"))
        found["row"], found["below"] = down["row"], down["below"]
        places["row"] -= begin + np.array(rows, np.int32)
        for n, (left, right) in enumerate(split):
            for name, (phase, pixels) in (("left", left), ("right", right)):
                found[name][..., n] = pixels - aside - x
                found[f"{name}_phase"][..., n] = phase * (self.plane_count * height * width)
            found["past"][..., n] = numbers[n][2]
        planes = [self._means(n, x + aside, width, range(begin, begin + height), step) for n in range(layers)]
        return Grid(planes, width, height, found, places)

    def _buffer(self, layer: int, size: int) -> Buffer:
        """Buffer of a layer for so many means, the same one for all bands of rows if they fit."""
        if size > self.sizes[layer]:
            self.buffers[layer], self.sizes[layer] = self.device.empty((size,), np.float32), size
        return self.buffers[layer]

    def _tables(self, layer: int, x: int, width: int, step: int) -> _Tables:
        """Tables of so many columns from column x of the sensor on, which lie in `step` sets."""
        key = layer, x, width
        if key not in self.kept:
            projection, phases = self.optics.projection, self.phases.layers[layer]
            places = phases.start_px + phases.step_px * np.arange(phases.count)
            columns = x + np.arange(width).reshape(-1, step).T.ravel()
            middles = projection.offset_x + projection.scale * (columns + 0.5 + places[:, None])
            first, shares = shares_along(projection, middles, self.side_px)
            beyond = first - first[0]  # the first pixel of the first phase [px]
            begins = beyond.min(axis=1)
            late = beyond - begins[:, None]
            taps = self.reads + int(late.max())
            slots = int(begins.max()) + taps
            moved = np.zeros((phases.count, taps, width), np.float32)
            for n in range(int(late.max()) + 1):
                own = np.where(late == n, 1.0, 0.0)[:, None]
                moved[:, n : n + self.reads] += (own * np.moveaxis(shares, -1, 1)).astype(np.float32)
            pixels = np.clip(first[0] + np.arange(slots)[:, None], 0, projection.scene_width - 1)
            upload = self.device.upload
            buffers = {"pixels": upload(pixels.astype(np.int32)), "begins": upload(begins.astype(np.int32))}
            defines: dict[str, object] = {"SPAN": SPAN, "ROWS": ROWS, "TAPS": taps, "SLOTS": slots}
            self.kept[key] = _Tables(buffers | {"shares": upload(moved)}, defines)
        return self.kept[key]

    def _means(self, layer: int, x: int, width: int, rows: range, step: int) -> Buffer:
        """Means of rows of a layer: device buffer (phases, planes, rows, width) float32, from column x of the sensor on."""
        optics, projection, count = self.optics, self.optics.projection, self.phases.layers[layer].count
        tables = self._tables(layer, x, width, step)
        means = self._buffer(layer, count * self.plane_count * len(rows) * width)
        colours = optics.cfa.colors
        parts = [(min(colours), max(colours) + 1 - min(colours))]
        if layer + 1 < len(self.phases.layers):
            parts.append((optics.channels, 1))
        for plane, planes in parts:
            self.device.run(
                self.device.kernel("layer_phases", tables.defines),
                (width // SPAN, math.ceil(len(rows) / ROWS), planes),
                (1, 1, 1),
                planes=self.scene[layer],
                means=means,
                phases={
                    "first_row": rows.start,
                    "rows": len(rows),
                    "columns": width,
                    "count": count,
                    "plane_count": self.plane_count,
                    "first_plane": plane,
                    "scene_width": projection.scene_width,
                    "scene_height": projection.scene_height,
                },
                **tables.buffers,
            )
        return means
