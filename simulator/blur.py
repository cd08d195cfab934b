"""Executes the planned lens blur on the device, in bands of rows that stay in the cache."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simulator.blur_tables import BlurTable, blur_table
from simulator.blur_tiles import CONSTANT_NODES_PER_PX, NODES_PER_PX, TileChoice, choose, slab_lists
from simulator.defocus import TILE_COLUMNS, TILE_ROWS, Method, Relief
from simulator.device import Device
from simulator.lens_points import lens_points, points_wanted
from simulator.planner import Plan, projection_arguments, projection_defines

BAND_ROWS = 128  # rows that share running sums
HALF_TILE = TILE_COLUMNS // 2
EDGE_PX = 1.0  # neighbouring scene pixels whose radii differ by more belong to two surfaces


class BlurFrame:
    """Geometry of the frame with its margin, cut along bands and tiles of the whole sensor."""

    def __init__(self, planned: Plan):
        frame, self.reach = planned.frame, planned.defocus.reach_px
        first_band, first_tile = frame.y // BAND_ROWS * BAND_ROWS, frame.x // TILE_COLUMNS * TILE_COLUMNS
        self.first_band = first_band
        self.bands = -(-(frame.y + frame.height - first_band) // BAND_ROWS)
        self.x = (first_tile - self.reach) // TILE_COLUMNS * TILE_COLUMNS
        self.y = (first_band - self.reach) // TILE_ROWS * TILE_ROWS
        right = -(-(frame.x + frame.width) // TILE_COLUMNS) * TILE_COLUMNS + self.reach
        bottom = first_band + self.bands * BAND_ROWS + self.reach
        self.half_columns = -(-(right - self.x) // TILE_COLUMNS) * HALF_TILE
        self.rows = -(-(bottom - self.y) // TILE_ROWS) * TILE_ROWS
        self.margin_x, self.margin_y = frame.x - self.x, frame.y - self.y

    @property
    def strip_rows(self) -> int:
        """Rows of a band with its margins."""
        return BAND_ROWS + 2 * self.reach

    def strip_row(self, band: int) -> int:
        """Row of the area at which a band's strip begins."""
        return self.first_band + band * BAND_ROWS - self.reach - self.y

    @cached_property
    def grid(self) -> tuple[int, int]:
        """Tile rows and columns."""
        return self.rows // TILE_ROWS, self.half_columns // HALF_TILE

    def inside(self, planned: Plan) -> np.ndarray:
        """Tiles that hold photosites of the frame: (tile rows, tile columns) bool."""
        first_rows = np.arange(self.grid[0]) * TILE_ROWS - self.margin_y
        first_columns = np.arange(self.grid[1]) * TILE_COLUMNS - self.margin_x
        rows = (first_rows + TILE_ROWS > 0) & (first_rows < planned.frame.height)
        columns = (first_columns + TILE_COLUMNS > 0) & (first_columns < planned.frame.width)
        return rows[:, None] & columns[None, :]


@dataclass(frozen=True)
class Maps:
    """Radius maps of the layers that have one, one after the other on the device, and each layer's relief."""

    radius: object
    reliefs: list[Relief]


def blurred_mosaic(planned: Plan, device: Device, planes: list, progress: Callable[[float], None]):
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: for each layer a device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1], or with the
        layer's coverage as one plane more.
    """
    frame, area = planned.frame, BlurFrame(planned)
    maps = _maps(planned, device, area)
    chosen = choose(planned.defocus, maps.reliefs)
    run = _Run(planned, device, area, maps, chosen, device.empty((frame.height, frame.width), np.float32))
    for band in range(area.bands):
        run.band(band, planes)
        device.finish()
        progress((band + 1) / area.bands)
    return run.light


class _Run:
    """One frame's buffers and tables."""

    def __init__(self, planned: Plan, device: Device, area: BlurFrame, maps: Maps, chosen: TileChoice, light):
        self.planned, self.device, self.area, self.maps, self.chosen, self.light = planned, device, area, maps, chosen, light
        self.wanted = area.inside(planned)
        self.channels, self.layers = planned.camera.channels, len(planned.scene.layers)
        self.coverage = int(any(layer.coverage is not None for layer in planned.scene.layers))
        self.layer_planes = self.channels + self.coverage
        half, rows = area.half_columns, area.strip_rows
        self.sampled = device.empty((self.layers * self.layer_planes, 2, rows, half), np.float32)
        self.sums = device.empty((self.channels, 2, rows + 1, half), np.float32)
        self.least = device.empty((self.channels, 2, half), np.float32)
        cfa = {key: value for key, value in projection_defines(planned).items() if key.startswith("CFA")}
        self.defines = {"SPAN": device.span, "CHANNELS": self.channels, **cfa}
        self.tables = {False: self._graded_table(), True: self._constant_table()}

    def _graded_table(self):
        """Nodes in even steps over all radii that smooth tiles have, and the first of them."""
        mean = (self.chosen.methods == Method.MEAN) & ~self.chosen.constant & self.wanted
        if not mean.any():
            return None
        first = int(np.floor(self.chosen.least_px[mean].min() * NODES_PER_PX)) - 1
        last = int(np.floor(self.chosen.greatest_px[mean].max() * NODES_PER_PX)) + 2
        return self._upload([node / NODES_PER_PX for node in range(first, last + 1)]), first

    def _constant_table(self):
        """One node for each radius that occurs; exact when the whole layer has it."""
        mean = (self.chosen.methods == Method.MEAN) & self.chosen.constant & self.wanted
        if not mean.any():
            return None
        self.constants, self.constant_node = np.unique(self._constant_radii(), return_inverse=True)
        self.constant_node = self.constant_node.reshape(mean.shape)
        return self._upload(self.constants.tolist()), 0

    def _constant_radii(self) -> np.ndarray:
        chosen = self.chosen
        middle = np.abs(0.5 * (chosen.least_px + chosen.greatest_px))
        wanted = (chosen.methods == Method.MEAN) & chosen.constant & self.wanted
        whole = np.array([np.ndim(radius) == 0 for radius in self.planned.defocus.radii_px])[chosen.layer]
        exact = np.array([abs(float(np.min(radius))) for radius in self.planned.defocus.radii_px])[chosen.layer]
        return np.where(wanted, np.where(whole, exact, np.rint(middle * CONSTANT_NODES_PER_PX) / CONSTANT_NODES_PER_PX), 0.0)

    def _upload(self, radii: list[float]) -> dict[str, object]:
        table: BlurTable = blur_table(radii, self.area.strip_rows, self.area.half_columns)
        buffers = {name: self.device.upload(array) for name, array in vars(table).items()}
        return {**buffers, "all_taps": table.weights.size, "all_sides": table.totals.size}

    def band(self, band: int, planes: list) -> None:
        """Compute one band of rows."""
        area, strip_row = self.area, self.area.strip_row(band)
        first_tile = (strip_row + area.reach) // TILE_ROWS
        tiles = slice(first_tile, first_tile + BAND_ROWS // TILE_ROWS)
        self._sample(planes, strip_row)
        place = {
            "rows": area.strip_rows,
            "half_columns": area.half_columns,
            "radius_rows": area.rows,
            "radius_row": strip_row,
            "margin_x": area.margin_x,
            "strip_y": strip_row,
            "margin_y": area.margin_y,
            "width": self.planned.frame.width,
            "height": self.planned.frame.height,
        }
        methods = np.where(self.wanted[tiles], self.chosen.methods[tiles], -1)
        for layer in range(self.layers):
            self._means(layer, methods, tiles, place)
        self._occlusions(methods, tiles, place)

    def _sample(self, planes: list, strip_row: int) -> None:
        area, device = self.area, self.device
        kernel = device.kernel("projection_planes", projection_defines(self.planned), file="projection.cl")
        arguments = projection_arguments(self.planned, area.x, area.y + strip_row)
        for layer, light in enumerate(planes):
            size = (area.half_columns, area.strip_rows, 2 * self.layer_planes)
            device.run(kernel, size, None, planes=light, sampled=self.sampled, first_plane=2 * layer * self.layer_planes, **arguments)

    def _means(self, layer: int, methods: np.ndarray, tiles: slice, place: dict) -> None:
        chosen, device = self.chosen, self.device
        of_layer = chosen.layer[tiles] == layer
        copied, mean = ((methods == method) & of_layer for method in (Method.COPY, Method.MEAN))
        first_plane = layer * self.layer_planes
        if mean.any():
            spans = self.area.half_columns // device.span
            kernel = device.kernel("defocus_sums", {**self.defines, "NODES": 0}, file="defocus.cl")
            size = {"rows": self.area.strip_rows, "half_columns": self.area.half_columns}
            buffers = {"sampled": self.sampled, "sums": self.sums, "least": self.least}
            device.run(kernel, (spans, 2 * self.channels), None, first_plane=first_plane, **buffers, **size)
        for constant in (True, False):
            wanted = mean & (chosen.constant[tiles] == constant) | (copied if constant else False)
            if not wanted.any():
                continue
            table, first_node = self.tables[constant] or (self._upload([0.0]), 0)
            if constant:
                node = self.constant_node[tiles] if self.tables[True] else np.zeros(wanted.shape, int)
                count = np.where(copied, 0, 1)
            else:
                node = np.floor(chosen.least_px[tiles] * NODES_PER_PX).astype(int) - 1 - first_node
                count = np.floor(chosen.greatest_px[tiles] * NODES_PER_PX).astype(int) + 3 - first_node - node
            device.run(
                device.kernel("defocus_mean", {**self.defines, "NODES": int(not constant)}, file="defocus.cl"),
                *self._launch(wanted),
                sampled=self.sampled,
                sums=self.sums,
                least=self.least,
                radius=self.maps.radius,
                light=self.light,
                tiles=device.upload(self._tile_list(wanted, node, count)),
                first_node=first_node,
                nodes_per_px=NODES_PER_PX,
                first_plane=first_plane,
                map=self._map_of(layer),
                **table,
                **place,
            )

    def _map_of(self, layer: int) -> int:
        return sum(np.ndim(radius) > 0 for radius in self.planned.defocus.radii_px[:layer])

    def _occlusions(self, methods: np.ndarray, tiles: slice, place: dict) -> None:
        wanted = methods == Method.OCCLUSION
        if not wanted.any():
            return
        device, chosen = self.device, self.chosen
        slabs, first, count = slab_lists(self.planned.defocus, chosen.present[:, tiles].reshape(self.layers, -1))
        first, count, slabs = first.reshape(wanted.shape), count.reshape(wanted.shape), device.upload(slabs)
        points = points_wanted(chosen.largest_px[tiles])
        kernel = device.kernel("occlusion", {**self.defines, "COVERAGE": self.coverage}, file="occlusion.cl")
        for number in np.unique(points[wanted]):
            group = wanted & (points == number)
            device.run(
                kernel,
                *self._launch(group),
                planes=self.sampled,
                radius=self.maps.radius,
                light=self.light,
                tiles=device.upload(self._tile_list(group, first, count)),
                slabs=slabs,
                points=device.upload(lens_points(int(number))),
                point_count=int(number),
                normalise=int(self.planned.defocus.opaque),
                **place,
            )

    def _launch(self, wanted: np.ndarray) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
        spans = HALF_TILE // self.device.span
        return (spans, 2 * TILE_ROWS, int(wanted.sum())), (spans, 1, 1)

    def _tile_list(self, wanted: np.ndarray, first: np.ndarray, count: np.ndarray) -> np.ndarray:
        """(tiles, 4) uint32: first half column and row in the strip, first entry and entries of the tile's list."""
        tile_rows, tile_columns = np.nonzero(wanted)
        rows = self.area.reach + tile_rows * TILE_ROWS
        return np.stack([tile_columns * HALF_TILE, rows, first[wanted], count[wanted]], axis=-1).astype(np.uint32)


def _maps(planned: Plan, device: Device, area: BlurFrame) -> Maps:
    """Radius on the photosites of every layer, and what its tiles hold."""
    defocus, reliefs, maps = planned.defocus, [], 0
    mapped = sum(np.ndim(radius) > 0 for radius in defocus.radii_px)
    radius = device.empty((max(mapped, 1), 2, area.rows, area.half_columns), np.float32)
    for layer, px in zip(planned.scene.layers, defocus.radii_px, strict=True):
        if np.ndim(px):
            _project_radius(planned, device, area, px, radius, 2 * maps)
            least, greatest, steepest, classes = _measured(planned, device, area, radius, 2 * maps)
            maps += 1
        else:
            least = greatest = np.full(area.grid, px, np.float32)
            steepest, classes = np.zeros(area.grid, np.float32), np.ones(area.grid, np.uint64)
        filled, covered = _coverage(planned, area, layer.coverage)
        reliefs.append(Relief(least, greatest, steepest, classes, covered, filled))
    return Maps(radius, reliefs)


def _project_radius(planned: Plan, device: Device, area: BlurFrame, scene_radius_px: np.ndarray, radius, first_plane: int) -> None:
    device.run(
        device.kernel("projection_radius", projection_defines(planned), file="projection.cl"),
        (area.half_columns, area.rows, 2),
        None,
        scene_radius=device.upload(scene_radius_px),
        radius=radius,
        edge=EDGE_PX,
        first_plane=first_plane,
        **projection_arguments(planned, area.x, area.y),
    )


def _measured(planned: Plan, device: Device, area: BlurFrame, radius, first_plane: int) -> tuple[np.ndarray, ...]:
    """Least, greatest and steepest radius of each tile, and its classes."""
    relief, present = device.empty((3, *area.grid), np.float32), device.empty((2, *area.grid), np.uint32)
    defocus = planned.defocus
    device.run(
        device.kernel("relief", {"SPAN_TILE": HALF_TILE, "TILE_ROWS": TILE_ROWS}),
        area.grid[::-1],
        (1, 1),
        map=radius,
        relief=relief,
        present=present,
        rows=area.rows,
        half_columns=area.half_columns,
        first_plane=first_plane,
        origin=defocus.least_px - defocus.class_step_px,
        classes_per_unit=1.0 / defocus.class_step_px,
    )
    near, far = device.download(present, (2, *area.grid), np.uint32).astype(np.uint64)
    return (*device.download(relief, (3, *area.grid), np.float32), near | far << np.uint64(32))


def _coverage(planned: Plan, area: BlurFrame, coverage: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coverage of each tile, from all scene pixels that its photosites may read."""
    if coverage is None:
        return np.ones(area.grid, np.float32), np.ones(area.grid, np.float32)
    projection = planned.projection
    least = greatest = coverage
    sides = (
        (0, area.y, TILE_ROWS, area.grid[0], projection.offset_y),
        (1, area.x, TILE_COLUMNS, area.grid[1], projection.offset_x),
    )
    for axis, origin, size, tiles, offset in sides:
        first = origin + size * np.arange(tiles)
        low, high = (np.floor(offset + projection.scale * border).astype(int) for border in (first, first + size))
        low, high = (np.clip(px, 0, coverage.shape[axis] - 1) for px in (low - 1, high + 1))
        least, greatest = (
            np.stack([ufunc.reduce(plane.take(range(a, b + 1), axis), axis) for a, b in zip(low, high, strict=True)], axis)
            for ufunc, plane in ((np.minimum, least), (np.maximum, greatest))
        )
    return least, greatest
