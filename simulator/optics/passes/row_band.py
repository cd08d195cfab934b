"""A band of rows with its margins on the device, and the kernels that blur it."""

from dataclasses import replace

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.aperture_samples import points_wanted
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Method
from simulator.optics.defocus.radius_slabs import BlockChoice, slab_lists
from simulator.optics.defocus.tile_methods import NODES_PER_PX, TileChoice
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.passes.device_tables import BlurTables
from simulator.optics.passes.highlight_pass import StripLights
from simulator.optics.passes.tile_grid import HALF_TILE
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.camera.cfa import Cfa

POINTS_SAVED = 4  # where points find the means' covariance only, and do not spread over the photosite, too


class Strip:
    """The buffers of a band of rows with its margins, at `over` x `over` samples per photosite, and what runs on them."""

    def __init__(self, tiles: TilePlan, cfa: Cfa, device: Device, tables: BlurTables, planes: list[Buffer], open_: Buffer):
        over, area, maps = tables.over, tiles.area, tiles.maps
        self.tiles, self.device, self.area, self.maps, self.chosen = tiles, device, area, maps, tiles.chosen
        self.projection, self.defocus = tiles.optics.projection, tiles.optics.defocus
        self.tables, self.planes, self.open = tables, planes, open_
        self.over, self.layout = over, area.strip_layout(over)
        self.channels, self.coverage = tiles.optics.channels, int(tiles.optics.has_coverage)
        self.layer_planes = self.channels + self.coverage
        self.sampled = device.empty(self.layout.shape(len(planes) * self.layer_planes), np.float32)
        sums = replace(self.layout, rows=self.layout.rows + 2)  # one sum more than rows, and the columns' minima
        self.sums = device.empty(sums.shape(self.layer_planes), np.float32)
        self.radius = device.zeros(self.layout.shape(max(len(maps.scene_radius), 1)), np.float32)
        # Points run over 16 columns and 4 rows of a colour at once on CPUs; on GPUs there are work-items enough.
        self.block_size = (1, 1) if device.span == 1 else (BLOCK_COLUMNS // 2, BLOCK_ROWS // 2)
        held = {"OVER": over, "CHANNELS": self.channels, "COVERAGE": self.coverage, "NODES_PER_PX": f"{NODES_PER_PX}.0f"}
        self.defines = {**cfa.macros(area.frame.x, area.frame.y), **held, "SPAN": device.span}

    def band(self, band: int, light) -> None:
        """Compute one band of rows of the mosaic `light`."""
        tiles = self.area.band_tiles(band)
        chosen = self.chosen.part(tiles, self.over)
        if not chosen.wanted.any():
            return
        strip_row = self.area.strip_row(band)
        self._sample(strip_row)
        for layer in range(len(self.planes)):
            self._means(chosen, layer, strip_row, light)
        self._occlusion(chosen.blocks, strip_row, light)

    def _row_band(self, strip_row: int) -> dict[str, int]:
        """Fields of `struct row_band` of kernels/row_band.h for the band that begins at this row of the area."""
        area, frame = self.area, self.area.frame
        return {
            "sample_rows": self.layout.rows,
            "set_columns": self.layout.set_columns,
            "frame_x": -area.margin_x,
            "frame_y": strip_row - area.margin_y,
            "width": frame.width,
            "height": frame.height,
        }

    def _sample(self, strip_row: int) -> None:
        origin, count = (self.area.x, self.area.y + strip_row), self.layer_planes
        for layer, planes in enumerate(self.planes):
            project_planes(self.device, self.projection, planes, count, self.sampled, layer * count, self.layout, origin)

    def _means(self, chosen: TileChoice, layer: int, strip_row: int, light: Buffer) -> None:
        """Tiles that the layer fills, copied or a mean over the aperture's image, and those that several share."""
        here = chosen.visible[layer]
        copied, mean = (here & chosen.with_method(method) for method in (Method.COPY, Method.MEAN))
        composite = here & chosen.with_method(Method.COMPOSITE, Method.CORRECTED)
        cut = (chosen.zone >= 0) & ~copied
        if any(self.tables.of_tiles(clipped)[2] for clipped in np.unique(cut[mean | composite]).tolist()):
            planes = self.channels + bool(composite.any())
            kernel = self.device.kernel(
                "defocus_sums", self.defines | {"NODES": 0, "COMPOSITE": 0, "ZONE": 0}, file="defocus.cl"
            )
            size = (self.layout.set_columns // self.device.span, self.layout.column_sets * planes)
            buffers = {"sampled": self.sampled, "sums": self.sums, "first_plane": layer * self.layer_planes}
            self.device.run(kernel, size, None, **buffers, band=self._row_band(strip_row))
        constant = chosen.constant[layer]
        for graded, several, wanted in (
            (0, 0, copied | mean & constant),
            (1, 0, mean & ~constant),
            (0, 1, composite & constant),
            (1, 1, composite & ~constant),
        ):
            for clipped in (False, True):
                tiles = wanted & (cut == clipped)
                if tiles.any():
                    variant = {"NODES": graded, "COMPOSITE": several}
                    images = np.where(copied, 0, chosen.images[layer])
                    self._mean(chosen, layer, tiles, images, variant, clipped, strip_row, light)

    def _mean(
        self,
        chosen: TileChoice,
        layer: int,
        wanted: np.ndarray,
        images: np.ndarray,
        variant: dict[str, int],
        clipped: bool,
        strip_row: int,
        light: Buffer,
    ) -> None:
        table, places, _ = self.tables.of_tiles(clipped)
        defines = self.defines | variant | self.tables.defines(clipped)
        spans, first = HALF_TILE // defines["SPAN"], places[chosen.first_image[layer]]
        surface = {
            "first_plane": layer * self.layer_planes,
            "map": sum(np.ndim(radius) > 0 for radius in self.defocus.radii_px[:layer]),
            "map_rows": self.area.rows,
            "map_row": strip_row,
            "zone_row": self.area.reach,
        }
        self.device.run(
            self.device.kernel("defocus_mean", defines, file="defocus.cl"),
            (spans, 2 * TILE_ROWS, int(wanted.sum())),
            (spans, 1, 1),
            sampled=self.sampled,
            sums=self.sums,
            radius=self.maps.radius,
            light=light,
            open=self.open,
            tiles=self.device.upload(self._places(wanted, TILE_ROWS, TILE_COLUMNS, first, images)),
            corners=self.tables.corners(chosen.zone[wanted] if clipped else None),
            surface=surface,
            band=self._row_band(strip_row),
            **table,
        )

    def _occlusion(self, chosen: BlockChoice, strip_row: int, light: Buffer) -> None:
        """Blocks where surfaces hide each other."""
        sampled = chosen.sampled()
        if not sampled.any():
            return
        lists = slab_lists(self.defocus, chosen.present[:, sampled], chosen.even_px[:, sampled])
        if lists.mapped.any():
            self._sample_radius(strip_row)
        slabs, places = (
            self.device.upload(lists.slabs),
            self._places(sampled, BLOCK_ROWS, BLOCK_COLUMNS, lists.first, lists.count),
        )
        corrected = chosen.methods[sampled] == Method.CORRECTED
        limit, place = self.tiles.highlight_limit, {"light": light, "band": self._row_band(strip_row)}
        lights = None if limit is None else StripLights(self, strip_row, places, limit)
        if lights is not None and lights.reached.any():
            lights.take()
            corrected &= ~lights.reached  # the means hold the lights
        points = points_wanted(chosen.largest_px[sampled], self.defocus)
        points = np.where(corrected & (self.over == 1), points // POINTS_SAVED, points)
        rows, columns = np.nonzero(sampled)
        around = self.tables.around_blocks((strip_row + self.area.reach) // BLOCK_ROWS + rows, columns)
        kinds = np.stack([points, corrected, lists.mapped, around[0][:, 0] >= 0])
        for kind in np.unique(kinds, axis=1).T:
            wanted = (kinds == kind[:, None]).all(axis=0)
            self._follow(kind.tolist(), places[wanted], tuple(part[wanted] for part in around), slabs, place)
        if lights is not None and lights.reached.any():
            lights.spread(slabs, **place)

    def _follow(
        self, kind: list[int], places: np.ndarray, around: tuple[np.ndarray, np.ndarray], slabs: Buffer, place: dict
    ) -> None:
        """Blocks that share the number of points, whether they are a correction, read a map, and have points of their own."""
        number, correction, mapped, clipped = kind
        span, rows = self.block_size
        size = (BLOCK_COLUMNS // 2 // span, 2 * BLOCK_ROWS // rows, len(places))
        variant = {"LAYERS": len(self.planes), "CORRECTION": correction, "MAPPED": mapped, "SPAN": span, "ROWS": rows}
        points = self.tables.points(number, around if clipped else None)
        first_points = number * clipped * np.arange(len(places))
        self.device.run(
            self.device.kernel("occlusion", self.defines | variant, file="occlusion.cl"),
            size,
            (size[0], 1, 1),
            planes=self.sampled,
            radius=self.radius,
            blocks=self.device.upload(np.column_stack([places, first_points]).astype(np.uint32)),
            slabs=slabs,
            points=self.device.upload(points),
            point_count=number,
            normalise=int(self.defocus.opaque),
            **place,
        )

    def _sample_radius(self, strip_row: int) -> None:
        """Radius maps at the strip's points."""
        origin = self.area.x, self.area.y + strip_row
        for number, scene_radius in enumerate(self.maps.scene_radius):
            project_radius(self.device, self.projection, scene_radius, self.radius, number, self.layout, origin)

    def _places(self, wanted: np.ndarray, rows: int, columns: int, first: np.ndarray, count: np.ndarray) -> np.ndarray:
        """(places, 4) uint32: first column of its set and row in the band, first entry and entries of its list.

        wanted: of the band's tiles or blocks, of so many rows and columns. first, count: of the same, or of the wanted ones.
        """
        down, right = np.nonzero(wanted)
        first, count = (values[wanted] if values.shape == wanted.shape else values for values in (first, count))
        return np.stack([right * (columns // 2), self.area.reach + down * rows, first, count], axis=-1).astype(np.uint32)
