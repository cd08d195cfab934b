"""Executes kernels by distance on the device: each photosite gathers the light of all surfaces in its own colour."""

import math
from collections.abc import Callable, Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.psf_bands import (
    EXTREME_ROWS,
    HALF_TILE,
    STEP_PARTS,
    TILE_ROWS,
    PsfBand,
    join_within,
    node_limits,
    node_rows,
    split_into_bands,
    tile_nodes,
)
from simulator.optics.passes.psf_slab_tiles import BandNodes, Surroundings, make_slab_terms
from simulator.optics.passes.psf_tail import TailKernels, gather_tail
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.slab_kernels import FINEST, MOST_SLABS, slab_kernels_of
from simulator.optics.psf.slab_table import CHUNK_TAPS

ROWS = 8  # of one colour that a work-item gathers, where it has several columns: TILE_ROWS is a multiple of twice as many
UNLIMITED = 1e38  # limit of highlights where there are none


def gather_slabs(optics: OpticsPlan, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the lens.

    planes: a device buffer for each layer, as for `defocused_mosaics`.
    """
    psf, frame = optics.psf, optics.window
    assert psf is not None  # without it this pass does not run
    light = device.empty((frame.height, frame.width), np.float32)
    bands = split_into_bands(frame, psf.gather_reach_px, 1)
    gather = SlabGather(optics, psf, device, planes, bands[0])
    for count, band in enumerate(bands):
        gather.compute(band, light)
        device.finish()
        progress((count + 1) / len(bands))
    return light


class SlabGather:
    """Gathers the bands of a frame; buffers are reused from band to band."""

    def __init__(self, optics: OpticsPlan, psf: FieldPsf, device: Device, planes: Sequence[Buffer], band: PsfBand) -> None:
        assert optics.defocus is not None  # there are several blur radii
        self.projection, self.psf, self.device, self.defocus = optics.projection, psf, device, optics.defocus
        self.radius_projection = optics.radius_projection
        self.channels, self.coverage, self.cfa = optics.channels, int(optics.has_coverage), optics.cfa
        self.kernels = slab_kernels_of(psf, self.channels)
        self.rows = node_rows(band, psf.y_px)
        self.table, self.first_row = self.kernels.lines(self.rows)
        self.lines = device.share(self.table)
        self.planes = planes if self.coverage else planes[:1]
        layout, self.planes_each = band.layout, self.channels + self.coverage
        self.light = device.empty(layout.shape(len(self.planes) * self.planes_each), np.float32)
        self.radius = device.empty(layout.shape(len(self.planes)), np.float32)
        self.maps = [
            device.share(np.ascontiguousarray(px)) if isinstance(px, np.ndarray) else None
            for px in self.defocus.radii_px[: len(self.planes)]
        ]
        self.cell_px = self.kernels.cell_px
        cells = (self.channels, band.rows // self.cell_px, 2 * layout.set_columns // self.cell_px)
        self.cells, self.tail = device.zeros(cells, np.float32), device.zeros(cells, np.float32)
        weights = device.upload(self.kernels.tail)
        self.tail_kernels = TailKernels(weights, self.kernels.tail.shape[-1], self.cell_px)
        self.limits = np.array(psf.highlight_limits) if self.kernels.rings.any() else np.full(self.channels, UNLIMITED)
        own = {"OVER": 1, "CHANNELS": self.channels, "COVERAGE": self.coverage, "LAYERS": len(self.planes)}
        self.defines: dict[str, object] = {**own, "OPAQUE": int(self.defocus.opaque)}

    def compute(self, band: PsfBand, light: Buffer) -> None:
        """Compute the photosites of a band in the mosaic `light`, in place."""
        self._project(band)
        if self.coverage:  # the tail reads what a lens in focus shows, composited in place of the first layer
            kernel = self.device.kernel("psf_composite", self.defines, file="psf_light.cl")
            self.device.run(kernel, band.layout.work_size(1), None, layers=self.light, radius=self.radius)
        one_node = np.concatenate([np.zeros(self.channels + band.rows), np.ones(2 * band.layout.set_columns)])
        limits = self.device.upload(one_node.astype(np.float32))
        defines = {**self.defines, "NODE_ROWS": 1, "NODE_COLUMNS": 1}
        buffers = self.light, self.cells, self.tail
        gather_tail(self.device, defines, band, self.channels, self.tail_kernels, buffers, limits)
        if self.coverage:
            self._project(band)
        rows = node_rows(band, self.psf.y_px)
        self._hold_kernels(rows)
        y_px = self.psf.y_px[self.first_row :]
        numbers, across = node_limits(band, np.r_[self.limits, self.kernels.light], self.psf.x_px, y_px)
        present = tile_nodes(band, across, STEP_PARTS)
        radii_px = self.kernels.radii_px
        finer = min(FINEST, (MOST_SLABS - 1) // (len(radii_px) - 1))
        rings = np.asarray(self.kernels.rings[:, rows].any(axis=1))
        nodes = BandNodes(present, self.kernels.reach_px, self.kernels.first, rings, radii_px, self.kernels.starts, finer)
        bits, above, limits = self._light_bits(band, nodes), self._bright_places(band), self.device.upload(numbers)
        self._place_between_slabs(band)
        around = Surroundings.around(band, bits, nodes)
        even = around.is_even(nodes)
        self._gather(band, around.inside(band, bits, nodes), even, nodes, above, limits, light, has_steps=False)
        self._gather(band, around, ~even, nodes, above, limits, light, has_steps=True)

    def _hold_kernels(self, rows: slice) -> None:
        """Hold the kernels of these node rows on the device."""
        if rows == self.rows:
            return
        self.rows, (table, self.first_row) = rows, self.kernels.lines(rows)
        if table is not self.table:
            self.table, self.lines = table, self.device.share(table)

    def _project(self, band: PsfBand) -> None:
        """Project light and blur radii of all layers onto the band."""
        layout, origin, size = band.layout, (band.x, band.y), int(np.prod(band.layout.shape(1)))
        for layer, (buffer, scene_radius) in enumerate(zip(self.planes, self.maps, strict=True)):
            first = layer * self.planes_each
            project_planes(self.device, self.projection, buffer, self.planes_each, self.light, first, layout, origin)
            if scene_radius is not None:
                project_radius(self.device, self.radius_projection, scene_radius, self.radius, layer, layout, origin)
            else:
                radius_px = np.full(size, self.defocus.radii_px[layer], np.float32)
                self.device.write(self.radius, radius_px, 4 * layer * size)

    def _light_bits(self, band: PsfBand, nodes: BandNodes) -> np.ndarray:
        """Blur radii that have light, by places of `join_within`: (layers, rows, columns) uint64."""
        shape = (len(self.planes), band.rows // EXTREME_ROWS, band.layout.set_columns)
        found, radii_px = self.device.empty(shape, np.uint64), nodes.counted_px.astype(np.float32)
        kernel = self.device.kernel("psf_slab_bits", {**self.defines, "EXTREME_ROWS": EXTREME_ROWS}, file="psf_slab_bits.cl")
        buffers = {"planes": self.light, "radius": self.radius, "radii_px": self.device.upload(radii_px), "slabs": found}
        self.device.run(kernel, (shape[2], shape[1], shape[0]), None, **buffers, radii=len(radii_px))
        return self.device.download(found, shape, np.uint64)

    def _place_between_slabs(self, band: PsfBand) -> None:
        """Turn the blur radii of all layers into places between slabs, in place."""
        radii_px, size = self.kernels.radii_px.astype(np.float32), len(self.planes) * math.prod(band.layout.shape(1))
        kernel = self.device.kernel("psf_slab_places", {**self.defines, "EXTREME_ROWS": EXTREME_ROWS}, file="psf_slab_bits.cl")
        self.device.run(kernel, (size,), None, radius=self.radius, radii_px=self.device.upload(radii_px), radii=len(radii_px))

    def _bright_places(self, band: PsfBand) -> np.ndarray | None:
        """Whether light is above the limit of highlights, by places of `join_within`; None: none is."""
        if self.limits.min() >= UNLIMITED:
            return None
        planes = len(self.planes) * self.planes_each
        shape = (2, 2 * planes, band.rows // EXTREME_ROWS, band.layout.set_columns)
        found = self.device.empty(shape, np.float32)
        kernel = self.device.kernel("psf_extremes", {**self.defines, "EXTREME_ROWS": EXTREME_ROWS}, file="psf_extremes.cl")
        self.device.run(kernel, (shape[3], shape[2], shape[1]), None, planes=self.light, extremes=found)
        greatest = self.device.download(found, shape, np.float32)[1].reshape(-1, self.planes_each, 2, *shape[2:])
        above = greatest[:, : self.channels] > self.limits[:, None, None, None]
        places = np.asarray(above.any(axis=(0, 1, 2)))
        return places if places.any() else None

    def _gather(
        self,
        band: PsfBand,
        around: Surroundings,
        selected: np.ndarray,
        nodes: BandNodes,
        above: np.ndarray | None,
        limits: Buffer,
        light: Buffer,
        *,
        has_steps: bool,
    ) -> None:
        """Gather the selected parts (tiles, parts), those beside highlights apart."""
        bright = np.zeros(selected.shape, bool)
        if above is not None and selected.any():
            for reach_px in np.unique(around.reach_px[selected]).tolist():
                bright |= join_within(band, above, np.maximum, reach_px, STEP_PARTS) & (around.reach_px == reach_px)
            bright &= nodes.has_ringing(around.held)
        for is_bright in (False, True):
            chosen = selected & (bright == is_bright)
            if chosen.any():
                self._launch(band, *make_slab_terms(band, around, chosen, nodes), nodes, limits, light, is_bright, has_steps)

    def _launch(
        self,
        band: PsfBand,
        tiles: np.ndarray,
        terms: np.ndarray,
        nodes: BandNodes,
        limits: Buffer,
        light: Buffer,
        is_bright: bool,
        has_steps: bool,
    ) -> None:
        device, columns, rows = self.device, HALF_TILE // STEP_PARTS, 1
        span = min(device.span, columns)
        variant = {"REACH": int(nodes.reach_px.max()), "SPAN": span, "BRIGHT": int(is_bright), "CELL": self.cell_px}
        variant["CHUNK"] = CHUNK_TAPS
        name = "psf_slabs" if has_steps else "psf_own_slabs"
        if has_steps:
            rows = ROWS if span > 1 else 1
            variant |= {"HISTORY": nodes.history, "NODE_SPAN": int(terms["columns"].max()), "ROWS": rows}
        device.run(
            device.kernel(name, {**self.defines, **variant}, file=f"{name}.cl"),
            (columns // span, 2 * TILE_ROWS // rows, len(tiles)),
            (columns // span, 1, 1),
            planes=self.light,
            slab_place=self.radius,
            tail=self.tail,
            light=light,
            tiles=device.upload(tiles),
            terms=device.upload(terms),
            kernels=self.lines,
            limits=limits,
            halves=self.table[0].size,
            line=self.kernels.elements,
            band=band.fields(self.channels, self.cfa),
        )
