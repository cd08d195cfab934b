"""Executes layers that shift apart, each as a whole: composited at each instant, or at points of aperture and time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulator.device import Buffer, Device, Kernel
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.aperture_samples import moving_samples, sample_count
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.joint_motion import CELL_PX
from simulator.optics.geometry.motion_plan import MotionPlan
from simulator.optics.geometry.posed_projection import row_views
from simulator.optics.geometry.projection import ANY_CFA
from simulator.optics.optics_plan import MOST_SHIFTED_LAYERS, OpticsPlan
from simulator.optics.passes.layer_means import Grid, LayerMeans, row_places, spots_of
from simulator.optics.passes.layer_rows_between import LayerRowsBetween
from simulator.sensor.camera.camera_sections import Window

SPAN = 64  # photosites of a row and colour of a work-item
FILE = "swept_layers.cl"
BAND_READS = 2**30  # of a launch: photosites, times instants and layers
BAND_SPOTS = 2**20  # of the table of a launch
LEAST_BAND_ROWS = 16
LINE_ROWS = (1, 2, 4, 8, 16)  # rows that may share points
LONG_SPANS = (64, 128, 192, 256, 320)  # where a pixel is one read of each plane, which takes no longer than to begin a span
SPAN_COST = 32  # photosites whose time it takes to begin one


@dataclass(frozen=True)
class Places:
    """Where the lines of some rows of photosites see each layer.

    ways: (lines or 1, instants, layers, 2) float64 x, y [photosites]. weights: (lines or 1, instants). rows: photosites of each
    line. above: rows of the first line above the first row. views: (lines, instants, layers) of `struct view`, where
    displacements change along a row, instead of `ways`; None: they do not.
    """

    ways: np.ndarray
    weights: np.ndarray
    rows: int = 1
    above: int = 0
    views: np.ndarray | None = None


Find = Callable[[Window], Places]  # places for the rows of a window
Progress = Callable[[float], None]


def layers_mosaic(optics: OpticsPlan, motion: MotionPlan, device: Device, planes: list[Buffer]) -> Buffer:
    """Device buffer (height, width) float32: `swept_mosaic` of layers that `OpticsPlan.sweeps_shifted_layers` or drift."""
    swept, layers = motion.with_lamps_everywhere(), optics.covering_layers
    if optics.sweeps_drifting_layers:
        drift = _Sweep(optics, device, planes, swept.count, lambda rows: _drifts(swept, rows, layers), optics.moving_layers)
        return drift.mosaic()
    if optics.layer_phases is not None:
        swept = replace(swept, count=optics.layer_phases.instants)
    sweep = _Sweep(
        optics,
        device,
        planes,
        swept.count,
        lambda rows: instants_of(swept, rows, layers),
        optics.moving_layers,
        1,
        optics.projection.open_side,
    )
    return sweep.mosaic()


def layers_planes(
    optics: OpticsPlan, motion: MotionPlan, device: Device, planes: list[Buffer], window: Window, over: int
) -> Buffer:
    """Device buffer (channels, over * height, over * width) float32: `swept_planes` of such layers."""
    swept, layers, there = motion.with_lamps_everywhere(), optics.covering_layers, replace(optics, window=window)
    sweep = _Sweep(
        there, device, planes, swept.count, lambda rows: instants_of(swept, rows, layers), optics.moving_layers, over
    )
    return sweep.planes()


def finer_instants(optics: OpticsPlan, motion: MotionPlan) -> Find:
    """Return what finds places of layers at the instants of `OpticsPlan.cell_instants`."""
    finer, layers = replace(motion, count=optics.cell_instants, lamp_count=0), optics.covering_layers
    return lambda rows: instants_of(finer, rows, layers)


def points_mosaic(
    optics: OpticsPlan, blur: Defocus, motion: MotionPlan, device: Device, planes: list[Buffer], progress: Progress
) -> tuple[Buffer, Find, int]:
    """Device buffer (height, width) float32: the mosaic of layers for which `OpticsPlan.samples_shifted_layers` holds.

    And what finds places of the layers, and how many each line has. blur: of the lens, with the motion.
    """
    layers, count = optics.covering_layers, int(sample_count(np.array([blur.largest_px]), blur)[0])

    def find(rows: Window) -> Places:
        return points_of(blur, motion, rows, layers, count)

    between = LayerRowsBetween(optics, device, planes) if optics.reads_rows else None
    return _Sweep(optics, device, planes, count, find, layers, between=between).mosaic(progress), find, count


class _Sweep:
    """Layers that are swept over the photosites of a window, or over samples of them, in bands of rows.

    count: instants. moving: first layers that differ from instant to instant. over: samples per photosite and axis.
    """

    def __init__(
        self,
        optics: OpticsPlan,
        device: Device,
        planes: list[Buffer],
        count: int,
        find: Find,
        moving: int,
        over: int = 1,
        side: float = 1.0,
        between: LayerRowsBetween | None = None,
    ) -> None:
        self.optics, self.device, self.find, self.moving, self.over = optics, device, find, moving, over
        self.layers = layers = optics.covering_layers
        self.scene = planes
        self.drifts = over == 1 and optics.sweeps_drifting_layers
        phases = None if self.drifts else optics.layer_phases
        self.span = SPAN if between is None else _long_span(optics.window, 2 if len(optics.cfa.colors) > 1 else 1)
        self.spots = "spots" if between is None else "row_spots"
        self.means = between if phases is None else LayerMeans(optics, phases, device, planes, side)
        reads, spots = over**2 * optics.window.width * count * layers, count * layers
        self.band_rows = max(min(BAND_READS // reads, BAND_SPOTS // spots), LEAST_BAND_ROWS)
        if self.means is not None:
            self.band_rows = min(self.band_rows, self.means.band_rows)

    def mosaic(self, progress: Progress = lambda share: None) -> Buffer:
        """Each photosite's own colour, (rows, columns)."""
        window, colors = self.optics.window, self.optics.cfa.colors
        found = self.device.empty((window.height, window.width), np.float32)
        self._run(found, 2 if len(colors) > 1 else 1, colors[:1], progress)
        return found

    def planes(self) -> Buffer:
        """All colours of all samples, (channels, rows, columns)."""
        window, over, channels = self.optics.window, self.over, self.optics.channels
        found = self.device.empty((channels, over * window.height, over * window.width), np.float32)
        self._run(found, 1, range(channels), lambda share: None)
        return found

    def _run(self, found: Buffer, step: int, colours: Sequence[int], progress: Progress) -> None:
        """Write one plane for each of some colours. step: columns from a photosite of a span to the next; 2: a filter."""
        window, defines = self.optics.window, {"SPAN": self.span, "STEP": step, "BENDS": 0}
        defines |= {"LAYERS": self.layers, "MOVING": self.moving, "CHANNELS": self.optics.channels}
        defines |= {"READS": 2, "EDGES": 1, "SQUARES": 1, "DRIFTS": int(self.drifts)}
        if self.means is not None:
            defines |= {"READS": self.means.reads, "EDGES": 0, "SQUARES": int(self.means.is_square)}
        filter_ = self.optics.cfa_macros() if step == 2 else ANY_CFA
        kernel = self.device.kernel("swept_layers", {**filter_, **defines}, file=FILE)
        for first in range(0, window.height, self.band_rows):
            rows = min(self.band_rows, window.height - first)
            self._run_band(kernel, found, step, colours, first, rows)
            progress((first + rows) / window.height)

    def _run_band(self, kernel: Kernel, found: Buffer, step: int, colours: Sequence[int], first: int, rows: int) -> None:
        """Write some rows of photosites from `first` on."""
        window, projection, over, wide = self.optics.window, self.optics.projection, self.over, step * self.span
        places = self.find(Window(window.x, window.y + first, window.width, rows))
        x, width, high = over * window.x, over * window.width, over * window.height
        aligned = x // wide * wide
        spans = -(-(x + width - aligned) // wide)
        grid = self._grid(places, aligned, spans * wide, range(window.y + first, window.y + first + rows), step)
        table, table_of = (grid.spots, self.spots) if places.views is None else (places.views, "views")
        shares = np.broadcast_to(places.weights.astype(np.float32), table.shape[:2])
        found_there, own_places, weights = map(self.device.upload, (table, grid.places, shares))
        surfaces = {f"layer_{n}": grid.planes[min(n, self.layers - 1)] for n in range(MOST_SHIFTED_LAYERS)}
        for number, colour in enumerate(colours):
            self.device.run(
                kernel,
                (spans, step * over * rows),
                (spans, 1),
                **surfaces,
                spots=found_there if table_of == "spots" else None,
                row_spots=found_there if table_of == "row_spots" else None,
                views=found_there if table_of == "views" else None,
                places=own_places,
                weights=weights,
                mosaic=found,
                layers={
                    "origin_x": x,
                    "origin_y": over * window.y,
                    "width": width,
                    "first_column": aligned - x,
                    "first_row": over * first,
                    "mosaic_row": number * high,
                    "colour": colour,
                    "instants": places.weights.shape[1],
                    "lines": len(table),
                    "rows": over * places.rows,
                    "above": over * places.above,
                    "grid_width": grid.width,
                    "grid_height": grid.height,
                    "side": 1.0 if self.means is None else self.means.side_px,
                    "pivot_x": 0.5 * self.optics.sensor_px[0],
                    "offset_x": math.floor(projection.offset_x),
                    "offset_y": math.floor(projection.offset_y),
                    "beyond_x": projection.offset_x % 1.0,
                    "beyond_y": projection.offset_y % 1.0,
                },
            )
        self.device.finish()  # the tables are freed on return

    def _grid(self, places: Places, x: int, columns: int, rows: range, step: int) -> Grid:
        """Return the planes that photosites of these rows of the sensor read, and where. x, columns: of whole spans."""
        if self.means is not None:
            return self.means.grid(places.ways, x, columns, rows, step)
        projection = self.optics.projection
        spots = spots_of(self.over * places.ways + np.array([projection.offset_x, projection.offset_y]))
        return Grid(self.scene, projection.scene_width, projection.scene_height, spots, row_places(np.zeros(1)))


def _long_span(window: Window, step: int) -> int:
    """Return which of LONG_SPANS takes the least time over a row of a window, whose sets of columns are every `step`-th."""

    def cost(span: int) -> int:
        wide = step * span
        return ((window.x + window.width - 1) // wide - window.x // wide + 1) * (span + SPAN_COST)

    return min(LONG_SPANS, key=cost)


def instants_of(plan: MotionPlan, window: Window, layers: int) -> Places:
    """Places of layers at the instants of each row."""
    return Places(*plan.path.of_lines(plan.lines_of(window)).shifts(plan.count, range(layers)))


def _drifts(plan: MotionPlan, window: Window, layers: int) -> Places:
    """Displacements of layers along each row, at its instants."""
    instants = plan.window_instants(window)
    y_px = np.arange(window.y, window.y + window.height) + 0.5
    views = np.zeros((window.height, instants.count, layers), declared_struct(kernel_source(FILE), "view"))
    for layer in range(layers):
        homographies = plan.path.motion.homographies(instants.pose_numbers, layer)
        for name, values in row_views(plan, homographies, y_px).items():
            views[name][..., layer] = values
    return Places(np.zeros((1, 1, layers, 2)), instants.weights, views=views)


def points_of(blur: Defocus, plan: MotionPlan, window: Window, layers: int, count: int) -> Places:
    """Places that points of the aperture see, each at its instant. Rows that see them alike share them, to CELL_PX."""
    motion = blur.motion
    assert motion is not None  # else no point carries an instant
    samples = moving_samples(blur.pupil, count, 1, blur.area.open_side).astype(np.float64)
    samples = samples[np.argsort(samples[:, 1])]  # by the rows that they see, which stay in the cache
    rows, cells = 1, np.zeros(1, np.intp)
    if not plan.is_common:
        rows = max(size for size in LINE_ROWS if 0.5 * motion.skew_px * (size - 1) <= CELL_PX)
        cells = np.arange(window.y // rows, (window.y + window.height - 1) // rows + 1)
    middles = np.clip(rows * cells[:, None] + np.array([0, rows - 1]), 0, len(plan.path.lines.peak) - 1).mean(axis=1)
    ways = motion.layer_shifts(middles, samples, blur.radii_px[:layers])
    return Places(ways, np.full((len(cells), count), 1.0 / count), rows, window.y % rows if len(cells) > 1 else 0)
