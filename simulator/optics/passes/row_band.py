"""A band of rows with its margins on the device, and the kernels that blur it."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.aperture_samples import (
    correction_agrees,
    correction_count,
    fewest_samples,
    has_relaxed,
    most_samples,
    move_samples,
    sample_count,
)
from simulator.optics.defocus.defocus import (
    BLOCK_COLUMNS,
    BLOCK_ROWS,
    NODES_PER_PX,
    TILE_COLUMNS,
    TILE_ROWS,
    Method,
)
from simulator.optics.defocus.radius_slabs import SLAB_GROUP, BlockChoice, SlabLists
from simulator.optics.defocus.tile_methods import ROWS_IN_TILE, TileChoice, each_block
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.passes.device_tables import DeviceTables
from simulator.optics.passes.highlight_pass import HighlightPass
from simulator.optics.passes.patch_windows import PatchWindows, map_numbers
from simulator.optics.passes.tile_grid import BAND_ROWS, HALF_TILE, MARGIN_COLUMNS, BandRows
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.camera.cfa import Cfa

MOST_TOGETHER = 3  # mosaics that a launch makes: kernels/occlusion.cl, kernels/defocus.cl
SMALL_PX = 1 << 20  # photosites of a window whose rays are not worth two seconds of compilers' time to be a twentieth faster
NO_NODES = {"NODES_PER_PX": "1.0f", "LINEAR_NODES": "1.0f"}  # macros of kernels/aperture_mean.h where no radius is interpolated


@dataclass(frozen=True)
class Mosaics:
    """Mosaics that are made: their colour filters, and device buffers (mosaics, height, width) float32.

    light: electron radiance [e- s^-1 um^-2 sr^-1]. open: share of light that the layers composited so far let through.
    """

    cfas: Sequence[Cfa]
    light: Buffer
    open: Buffer

    def launches(self) -> list[range]:
        """Mosaics that each launch makes: one, or up to MOST_TOGETHER of one colour each whose planes follow one another."""
        found: list[range] = []
        for number in range(len(self.cfas)):
            first = found[-1].start if found else number
            plane, cfas = self.cfas[first].colors[0], self.cfas[first : number + 1]
            follows = list(cfas) == [Cfa.uniform(plane + count) for count in range(len(cfas))]
            if found and follows and len(cfas) <= MOST_TOGETHER:
                found[-1] = range(first, number + 1)
            else:
                found.append(range(number, number + 1))
        return found


class BlockSlabs:
    """Slabs of the blocks of a band.

    blocks: mask of the band's blocks that have a list. buffer: all lists on the device, as `slabs` of kernels/occlusion.cl.
    """

    def __init__(self, blocks: np.ndarray, buffer: Buffer, lists: SlabLists) -> None:
        self.blocks, self.buffer, self.mapped = blocks, buffer, lists.mapped
        self._first, self._count = lists.first, lists.count

    def number(self, some: np.ndarray) -> np.ndarray:
        """Number of each of some blocks (a mask) among those that have a list."""
        return np.flatnonzero(some[self.blocks])

    def ranges(self, some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """First slab of some blocks (a mask), and their number of slabs."""
        number = self.number(some)
        return self._first[number], self._count[number]

    def are_pairs(self, some: np.ndarray) -> np.ndarray:
        """Which of some blocks (a mask) see two layers of one radius each."""
        number = self.number(some)
        return (self._count[number] == 2) & ~self.mapped[number]


class RowBand:
    """A row band with its margins, at so many samples per photosite and axis, in device buffers, and the passes over them.

    Mosaics of several colours share all that does not depend on the colour: projection, sums, and lists of slabs.
    buffers: planes, running sums and radii (`band_sizes`), which bands at other numbers of samples use, too, after one another.
    """

    def __init__(
        self,
        tiles: TilePlan,
        mosaics: Mosaics,
        device: Device,
        tables: DeviceTables,
        planes: list[Buffer],
        buffers: tuple[Buffer, Buffer, Buffer],
    ) -> None:
        samples_per_axis, area, maps = tables.samples_per_axis, tiles.area, tiles.maps
        self.tiles, self.device, self.area, self.maps, self.chosen = tiles, device, area, maps, tiles.chosen
        self.projection, self.defocus = tiles.optics.projection, tiles.defocus
        self.tables, self.planes, self.mosaics, self.launches = tables, planes, mosaics, mosaics.launches()
        self.samples_per_axis, self.layout = samples_per_axis, tables.layout
        self.channels, self.coverage = tiles.optics.channels, int(tiles.optics.has_coverage)
        self.partial = [layer.coverage is not None for layer in tiles.optics.scene.layers]
        self.layer_planes = self.channels + self.coverage
        self.sampled, self.sums, self.radius = buffers
        # A work-item computes 16 columns and 4 rows of 2 x 2 photosites on CPUs, and one of them on GPUs, which need many.
        self.block_size = (1, 1) if device.span == 1 else (BLOCK_COLUMNS // 2, BLOCK_ROWS // 2)
        held: dict[str, object] = {"OVER": samples_per_axis, "COVERAGE": self.coverage}
        sizes = {"TILE_COLUMNS": TILE_COLUMNS, "BLOCK_COLUMNS": BLOCK_COLUMNS, "BLOCK_ROWS": BLOCK_ROWS}
        self.defines: dict[str, object] = {**held, **sizes, "SLAB_GROUP": SLAB_GROUP, "SPAN": device.span}
        self.windows = PatchWindows(device, self.layout, self.defocus, held)

    def _node_defines(self, per_px: int) -> dict[str, str]:
        """Macros of kernels/aperture_mean.h for so many tabulated radii per photosite of radius."""
        over = self.samples_per_axis
        unblurred = per_px if per_px == NODES_PER_PX else per_px // 2  # the circle leaves its photosite at a radius of a half
        linear = 1 if self.defocus.area.has_squares(over) else unblurred if over == 1 else 0
        return {"NODES_PER_PX": f"{per_px}.0f", "LINEAR_NODES": f"{linear}.0f"}

    def compute(self, band: int) -> None:
        """Compute one band of rows of the mosaics, in place."""
        rows = self.area.band_rows(band, whole=self.tables.whole)
        chosen = self.chosen.part(rows.tiles, self.samples_per_axis)
        if not chosen.computed.any():
            return
        self._project_planes(rows)
        slabs = self._list_slabs(chosen)
        if slabs.mapped.any() or (self.tiles.highlight_limit is not None and slabs.blocks.any()):
            self._project_radius(rows)
        # A spot is added to every block whose means and samples are made without its light, and to no other.
        corrected = chosen.tiles_with(Method.CORRECTED)
        lamps = self._find(self.tiles.lamp_limit, slabs, each_block(chosen.computed), rows, lamps=True)
        if lamps is not None:
            lamps.take()
        some = chosen.blocks.sampled() | each_block(corrected)
        highlights = self._find(self.tiles.highlight_limit, slabs, some, rows, lamps=False)
        self._compute_means(chosen if highlights is None else chosen.without(corrected), rows)
        if highlights is not None:
            highlights.take()
            self._compute_means(chosen.without(~corrected), rows)
        self._sample_aperture(chosen.blocks, slabs, rows)
        for found in (lamps, highlights):
            if found is not None and not self.tiles.only_covariance:
                made = [self._row_band(rows, number) for number in range(len(self.mosaics.cfas))]
                found.spread(slabs.buffer, self.mosaics.light, made)

    def _list_slabs(self, chosen: TileChoice) -> "BlockSlabs":
        """List the slabs of the blocks that sample the aperture or may get spots."""
        blocks = chosen.blocks.sampled()
        if self.tiles.lamp_limit is not None:
            blocks = each_block(chosen.computed)
        elif self.tiles.highlight_limit is not None:
            blocks = blocks | each_block(chosen.tiles_with(Method.CORRECTED))
        if not blocks.any():
            return BlockSlabs(blocks, self.mosaics.open, SlabLists(*np.zeros((4, 0), int)))
        lists = self.tables.slab_lists(chosen.blocks.present[:, blocks], chosen.blocks.even_px[:, blocks])
        return BlockSlabs(blocks, self.device.upload(lists.in_groups()), lists)

    def _find(
        self, limit: np.ndarray | None, slabs: "BlockSlabs", blocks: np.ndarray, rows: BandRows, *, lamps: bool
    ) -> HighlightPass | None:
        """Highlights of the band; None: it has none, or no block to which their spots are added.

        All are taken out, also those that reach no block of this frame, so that a crop has the running sums of the whole frame.
        blocks: mask of the blocks that spots are added to. The other arguments are those of `HighlightPass`.
        """
        if limit is None or not blocks.any():
            return None
        places = self._places(rows, blocks, BLOCK_ROWS, BLOCK_COLUMNS, *slabs.ranges(blocks))
        found = HighlightPass(self, rows.first, places, limit, lamps=lamps)
        return found if found.any else None

    def _row_band(self, rows: BandRows, number: int = 0) -> dict[str, int]:
        """Fields of `struct row_band` of kernels/row_band.h for a band. number: of the first mosaic that is made."""
        area, frame = self.area, self.area.frame
        return {
            "sample_rows": self.layout.rows,
            "set_columns": self.layout.set_columns,
            "frame_x": area.x - frame.x,
            "frame_y": rows.first - frame.y,
            "width": frame.width,
            "height": frame.height,
            "light_row": number * frame.height,
            "channels": self.channels,
            "cfa": self.mosaics.cfas[number].packed(frame.x, frame.y),
        }

    def _project_planes(self, rows: BandRows) -> None:
        """Project all layers onto the band's samples."""
        count, written = self.layer_planes, self._sample_rows(rows)
        for layer, planes in enumerate(self.planes):
            first, origin = layer * count, self._origin(layer, rows)
            project_planes(self.device, self.projection, planes, count, self.sampled, first, self.layout, origin, written)

    def _sample_rows(self, rows: BandRows) -> int:
        return self.samples_per_axis * rows.count

    def _origin(self, layer: int, rows: BandRows) -> tuple[int, int]:
        """Photosite of the sensor, x and y, at which a layer at rest is read for the first sample of a band."""
        right, down = self.defocus.aside_px(layer)
        return self.area.x + right, rows.first + down

    def _compute_means(self, chosen: TileChoice, rows: BandRows) -> None:
        """Compute the means of all layers, nearest first."""
        for layer in range(len(self.planes)):
            self._compute_layer(chosen, layer, rows)

    def _compute_layer(self, chosen: TileChoice, layer: int, rows: BandRows) -> None:
        """Compute a layer's tiles: copied, averaged over the aperture's image, or composited behind nearer layers."""
        here = chosen.visible[layer]
        copied, mean = (here & chosen.tiles_with(method) for method in (Method.COPY, Method.MEAN))
        composite = here & chosen.tiles_with(Method.COMPOSITE, Method.CORRECTED)
        clipped_tiles = (chosen.zone >= 0) & ~copied
        if any(map(self.tables.reads_sums, np.unique(clipped_tiles[mean | composite]).tolist())):
            planes = self.channels + int(composite.any())
            span = min(self.device.span, MARGIN_COLUMNS)  # divides the columns of any window
            own = {"NODES": 0, "COMPOSITE": 0, "ZONE": 0, "SPAN": span, "COLORS": 1}
            defines: dict[str, object] = {**self.defines, **own, **NO_NODES}
            kernel = self.device.kernel("defocus_sums", defines, file="defocus.cl")
            size = (self.layout.set_columns // span, self.layout.column_sets * planes)
            buffers = {
                "sampled": self.sampled,
                "sums": self.sums,
                "first_plane": layer * self.layer_planes,
            }
            self.device.run(kernel, size, None, **buffers, band=self._row_band(rows))
        constant = chosen.constant[layer]
        for graded, several, selected in (
            (0, 0, copied | mean & constant),
            (1, 0, mean & ~constant),
            (0, 1, composite & constant),
            (1, 1, composite & ~constant),
        ):
            for clipped, coarse in itertools.product((False, True), repeat=2):
                tiles = selected & (clipped_tiles == clipped) & (chosen.coarse[layer] == coarse)
                if tiles.any():
                    per_px = NODES_PER_PX if coarse else self.defocus.nodes_per_px
                    variant = {"NODES": graded, "COMPOSITE": several, **(self._node_defines(per_px) if graded else NO_NODES)}
                    images = np.where(copied, 0, chosen.images[layer])
                    self._run_mean(chosen, layer, tiles, images, variant, clipped, rows)

    def _run_mean(
        self,
        chosen: TileChoice,
        layer: int,
        selected: np.ndarray,
        images: np.ndarray,
        variant: dict[str, object],
        clipped: bool,
        rows: BandRows,
    ) -> None:
        table, numbers = self.tables.of_tiles(clipped)
        zone_defines = self.tables.defines(clipped)
        defines = {**self.defines, **variant, **zone_defines}
        spans, first = HALF_TILE // zone_defines["SPAN"], numbers[chosen.first_image[layer]]
        surface = {
            "first_plane": layer * self.layer_planes,
            "map": max(map_numbers(self.defocus.radii_px)[layer], 0),
            "map_rows": self.area.rows,
            "map_row": (rows.first - self.area.y) % 2**32,  # wraps where the band begins above the map; rows in it do not
            "zone_row": -rows.first % BAND_ROWS,
        }
        places = self._places(rows, selected, TILE_ROWS, TILE_COLUMNS, first, images)
        listed = self.device.upload(np.column_stack([places, chosen.left_out()[selected]]).astype(np.uint32))
        corners = self.tables.corners(chosen.zone[selected] if clipped else None)
        for launch in self.launches:
            cfa = self.mosaics.cfas[launch.start]
            variant = {"COLORS": len(launch)}
            self.device.run(
                self.device.kernel("defocus_mean", {**defines, **variant}, file="defocus.cl"),
                (spans, 2 * TILE_ROWS, int(selected.sum())),
                (spans, 1, 1),
                sampled=self.sampled,
                sums=self.sums,
                radius=self.maps.radius,
                light=self.mosaics.light,
                open=self.mosaics.open,
                tiles=listed,
                corners=corners,
                surface={**surface, "first_color": cfa.colors[0]},
                band=self._row_band(rows, launch.start),
                **table,
            )

    def _sample_aperture(self, chosen: BlockChoice, slabs: "BlockSlabs", rows: BandRows) -> None:
        """Compute the blocks where surfaces occlude each other."""
        sampled = chosen.sampled()
        if not sampled.any():
            return
        places = self._places(rows, sampled, BLOCK_ROWS, BLOCK_COLUMNS, *slabs.ranges(sampled))
        corrected = chosen.methods[sampled] == Method.CORRECTED
        points, largest = sample_count(chosen.largest_px[sampled], self.defocus), chosen.largest_px[sampled]
        points = np.where(
            corrected, correction_count(points, self.samples_per_axis, self.defocus), most_samples(largest, self.defocus)
        )
        down, right = np.nonzero(sampled)
        corners, shares = self.tables.around_blocks(rows.tiles.start * ROWS_IN_TILE + down, right)
        of_pairs = corrected & slabs.are_pairs(sampled)
        if not of_pairs.all():
            self.windows.measure(self.sampled, self.radius, self._row_band(rows), self._sample_rows(rows))
        kinds = np.stack([points, corrected, corners[:, 0] >= 0, of_pairs])
        for kind in np.unique(kinds, axis=1).T:
            selected = (kinds == kind[:, None]).all(axis=0)
            around = corners[selected], shares[selected]
            run = self._run_occlusion if self.defocus.motion is None else self._run_moving
            run(kind.tolist(), places[selected], around, slabs.buffer, self._row_band(rows))

    def _run_occlusion(
        self,
        kind: list[int],
        places: np.ndarray,
        around: tuple[np.ndarray, np.ndarray],
        slabs: Buffer,
        row_band: dict[str, int],
    ) -> None:
        """Run kernels/occlusion.cl on blocks of one kind.

        kind: number of aperture samples, whether they compute a correction, whether they are the block's own, and whether two
        layers of one radius each are seen.
        places: (blocks, 4) of `_places`. around: of `Zones.around_blocks`. row_band: fields of `struct row_band`.
        """
        number, correction, clipped, is_pair = kind
        relaxed = bool(correction and has_relaxed(self.samples_per_axis, self.defocus))
        points = self.tables.points(number, around if clipped else None, relaxed=relaxed)
        blocks = np.column_stack([places, number * clipped * np.arange(len(places))])
        self._launch_occlusion((number, correction, is_pair), blocks, BLOCK_ROWS, points, slabs, row_band)

    def _run_moving(
        self,
        kind: list[int],
        places: np.ndarray,
        around: tuple[np.ndarray, np.ndarray],
        slabs: Buffer,
        row_band: dict[str, int],
    ) -> None:
        """Run kernels/occlusion.cl on blocks whose images move. Blocks in one cell of `JointMotion` share their points.

        The arguments are those of `_run_occlusion`. Blocks are cut where cells have fewer rows.
        """
        motion = self.defocus.motion
        assert motion is not None  # else nothing moves
        number, clipped, frame = kind[0], kind[2], self.area.frame
        cells = motion.cells(BLOCK_COLUMNS, BLOCK_ROWS)
        height = min(cells.rows, BLOCK_ROWS)
        parts = BLOCK_ROWS // height
        blocks = np.repeat(places.astype(int), parts, axis=0)
        blocks[:, 1] += height * np.tile(np.arange(parts), len(places))
        x, y = 2 * blocks[:, 0] + row_band["frame_x"] + frame.x, blocks[:, 1] + row_band["frame_y"] + frame.y
        cell, middles = motion.cells_of(x, y, cells)
        keys = np.stack([*cell, clipped * np.arange(len(x))])  # where rims clip the pupil a block has points of its own
        _, first, index = np.unique(keys, axis=1, return_index=True, return_inverse=True)
        corners, shares = (np.repeat(part, parts, axis=0)[first] for part in around)
        samples, instants = self.tables.moving_points(number, (corners, shares) if clipped else None)
        points = move_samples(samples, instants, motion, middles[first], cells)
        blocks = np.column_stack([blocks, len(self.planes) * number * index.reshape(-1)]).astype(np.uint32)
        if cells.points == "places":
            from_middle = np.column_stack([x, y]) + 0.5 - middles
            blocks = np.column_stack([blocks, from_middle.astype(np.float32).view(np.uint32)])
        self._launch_occlusion((number, 0, 0), blocks, height, points, slabs, row_band)

    def _launch_occlusion(
        self,
        kind: tuple[int, int, int],
        blocks: np.ndarray,
        block_rows: int,
        points: np.ndarray,
        slabs: Buffer,
        row_band: dict[str, int],
    ) -> None:
        """Launch kernels/occlusion.cl, or kernels/layer_covariance.cl for the correction of two layers of one radius each.

        kind: number of aperture samples, whether they compute a correction, and whether of a pair. blocks, points: as
        there. block_rows: of a block; fewer where cells have fewer rows.
        """
        number, correction, is_pair = kind
        span, rows = self.block_size
        rows = max(rows * block_rows // BLOCK_ROWS, 1)
        size = (BLOCK_COLUMNS // 2 // span, block_rows // 2 // rows, len(blocks))
        variant = {
            "LAYERS": len(self.planes),
            "CORRECTION": correction,
            "SPAN": span,
            "ROWS": rows,
            "UNROLLED": rows if self.area.frame.width * self.area.frame.height > SMALL_PX else 1,
            "WORKERS": size[0] * size[1],
            "MOTION": int(self.defocus.motion is not None),
            "GROWS": int(points.shape[-1] == 9),
            "TURNS": int(points.shape[-1] == 17),
            "LAMPS": int(points.shape[-1] > 5 and self.defocus.accuracy.has_lamps),
            **self.windows.macros,
        }
        variant["OPAQUE"] = int(not correction and not any(self.partial[:-1]))
        stricter = correction_agrees(self.samples_per_axis, self.defocus) ** 2 if correction else 1.0
        slope, offset = (stricter * part for part in self.defocus.accuracy.allowed_disagreement(self.defocus.guessed))
        sampling = {
            "patch_rows": self.windows.rows,
            "point_count": number,
            "least": fewest_samples(number, bool(correction), self.samples_per_axis, self.defocus),
            "normalise": int(self.defocus.opaque),
            "brightest": self.defocus.accuracy.brightest or np.finfo(np.float32).max,
            "slope": slope,
            "offset": offset,
        }
        places, samples = self.device.upload(blocks.astype(np.uint32)), self.device.upload(points)
        frame, name = self.area.frame, "layer_covariance" if is_pair else "occlusion"
        seen = {} if is_pair else {"radius": self.radius, "windows": self.windows.windows}
        for launch in self.launches:
            cfa = self.mosaics.cfas[launch.start]
            made = {"light_row": launch.start * frame.height, "cfa": cfa.packed(frame.x, frame.y)}
            self.device.run(
                self.device.kernel(name, {**self.defines, **variant, "COLORS": len(launch)}),
                size,
                (*size[:2], 1),
                planes=self.sampled,
                blocks=places,
                slabs=slabs,
                points=samples,
                sampling={**sampling, "first_color": cfa.colors[0]},
                light=self.mosaics.light,
                band={**row_band, **made},
                **seen,
            )

    def _project_radius(self, rows: BandRows) -> None:
        """Project the radius maps onto the band's samples; at one sample per photosite copy them from the area's maps."""
        if self.samples_per_axis == 1:
            self._copy_radius(rows)
            return
        written, moved = self._sample_rows(rows), self.tiles.optics.radius_projection
        for layer, number in enumerate(map_numbers(self.defocus.radii_px)):
            if number >= 0:
                scene_radius, origin = self.maps.scene_radius[number], self._origin(layer, rows)
                project_radius(self.device, moved, scene_radius, self.radius, number, self.layout, origin, written)

    def _copy_radius(self, rows: BandRows) -> None:
        """Copy the band's rows of the radius maps; no blur circle of the frame reaches rows outside the area."""
        above = rows.first - self.area.y
        begin, end = max(above, 0), min(above + rows.count, self.area.rows)
        row_bytes = 4 * self.layout.set_columns
        for plane in range(self.defocus.maps * self.layout.column_sets):
            source = (plane * self.area.rows + begin) * row_bytes
            target = (plane * self.layout.rows + begin - above) * row_bytes
            self.device.copy(self.maps.radius, self.radius, source, target, (end - begin) * row_bytes)

    def _places(
        self, band: BandRows, selected: np.ndarray, rows: int, columns: int, first: np.ndarray, count: np.ndarray
    ) -> np.ndarray:
        """Positions and list ranges of tiles or blocks: (places, 4) uint32.

        Column within its set and row of the first photosite in the band, first entry and number of entries of the list.
        selected: mask of the band's tiles or blocks, of so many rows and columns. first, count: for all or the selected ones.
        """
        down, right = np.nonzero(selected)
        first, count = (values[selected] if values.shape == selected.shape else values for values in (first, count))
        above, left = self.area.tile_y + TILE_ROWS * band.tiles.start - band.first, self.area.margin_columns // 2
        return np.stack([left + right * (columns // 2), above + down * rows, first, count], axis=-1).astype(np.uint32)
