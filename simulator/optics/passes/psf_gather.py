"""Executes a planned point spread function on the device: each photosite gathers light in its own colour."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.defocused_mosaic import defocused_mosaics
from simulator.optics.passes.psf_bands import (
    EXTREME_ROWS,
    HALF_TILE,
    STEP_PARTS,
    TILE_ROWS,
    PsfBand,
    join_extremes,
    join_within,
    make_terms,
    node_limits,
    split_into_bands,
    tile_nodes,
)
from simulator.optics.passes.psf_tail import TailKernels, gather_tail
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.gather_kernels import GatherKernels, corrections_of, gather_kernels_of
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

BLUR_SHARE = 0.7  # of the progress, where the geometric blur comes first
EDGE_PX = 1.0  # difference in blur radius above which light comes from another surface
TERMS_TOGETHER = 2  # kernels of corrections that read the light once: a blur radius lies between two
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
        psf, channels = self.optics.psf, self.optics.channels
        assert psf is not None  # without it this pass does not run
        projection = psf.sampled(self.optics.projection)
        project_planes(self.device, projection, self.scene, channels, planes, 0, band.layout, (band.x, band.y))


@dataclass(frozen=True)
class BlurredLight:
    """The light behind the geometric blur. mosaics: of a window, (colors, height, width) float32. colors: planes, adjacent."""

    device: Device
    window: Window
    mosaics: Buffer
    colors: Sequence[int]

    def fill(self, band: PsfBand, planes: Buffer) -> None:
        """Copy the band from the mosaics of all colours."""
        self.device.run(
            self.device.kernel("psf_interleave", LIGHT_DEFINES, file="psf_light.cl"),
            (band.layout.set_columns, band.layout.rows, 2 * len(self.colors)),
            None,
            mosaics=self.mosaics,
            planes=planes,
            first_color=self.colors[0],
            mosaic_columns=self.window.width,
            mosaic_rows=self.window.height,
            shift_x=self.window.x - band.x,
            shift_y=self.window.y - band.y,
        )


@dataclass(frozen=True)
class SharpLight:
    """The light of all layers as if nothing were out of focus, and the blur radius of the surface that each photosite sees.

    planes: as for `defocused_mosaics`. blur: holds the layers' blur radii. layers, radius: buffers for a band.
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
                project_radius(device, self.optics.radius_projection, scene_radius, self.radius, layer, layout, origin)
                maps += 1
            else:
                device.fill(self.radius, np.float32(radius_px), 4 * layer * math.prod(layout.shape(1)))  # later layers follow
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
    gathers = [BandGather(optics, psf, gather_kernels_of(psf, optics.channels), device, bands[0], source)]
    if blur is not None:
        first = BLUR_SHARE
        gathers = [*_corrections(optics, psf, blur, device, planes, bands[0]), *gathers]
    _gather_bands(device, gathers, bands, light, lambda share: progress(first + (1.0 - first) * share))
    return light


def gather_corrections(optics: OpticsPlan, blur: TilePlan, device: Device, planes: Sequence[Buffer]) -> Buffer | None:
    """Device buffer (height, width) float32: what wave optics add to a geometric blur and a kernel in focus; None: nothing.

    It may be negative. Arguments of `psf_mosaic`.
    """
    psf, frame = optics.psf, optics.window
    assert psf is not None  # without it this pass does not run
    bands = split_into_bands(frame, psf.gather_reach_px, psf.over)
    gathers = _corrections(optics, psf, blur, device, planes, bands[0])
    if not gathers:
        return None
    light = device.zeros((frame.height, frame.width), np.float32)
    _gather_bands(device, gathers, bands, light, lambda _: None)
    return light


def _gather_bands(
    device: Device, gathers: "Sequence[BandGather]", bands: Sequence[PsfBand], light: Buffer, progress: Callable[[float], None]
) -> None:
    """Add what all gather to the mosaic `light`, band by band."""
    for gather in gathers:
        gather.prepare(bands[0])
    wait_for_last: Callable[[], object] = device.finish
    for count, band in enumerate(bands):
        for gather in gathers:
            gather.add(band, light)
            if count + 1 < len(bands):
                gather.prepare(bands[count + 1])
        wait_for_this = device.mark()
        if count > 0:
            wait_for_last()
            progress(count / len(bands))
        wait_for_last = wait_for_this
    wait_for_last()
    progress(1.0)


def _source(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Source:
    if blur is None:
        return ProjectedLight(optics, device, planes[0])
    colors = optics.cfa.colors
    mosaics = defocused_mosaics(blur, [Cfa.uniform(plane) for plane in colors], device, list(planes), progress)
    return BlurredLight(device, blur.optics.window, mosaics, colors)


def _corrections(
    optics: OpticsPlan, psf: FieldPsf, blur: TilePlan, device: Device, planes: Sequence[Buffer], band: PsfBand
) -> "list[BandGather]":
    """What gathers the corrections to wave optics from the sharp light of all layers; empty where nothing is corrected."""
    kernels = corrections_of(psf, optics.channels)
    if not kernels:
        return []
    layers = len(planes) if optics.has_coverage else 1
    light = device.empty(band.layout.shape(layers * (optics.channels + optics.has_coverage)), np.float32)
    radius = device.empty(band.layout.shape(layers), np.float32)
    return [BandGather(optics, psf, kernels, device, band, SharpLight(optics, device, planes, blur, light, radius))]


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
        self.cfa = optics.cfa
        layout, self.unread = band.layout, device.zeros((1,), np.float32)
        sharp = source if isinstance(source, SharpLight) else None
        self.radius = None if sharp is None else sharp.radius
        self.greatest: Callable[[], np.ndarray] | None = None  # of the band that is prepared, as `radius_range`
        self.radius_range: Callable[[], np.ndarray] | None = None
        self.together = 1 if sharp is None else TERMS_TOGETHER
        self.planes = device.zeros(layout.shape(self.channels), np.float32) if sharp is None else sharp.layers
        cell_px = max(kernels.cell_px for kernels in every)
        cells = (self.channels, band.rows // cell_px, 2 * layout.set_columns // cell_px) if cell_px else (1,)
        self.cells, self.tail = device.zeros(cells, np.float32), device.zeros(cells, np.float32)
        self.core = [device.upload(kernels.core) for kernels in every]
        rings = any(kernels.rings for kernels in every) and psf.highlight_limits
        self.limits = np.array(psf.highlight_limits) if rings else np.full(self.channels, UNLIMITED)
        rows, columns = psf.nodes
        self.defines: dict[str, object] = {
            "OVER": psf.over,
            "CHANNELS": self.channels,
            "NODE_ROWS": rows,
            "NODE_COLUMNS": columns,
        }

    def prepare(self, band: PsfBand) -> None:
        """Enqueue the light of a band and what the host must know of it to list its tiles.

        The host lists the tiles of a source while the device gathers from another.
        """
        self.source.fill(band, self.planes)
        self.greatest = self.radius_range = None
        if self.limits.min() < UNLIMITED:
            self.greatest = self._extremes(band, self.planes, self.channels * band.layout.column_sets, self.psf.over)
        if self.radius is not None:
            self.radius_range = self._extremes(band, self.radius, 2, 1)

    def add(self, band: PsfBand, light: Buffer) -> None:
        """Add the light of the band that was prepared last to the mosaic `light`, in place."""
        numbers, across = node_limits(band, self.limits, self.psf.x_px, self.psf.y_px)
        limits = self.device.upload(numbers)
        above, present, radii = self._bright_places(), tile_nodes(band, across)[:, 0], self._radius_extremes()
        for kernels, core in zip(self.every, self.core, strict=True):
            if kernels.tail is not None:
                own = TailKernels(self.device.upload(kernels.tail), kernels.tail_taps, kernels.cell_px)
                buffers = self.planes, self.cells, self.tail
                gather_tail(self.device, self.defines, band, self.channels, own, buffers, limits)
            wide = np.ones(len(present), bool)
            if radii is not None:
                wide = ~self._has_steps(band, radii, kernels, 1)[:, 0]
            self._gather_parts(band, kernels, core, (above, present, radii), 1, wide, limits, light)
            if not wide.all():  # smaller parts reach fewer surfaces
                self._gather_parts(band, kernels, core, (above, present, radii), STEP_PARTS, ~wide, limits, light)

    def _has_steps(self, band: PsfBand, radii: np.ndarray, kernels: GatherKernels, parts: int) -> np.ndarray:
        """Whether the kernels of a part of a tile reach several surfaces, (tiles, parts)."""
        least, greatest = join_extremes(band, radii, kernels.reach_px, parts)
        return np.asarray(greatest - least > EDGE_PX)

    def _gather_parts(
        self,
        band: PsfBand,
        kernels: GatherKernels,
        core: Buffer,
        found: tuple[np.ndarray | None, np.ndarray, np.ndarray | None],
        parts: int,
        wanted: np.ndarray,
        limits: Buffer,
        light: Buffer,
    ) -> None:
        """Gather the wanted tiles (tiles,) in so many parts side by side.

        found: of the band, `_bright_places`, `tile_nodes` of whole tiles and `_radius_extremes`.
        """
        above, present, radii = found
        tiles, terms = make_terms(
            band,
            present,
            kernels.radii_px,
            kernels.kept,
            None if radii is None else join_extremes(band, radii, 0, parts),
            self.together,
        )
        bright = steps = np.zeros(tiles.shape[:2], bool)
        if above is not None:
            bright = join_within(band, above, np.maximum, kernels.reach_px, parts)
        if radii is not None and parts > 1:
            steps = self._has_steps(band, radii, kernels, parts)
        for is_bright, has_steps in itertools.product((False, True), repeat=2):
            selected = tiles[(bright == is_bright) & (steps == has_steps) & (tiles[..., 3] > 0) & wanted[:, None]]
            if len(selected):
                self._gather(band, kernels, core, selected, HALF_TILE // parts, terms, limits, light, is_bright, has_steps)

    def _extremes(self, band: PsfBand, planes: Buffer, sets: int, over: int) -> Callable[[], np.ndarray]:
        """What returns least and greatest value (2, sets, groups of EXTREME_ROWS rows, columns of a set), margins included."""
        shape = (2, sets, band.rows // EXTREME_ROWS, band.layout.set_columns)
        found = self.device.empty(shape, np.float32)
        defines = {**self.defines, "OVER": over, "EXTREME_ROWS": EXTREME_ROWS}
        kernel = self.device.kernel("psf_extremes", defines, file="psf_extremes.cl")
        self.device.run(kernel, (shape[3], shape[2], sets), None, planes=planes, extremes=found)
        return self.device.download_later(found, shape, np.float32)

    def _bright_places(self) -> np.ndarray | None:
        """Whether light is above the limit of highlights, by places of `join_within`; None: none is."""
        if self.greatest is None:
            return None
        greatest = self.greatest()[1]
        above = greatest.reshape(self.channels, -1, *greatest.shape[1:]) > self.limits[:, None, None, None]
        found = np.asarray(above.any(axis=(0, 1)))
        return found if found.any() else None

    def _radius_extremes(self) -> np.ndarray | None:
        """Least and greatest blur radius, (2, rows, columns) by places of `join_within`; None: one kernel for all radii."""
        if self.radius_range is None:
            return None
        least, greatest = self.radius_range()
        return np.stack([least.min(axis=0), greatest.max(axis=0)])

    def _gather(
        self,
        band: PsfBand,
        kernels: GatherKernels,
        core: Buffer,
        tiles: np.ndarray,
        columns: int,
        terms: np.ndarray,
        limits: Buffer,
        light: Buffer,
        is_bright: bool,
        has_steps: bool,
    ) -> None:
        device, mapped = self.device, self.radius is not None
        span = min(device.span, columns)
        variant = {
            "TAPS_Y": kernels.taps[0],
            "TAPS_X": kernels.taps[1],
            "HELD_Y": kernels.core.shape[-2],
            "HELD_X": kernels.core.shape[-1],
            "FOLD_Y": int(kernels.folded[0]),
            "FOLD_X": int(kernels.folded[1]),
            "TOGETHER": 1 if is_bright else self.together,  # compilers do not vectorise two sums of both parts of the light
            "FIRST_Y": f"({kernels.first[0]})",
            "FIRST_X": f"({kernels.first[1]})",
            "SPAN": span,
            "BRIGHT": int(is_bright),
            "CELL": kernels.cell_px,
            "MAPPED": int(mapped),
            "STEPS": int(has_steps),
            "ADDS": int(mapped or kernels is not self.every[-1]),
        }
        device.run(
            device.kernel("psf_gather", {**self.defines, **variant}),
            (columns // span, 2 * TILE_ROWS, len(tiles)),
            (columns // span, 1, 1),
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
            band=band.fields(self.channels, self.cfa),
        )
