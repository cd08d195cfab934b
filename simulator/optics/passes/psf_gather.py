"""Executes a planned point spread function on the device: each photosite gathers light in its own colour."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.defocused_mosaic import defocused_mosaic
from simulator.optics.passes.psf_bands import (
    HALF_TILE,
    SPAN_CELLS,
    TILE_ROWS,
    PsfBand,
    make_terms,
    node_limits,
    split_into_bands,
    tile_nodes,
)
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.gather_kernels import GatherKernels, corrections_of, gather_kernels_of
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

BLUR_SHARE = 0.7  # of the progress, where the geometric blur comes first
EDGE_PX = 1.0  # difference in blur radius above which light comes from another surface
UNLIMITED = 1e38  # limit of highlights where there are none
LIGHT_DEFINES: dict[str, object] = {"OVER": 1, "CHANNELS": 1, "LAYERS": 1, "OPAQUE": 1}  # of kernels/psf_light.cl


class Source(Protocol):
    """Light in full colour, band by band."""

    def fill(self, band: PsfBand, planes: Buffer) -> None:
        """Write the samples of a band with its margins, (channels, column sets, rows, set columns) float32."""


@dataclass(frozen=True)
class ProjectedLight:
    """The sharp light of the only layer of a scene."""

    optics: OpticsPlan
    device: Device
    scene: Buffer

    def fill(self, band: PsfBand, planes: Buffer) -> None:
        """Project the band from the scene's grid."""
        projection, channels = self.optics.projection, self.optics.channels
        project_planes(self.device, projection, self.scene, channels, planes, 0, band.layout, (band.x, band.y))


@dataclass(frozen=True)
class BlurredLight:
    """The light behind the geometric blur. mosaics: of a window, by channel, float32."""

    device: Device
    window: Window
    mosaics: dict[int, Buffer]

    def fill(self, band: PsfBand, planes: Buffer) -> None:
        """Copy the band from the mosaics of all colours."""
        layout, kernel = band.layout, self.device.kernel("psf_interleave", LIGHT_DEFINES, file="psf_light.cl")
        for channel, mosaic in self.mosaics.items():
            self.device.run(
                kernel,
                (layout.set_columns, layout.rows, 2),
                None,
                mosaic=mosaic,
                planes=planes,
                colour=channel,
                mosaic_columns=self.window.width,
                mosaic_rows=self.window.height,
                shift_x=self.window.x - band.x,
                shift_y=self.window.y - band.y,
            )


@dataclass(frozen=True)
class SharpLight:
    """The light of all layers as if nothing were out of focus, and the blur radius of the surface that each photosite sees.

    planes: of `defocused_mosaic`. blur: holds the layers' blur radii. layers, radius: buffers for a band.
    """

    optics: OpticsPlan
    device: Device
    planes: Sequence[Buffer]
    blur: TilePlan
    layers: Buffer
    radius: Buffer

    @property
    def planes_each(self) -> int:
        """Planes of a layer: its colours, and its coverage where any layer has one."""
        return self.optics.channels + self.optics.has_coverage

    def fill(self, band: PsfBand, planes: Buffer) -> None:
        """Project all layers and composite them front to back. planes: the buffer `layers`, which holds them all."""
        device, layout, projection = self.device, band.layout, self.optics.projection
        origin, maps = (band.x, band.y), 0
        count = len(self.planes) if self.optics.has_coverage else 1
        for layer, radius_px in enumerate(self.blur.defocus.radii_px[:count]):
            first = layer * self.planes_each
            project_planes(device, projection, self.planes[layer], self.planes_each, planes, first, layout, origin)
            if isinstance(radius_px, np.ndarray):
                scene_radius = self.blur.maps.scene_radius[maps]
                project_radius(device, projection, scene_radius, self.radius, layer, layout, origin)
                maps += 1
            else:
                size = int(np.prod(layout.shape(1)))
                device.write(self.radius, np.full(size, radius_px, np.float32), 4 * layer * size)
        if self.optics.has_coverage:
            defines = {
                **LIGHT_DEFINES,
                "CHANNELS": self.optics.channels,
                "LAYERS": count,
                "OPAQUE": int(self.blur.defocus.opaque),
            }
            kernel = device.kernel("psf_composite", defines, file="psf_light.cl")
            device.run(kernel, layout.work_size(1), None, layers=planes, radius=self.radius)


def gather_psf(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the lens; arguments of `psf_mosaic`."""
    psf, frame = optics.psf, optics.window
    assert psf is not None  # without it this pass does not run
    light = device.zeros((frame.height, frame.width), np.float32)
    first, source = 0.0, _source(optics, blur, device, planes, lambda share: progress(BLUR_SHARE * share))
    bands = split_into_bands(frame, psf.gather_reach_px, psf.over)
    gathers = [BandGather(optics, psf, [gather_kernels_of(psf, optics.channels)], device, bands[0], source)]
    if blur is not None:
        first = BLUR_SHARE
        corrections = corrections_of(psf, optics.channels)
        if corrections:
            sharp = _sharp_light(optics, blur, device, planes, bands[0])
            gathers.insert(0, BandGather(optics, psf, corrections, device, bands[0], sharp))
    for count, band in enumerate(bands):
        for gather in gathers:
            gather.add(band, light)
        device.finish()
        progress(first + (1.0 - first) * (count + 1) / len(bands))
    return light


def _source(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Source:
    if blur is None:
        return ProjectedLight(optics, device, planes[0])
    colors, mosaics = optics.cfa.colors, {}
    for count, channel in enumerate(colors):

        def report(share: float, count: int = count) -> None:
            progress((count + share) / len(colors))

        mosaics[channel] = defocused_mosaic(blur, Cfa.uniform(channel), device, list(planes), report)
    return BlurredLight(device, blur.optics.window, mosaics)


def _sharp_light(optics: OpticsPlan, blur: TilePlan, device: Device, planes: Sequence[Buffer], band: PsfBand) -> SharpLight:
    layers = len(planes) if optics.has_coverage else 1
    light = device.empty(band.layout.shape(layers * (optics.channels + optics.has_coverage)), np.float32)
    return SharpLight(optics, device, planes, blur, light, device.empty(band.layout.shape(layers), np.float32))


class BandGather:
    """Gathers the bands of a frame from one source of light; buffers are reused from band to band.

    every: kernels that are summed. Those of several blur radii are corrections, added to the light of the others.
    """

    def __init__(
        self,
        optics: OpticsPlan,
        psf: FieldPsf,
        every: Sequence[GatherKernels],
        device: Device,
        band: PsfBand,
        source: Source,
    ) -> None:
        self.device, self.psf, self.every, self.channels, self.source = device, psf, every, optics.channels, source
        layout, self.unread = band.layout, device.zeros((1,), np.float32)
        sharp = source if isinstance(source, SharpLight) else None
        self.radius = None if sharp is None else sharp.radius
        self.planes = device.zeros(layout.shape(self.channels), np.float32) if sharp is None else sharp.layers
        tail = any(kernels.tail_taps for kernels in every)
        cells = (self.channels, band.rows // 2, layout.set_columns) if tail else (1,)
        self.cells, self.tail = device.zeros(cells, np.float32), device.zeros(cells, np.float32)
        self.core = [device.upload(kernels.core) for kernels in every]
        self.core_px = max(kernels.core_px for kernels in every)
        rings = any(kernels.rings for kernels in every) and psf.highlight_limits
        self.limits = np.array(psf.highlight_limits) if rings else np.full(self.channels, UNLIMITED)
        rows, columns = psf.nodes
        self.defines: dict[str, object] = {
            **optics.cfa.macros(0, 0),
            "OVER": psf.over,
            "CHANNELS": self.channels,
            "NODE_ROWS": rows,
            "NODE_COLUMNS": columns,
        }

    def add(self, band: PsfBand, light: Buffer) -> None:
        """Add the light of one band to the mosaic `light`, in place."""
        self.source.fill(band, self.planes)
        numbers, across = node_limits(band, self.limits, self.psf.x_px, self.psf.y_px)
        limits = self.device.upload(numbers)
        bright, present = self._is_bright(band), tile_nodes(band, across)
        ranges, steps = (None, np.zeros(len(bright), bool)) if self.radius is None else self._radius_ranges(band)
        for kernels, core in zip(self.every, self.core, strict=True):
            if kernels.tail is not None:
                self._make_tail(band, kernels.tail, limits)
            tiles, terms = make_terms(band, present, kernels.radii_px, ranges)
            for is_bright, has_steps in itertools.product((False, True), repeat=2):
                selected = tiles[(bright == is_bright) & (steps == has_steps) & (tiles[:, 3] > 0)]
                if len(selected):
                    self._gather(band, kernels, core, selected, terms, limits, light, is_bright, has_steps)

    def _make_tail(self, band: PsfBand, tail: np.ndarray, limits: Buffer) -> None:
        device, layout, cell_rows = self.device, band.layout, band.rows // 2
        span = min(device.span, SPAN_CELLS)
        defines = {**self.defines, "SPAN": span, "TAIL_TAPS": tail.shape[-1]}
        device.run(
            device.kernel("psf_cells", defines, file="psf_tail.cl"),
            (layout.set_columns, cell_rows, self.channels),
            None,
            planes=self.planes,
            cells=self.cells,
        )
        first = band.margin_rows // 2 - 1
        size = ((layout.set_columns - 2 * SPAN_CELLS) // span, cell_rows - 2 * first, self.channels)
        device.run(
            device.kernel("psf_tail", defines, file="psf_tail.cl"),
            size,
            (size[0], 1, 1),
            cells=self.cells,
            tail=self.tail,
            kernels=device.upload(tail),
            limits=limits,
            first_row=first,
            cell_rows=cell_rows,
            set_columns=layout.set_columns,
        )

    def _extremes(self, band: PsfBand, planes: Buffer, sets: int, over: int) -> np.ndarray:
        """Least and greatest value of the tiles of all column sets (2, sets, tile rows, tile columns), margins included."""
        shape = (2, sets, band.rows // TILE_ROWS, band.layout.set_columns)
        found = self.device.empty(shape, np.float32)
        kernel = self.device.kernel(
            "psf_extremes", {**self.defines, "OVER": over, "SPAN": 1, "TAIL_TAPS": 1}, file="psf_tail.cl"
        )
        self.device.run(kernel, (shape[3], shape[2], sets), None, planes=planes, extremes=found)
        least, greatest = self.device.download(found, shape, np.float32).reshape(*shape[:3], -1, HALF_TILE)
        return np.stack([least.min(axis=-1), greatest.max(axis=-1)])

    def _is_bright(self, band: PsfBand) -> np.ndarray:
        """Whether light above the limit of highlights reaches a tile, in the order of `make_terms`."""
        if self.limits.min() >= UNLIMITED:
            return np.zeros(len(band.tiles), bool)
        greatest = self._extremes(band, self.planes, self.channels * band.layout.column_sets, self.psf.over)[1]
        above = (greatest.reshape(self.channels, -1, *greatest.shape[1:]) > self.limits[:, None, None, None]).any(axis=(0, 1))
        return self._within_reach(band, above, np.maximum)

    def _radius_ranges(self, band: PsfBand) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest blur radius of each tile (2, tiles), and whether its kernels reach other surfaces (tiles,)."""
        assert self.radius is not None  # only corrections ask
        least, greatest = self._extremes(band, self.radius, 2, 1)
        least, greatest = least.min(axis=0), greatest.max(axis=0)
        low, high = self._within_reach(band, least, np.minimum), self._within_reach(band, greatest, np.maximum)
        places = tuple(np.array(band.tiles).T)
        return np.stack([least[places], greatest[places]]), high - low > EDGE_PX

    def _within_reach(self, band: PsfBand, values: np.ndarray, join: np.ufunc) -> np.ndarray:
        """Join the values of all tiles (tile rows, tile columns) that the cores reach from each tile of the frame."""
        reach = -(-self.core_px // TILE_ROWS)
        padded, found = np.pad(values, ((reach, reach), (1, 1)), mode="edge"), values
        for down in range(2 * reach + 1):
            for right in range(3):
                found = join(found, padded[down : down + len(values), right : right + values.shape[1]])
        return found[tuple(np.array(band.tiles).T)]

    def _gather(
        self,
        band: PsfBand,
        kernels: GatherKernels,
        core: Buffer,
        tiles: np.ndarray,
        terms: np.ndarray,
        limits: Buffer,
        light: Buffer,
        is_bright: bool,
        has_steps: bool,
    ) -> None:
        device, mapped = self.device, self.radius is not None
        span = min(device.span, HALF_TILE)
        variant = {
            "TAPS": kernels.taps,
            "FIRST": f"({kernels.first})",
            "SPAN": span,
            "BRIGHT": int(is_bright),
            "TAIL": int(kernels.tail_taps > 0),
            "MAPPED": int(mapped),
            "STEPS": int(has_steps),
            "ADDS": int(mapped),
        }
        device.run(
            device.kernel("psf_gather", {**self.defines, **variant}),
            (HALF_TILE // span, 2 * TILE_ROWS, len(tiles)),
            (HALF_TILE // span, 1, 1),
            planes=self.planes,
            tail=self.tail,
            radius=self.unread if self.radius is None else self.radius,
            light=light,
            tiles=device.upload(tiles),
            terms=device.upload(terms),
            kernels=core,
            limits=limits,
            radii=len(kernels.radii_px),
            edge=EDGE_PX,
            band=band.fields,
        )
