"""Executes the motion of a sharp image: sweeps each surface along its path, composited front to back at each instant."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from simulator.device import Buffer, Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.accuracy import LAMP_PEAK
from simulator.optics.defocus.scene_light import brighter_pixels
from simulator.optics.geometry.instants import Instants
from simulator.optics.geometry.posed_projection import pose_numbers, row_views, widest
from simulator.optics.geometry.projection import ANY_CFA, Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.layer_cells import cells_mosaic, cells_planes
from simulator.optics.passes.swept_layers import finer_instants, layers_mosaic, layers_planes
from simulator.optics.passes.swept_shift import shift_mosaic, shift_planes
from simulator.scene.content_keys import freeze
from simulator.sensor.camera.camera_sections import Window

SPAN = 64  # photosites of a row and colour that share a parabola of displacements, on every device, for the same bits
FILE = "swept_projection.cl"
OPEN_BYTES = 2**22  # of the light that nearer layers let through, while a band of rows is computed
EVEN_DRIFT = 0.9  # photosites by which the span's reading may drift, where it reads adjacent pixels


def swept_mosaic(optics: OpticsPlan, device: Device, planes: list[Buffer]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance of a sharp scene that moves.

    planes: for each layer a device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1]; with the layer's
    coverage as one plane more where any layer of the scene has one.
    """
    if optics.motion is not None and optics.sweeps_shift():
        return shift_mosaic(optics, optics.motion, device, planes[0])
    means = None
    if optics.motion is not None and (optics.sweeps_shifted_layers() or optics.sweeps_drifting_layers):
        means = layers_mosaic(optics, optics.motion, device, planes)
    if optics.motion is not None and optics.mixes_edges():
        return cells_mosaic(optics, finer_instants(optics, optics.motion), optics.cell_instants, device, planes, means)
    if means is not None:
        return means
    window = optics.window
    mosaic = device.empty((window.height, window.width), np.float32)
    colors = optics.cfa.colors
    step = 1 if len(colors) == 1 else 2
    sweep = _Sweep(optics, device, planes, window, 1, step, 0.5 * (1.0 - optics.projection.open_side))
    sweep.add(mosaic, 0, colors[0])
    device.finish()  # the tables are freed on return
    return mosaic


def swept_planes(optics: OpticsPlan, device: Device, planes: list[Buffer], window: Window, over: int) -> Buffer:
    """Device buffer (channels, over * height, over * width) float32: electron radiance of a scene that moves, in all colours.

    Each is the mean over the exposure of what a sample of a photosite sees, `over` samples per photosite and axis, each over
    all of its own area. planes: as of `swept_mosaic`. window: photosites, which may lie beyond the sensor.
    """
    if optics.motion is not None and optics.sweeps_shift(over):
        return shift_planes(optics, optics.motion, device, planes[0], window, over)
    means = None
    if optics.motion is not None and optics.sweeps_shifted_layers(over):
        means = layers_planes(optics, optics.motion, device, planes, window, over)
    if optics.motion is not None and optics.mixes_edges(over):
        find = finer_instants(optics, optics.motion)
        return cells_planes(optics, find, optics.cell_instants, device, planes, window, over, means)
    if means is not None:
        return means
    channels, rows = optics.channels, over * window.height
    found = device.empty((channels, rows, over * window.width), np.float32)
    sweep = _Sweep(optics, device, planes, window, over, 1, 0.0)
    together = channels if sweep.shares_paths else 1
    for channel in range(0, channels, together):
        sweep.add(found, channel * rows, channel, together)
    device.finish()  # the tables are freed on return
    return found


@dataclass(frozen=True)
class _Table:
    """Kernel of a layer, its table of displacements, and its macros."""

    kernel: str
    buffers: dict[str, Buffer]
    macros: dict[str, object]


class _Sweep:
    """A scene that is swept over the photosites of a window, or over samples of them, which are its photosites then.

    over: samples per photosite and axis. step: columns from one photosite of a span to the next; 1: planes of one colour each.
    inset: of a photosite's open area from its border [photosites].
    """

    def __init__(
        self, optics: OpticsPlan, device: Device, planes: list[Buffer], window: Window, over: int, step: int, inset: float
    ) -> None:
        assert optics.motion is not None  # without it no pass sweeps
        self.optics, self.device, self.planes, self.plan = optics, device, planes, optics.motion
        if not optics.sweeps_lamps_apart:
            self.plan = self.plan.with_lamps_everywhere()
        self.over, self.step, self.inset = over, step, inset
        self.x, self.y, self.width, self.rows = over * window.x, over * window.y, over * window.width, over * window.height
        self.projection = _finer(optics.projection, over)
        self.layers = optics.covering_layers
        wide = step * SPAN
        self.aligned = self.x // wide * wide
        self.spans = -(-(self.x + self.width - self.aligned) // wide)
        self.near_lamps: Buffer | None = None
        parts = [self.plan.window_instants(window)]
        if self.plan.lamp_count:
            self.near_lamps = device.upload(self._near_lamps())
            parts.append(self.plan.window_instants(window, self.plan.lamp_count))
        self.moving = optics.moving_layers
        once = self.plan.window_instants(window, 1)  # of layers at rest behind all that move
        each = [[one if layer < self.moving else once for layer in range(self.layers)] for one in parts]
        self.parts = [[(instants, self._table(instants, layer)) for layer, instants in enumerate(part)] for part in each]

    def _near_lamps(self) -> np.ndarray:
        """Whether a lamp passes each span of each row: (rows, spans) uint8."""
        places = (lamp_places(self.optics) - _offset(self.projection)) / self.projection.scale
        left, right, top, bottom = (self.over * self.plan.seen_at(places / self.over)).T
        beside, wide = 1.0 / self.projection.scale + 2.0, self.step * SPAN
        spans = np.floor(np.stack([left - beside - self.aligned, right + beside - self.aligned]) / wide)
        rows = np.floor(np.stack([top - beside - self.y, bottom + beside - self.y]))
        is_here = (spans[1] >= 0) & (spans[0] < self.spans) & (rows[1] >= 0) & (rows[0] < self.rows)
        first, last = np.clip(spans[:, is_here], 0, self.spans - 1).astype(int)
        above, below = np.clip(rows[:, is_here], 0, self.rows - 1).astype(int)
        steps = np.zeros((self.rows + 1, self.spans + 1), np.int64)  # of how many lamps pass
        for row, span, sign in ((above, first, 1), (above, last + 1, -1), (below + 1, first, -1), (below + 1, last + 1, 1)):
            np.add.at(steps, (row, span), sign)
        return (steps.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0).astype(np.uint8)

    @property
    def shares_paths(self) -> bool:
        """Whether the colours of a span are read together, along a path that is computed once."""
        return self.layers == 1 and self.optics.sweeps_rows and not self.plan.path.motion.is_at_rest(0)

    def add(self, mosaic: Buffer, mosaic_row: int, colour: int, colours: int = 1) -> None:
        """Write the swept light of some colours from `colour` on, or of a colour filter, to `mosaic` from a row on."""
        for number, tables in enumerate(self.parts):
            self._add(tables, number, mosaic, mosaic_row, (colour, colours))

    def _add(
        self,
        tables: list[tuple[Instants, _Table]],
        number: int,
        mosaic: Buffer,
        mosaic_row: int,
        colours: tuple[int, int],
    ) -> None:
        """Write the spans that no lamp passes (number 0) or that one passes (1); all, where places do not differ."""
        set_columns, rows = self.spans * SPAN, self.rows
        kept = tables[0][0].count if self.moving > 1 else 1
        if self.layers > 1:
            rows = min(rows, max(OPEN_BYTES // (4 * self.step * set_columns * kept), 1))
        shape = (kept, rows, self.step, set_columns) if self.layers > 1 else (1,)
        open_ = self.device.empty(shape, np.float32)
        geometry = self.plan.path.motion.geometry
        for first_row in range(0, self.rows, rows):
            count = min(rows, self.rows - first_row)
            for layer, (instants, table) in enumerate(tables):
                at_rest = int(self.plan.path.motion.is_at_rest(layer))
                covered = int(layer < self.layers - 1)
                defines = {
                    **table.macros,
                    "FIRST": int(layer == 0),
                    "COVERED": covered,
                    "AT_REST": at_rest,
                    "MEAN": covered * int(layer == self.moving - 1),
                    "LAMPS": int(self.near_lamps is not None),
                    "COLOURS": colours[1],
                }
                self.device.run(
                    self.device.kernel(table.kernel, defines, file=FILE),
                    (self.spans, self.step * count),
                    (self.spans, 1),
                    planes=self.planes[layer],
                    open=open_,
                    mosaic=mosaic,
                    near_lamps=self.near_lamps,
                    sweep={
                        **_geometry(self.projection),
                        "origin_x": self.x,
                        "origin_y": self.y,
                        "width": self.width,
                        "first_column": self.aligned - self.x,
                        "first_row": first_row,
                        "mosaic_row": mosaic_row,
                        "colour": colours[0],
                        "plane_rows": self.rows,
                        "lamps": number,
                        "set_columns": set_columns,
                        "instants": instants.count,
                        "pivot_x": 0.5 * self.over * geometry.width_px,
                        "pivot_y": 0.5 * self.over * geometry.height_px,
                    },
                    **table.buffers,
                )

    def _table(self, instants: Instants, layer: int) -> _Table:
        """Return the kernel for a layer, its table of displacements and its macros."""
        optics, over = self.optics, self.over
        homographies = self.plan.path.motion.homographies(instants.pose_numbers, layer)
        columns = instants.axis == "columns"
        by_place = columns or not optics.sweeps_rows
        moving = widest(self.projection, self.plan, homographies if by_place else np.eye(3))
        macros = moving.defines(optics.cfa_macros() if self.step == 2 else ANY_CFA, inset=self.inset)
        common: dict[str, object] = {"SPAN": SPAN, "STEP": self.step, "COLUMNS": int(columns), "CHANNELS": optics.channels}
        if by_place:
            numbers = np.concatenate([instants.weights[..., None], self._finer_poses(homographies)], axis=-1)
            lines = self.width if columns else self.rows
            table = np.broadcast_to(_of_samples(numbers, over), (lines, *numbers.shape[1:])).astype(np.float32)
            rest = {"EVEN": 0, "BUFFER": 4, "READS": 2}
            return _Table("swept_places", {"poses": self.device.upload(table)}, {**macros, **common, **rest})
        y_px = (np.arange(self.y, self.y + self.rows) + 0.5) / over
        views = row_views(self.plan, _of_samples(homographies, over), y_px)
        fields = np.zeros((self.rows, instants.count), declared_struct(kernel_source(FILE), "view"))
        scales = {"x": over, "y": over, "shrink": 1.0 / over}
        for name, values in {**views, "weight": _of_samples(instants.weights, over)}.items():
            fields[name] = scales.get(name, 1.0) * values
        taps = moving.taps(1.0 - 2.0 * self.inset)
        reach = self.step * (SPAN - 1)
        drift = reach * (abs(moving.scale - 1.0) + self.plan.slopes[1])
        common |= {
            "EVEN": int(taps == 0 and not moving.is_bilinear and drift < EVEN_DRIFT),
            "READS": taps or 2,
            "BUFFER": int(np.ceil(1.1 * reach * moving.scale)) + taps + 6,
        }
        return _Table(
            "swept_rows", {"views": self.device.upload(fields)}, {**macros, **common, "TAPS": taps, "LEANS": 0, "POSE": 0}
        )

    def _finer_poses(self, homographies: np.ndarray) -> np.ndarray:
        """`pose_numbers`, counted in samples."""
        over = float(self.over)
        units = np.array([over, over, over, 1.0, 1.0, over, 1.0, 1.0, 1.0 / over, 1.0 / over])
        return units * pose_numbers(self.plan, homographies)


def lamp_places(optics: OpticsPlan) -> np.ndarray:
    """Return the middles of the scene's pixels that are lamps, LAMP_PEAK times its brightest light, (lamps, 2) x, y [px]."""
    scene, weights, limit = optics.scene, optics.weights, LAMP_PEAK * optics.accuracy.brightest

    def find() -> np.ndarray:
        rows, columns, _ = brighter_pixels(scene.planes, weights, np.array(limit, np.float32))
        return np.column_stack([columns, rows]) + 0.5

    return scene.remember(("places of lamps", freeze(weights), limit), find)


def _of_samples(numbers: np.ndarray, over: int) -> np.ndarray:
    """Return numbers of photosites' lines (lines or 1, ...) for lines of their samples; of one line, these are those of all."""
    return numbers if len(numbers) == 1 else np.repeat(numbers, over, axis=0)


def _finer(projection: Projection, over: int) -> Projection:
    """Return the projection of the same scene onto photosites that are `over` times smaller, from the same corner on."""
    if over == 1:
        return projection
    warp, samples = projection.warp, -(-projection.samples // over)
    if warp is not None:
        centre = over * warp.centre_x_px, over * warp.centre_y_px
        warp = replace(warp, unit_px=over * warp.unit_px, centre_x_px=centre[0], centre_y_px=centre[1])
    return replace(projection, scale=projection.scale / over, samples=samples, warp=warp, open_side=1.0)


def _offset(projection: Projection) -> np.ndarray:
    return np.array([projection.offset_x, projection.offset_y])


def _geometry(projection: Projection) -> dict[str, Any]:
    names = "scene_width", "scene_height", "scale", "offset_x", "offset_y"
    return {name: getattr(projection, name) for name in names} | {"rests": projection.rests()}
