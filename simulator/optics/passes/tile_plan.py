"""The measured part of a plan: the blur method of each tile of a frame, by the radius statistics around it."""

from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from simulator.device import Device
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, TILE_COLUMNS, TILE_ROWS, Defocus, Method
from simulator.optics.defocus.field_zones import Zones
from simulator.optics.defocus.highlights import BRIGHT, LAMP, highlight_threshold
from simulator.optics.defocus.tile_methods import TileChoice, choose_methods
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.radius_statistics import RadiusMaps, measure_radius_maps, project_radius_maps
from simulator.optics.passes.tile_grid import TileGrid
from simulator.scene.content_keys import freeze
from simulator.sensor.camera.camera_sections import Window


@dataclass(frozen=True)
class TilePlan:
    """Methods of a blurred frame's tiles, and the radius maps by which they were chosen.

    optics: its window is larger than the frame's where a point spread function follows, which needs a margin.
    area: geometry of tiles and bands. maps: blur radii on the device. chosen: method of each tile and block.
    zones: zones of the field, where rims clip the pupil; None: the pupil is the same everywhere.
    key: what all of it depends on besides the blur.
    wide: the same on photosites twice as wide, for the blocks with the method WIDE; None: there are none.
    only_covariance: whether kernels by distance gather the light, so that blocks add the covariance of its layers alone.
    """

    optics: OpticsPlan
    area: TileGrid
    maps: RadiusMaps
    chosen: TileChoice
    zones: Zones | None
    key: Hashable
    wide: Self | None = None
    only_covariance: bool = False

    @property
    def defocus(self) -> Defocus:
        """Blur of the scene's layers."""
        assert self.optics.defocus is not None  # plan_tiles plans no tiles without it
        return self.optics.defocus

    def areas(self) -> list[tuple[Projection, Window]]:
        """Photosites whose light the blur gathers, with the projection of the scene onto them."""
        own = [(self.optics.projection, seen) for seen in self.defocus.seen_aside(self.area.read_area())]
        return [*own, *(self.wide.areas() if self.wide is not None else [])]

    def shares(self) -> dict[Method, float]:
        """Share of the frame that each method computes; blocks that sample the aperture count as parts of their tile."""
        blocks = self.chosen.blocks
        total = max(int(blocks.computed.sum()), 1)
        tile_of_block = self.chosen.methods.repeat(blocks.computed.shape[0] // self.chosen.methods.shape[0], axis=0)
        tile_of_block = tile_of_block.repeat(blocks.computed.shape[1] // self.chosen.methods.shape[1], axis=1)
        methods = np.where(blocks.methods >= Method.OCCLUSION, blocks.methods, tile_of_block)
        return {method: float((blocks.computed & (methods == method)).sum() / total) for method in Method}

    @cached_property
    def highlight_limit(self) -> np.ndarray | None:
        """Electron radiance above which a sample is a highlight, (channels,); None: no sample of the scene is.

        None where images move, too: a highlight stays among the samples, and its light on its path.
        """
        return None if self.defocus.motion is not None else self._threshold(BRIGHT)

    @cached_property
    def lamp_limit(self) -> np.ndarray | None:
        """Electron radiance above which a sample would leave rounding errors in running sums, (channels,); None: none is.

        None behind rims, too: a spot has the pupil of its light, but a mean has that of each photosite.
        """
        if self.highlight_limit is None or self.zones is not None:
            return None
        return self._threshold(LAMP)

    def _threshold(self, times: float) -> np.ndarray | None:
        """`highlight_threshold` of the scene, which is the same for all windows of a frame."""
        scene, weights, lamps = self.optics.scene, self.optics.weights, self.optics.lamps
        if lamps is not None:  # drawn by themselves
            key = "highlights of the rest", freeze((weights, lamps)), times
            return scene.remember(key, lambda: highlight_threshold(lamps.without(scene, weights), weights, times))
        return scene.remember(("highlights", freeze(weights), times), lambda: highlight_threshold(scene, weights, times))


def plan_tiles(optics: OpticsPlan, device: Device) -> TilePlan | None:
    """Measure the blur radii of a frame on a device and choose each tile's method; None where methods do not differ by tile."""
    defocus = optics.defocus
    if defocus is None:
        return None
    if optics.psf is not None and optics.psf.by_distance:
        is_corrected = optics.has_coverage and defocus.has_covariance and not optics.layer_rays
        return _plan_covariance(optics, defocus, device) if is_corrected else None
    if optics.accuracy.tolerance == 0.0:
        return None
    return _plan_tiles(replace(optics, window=optics.blur_window()), defocus, device)


def _plan_covariance(optics: OpticsPlan, defocus: Defocus, device: Device) -> TilePlan | None:
    """Plan the blocks of light gathered by distance to which the covariance of layers is added; None: there are none.

    Kernels by distance composite the means of layers. Blocks that see several layers out of focus lack their covariance over
    the aperture, which is that of the rays of geometry (kernels/occlusion.cl, CORRECTION 1).
    """
    planned = _plan_tiles(optics, defocus, device)
    blocks = planned.chosen.blocks
    corrected = blocks.computed & (blocks.methods == Method.CORRECTED)
    if not corrected.any():
        return None
    tiles = planned.chosen.tiles_of_blocks(corrected)
    blocks = replace(blocks, methods=np.where(corrected, blocks.methods, Method.COPY))
    methods = np.full_like(planned.chosen.methods, Method.OCCLUSION)  # whose tiles have no means
    chosen = replace(planned.chosen, computed=tiles, methods=methods, blocks=blocks)
    return replace(planned, chosen=chosen, wide=None, only_covariance=True)


def _plan_tiles(optics: OpticsPlan, defocus: Defocus, device: Device, needed: np.ndarray | None = None) -> TilePlan:
    """Plan the tiles of a window.

    needed: (photosites, 2) int, x and y on the sensor of photosites whose tiles are computed; None: all tiles of the window.
    """
    area = TileGrid(optics.window, defocus.reach_px)
    maps = project_radius_maps(optics, defocus, device, area)
    computed = np.ones(area.grid, bool)
    if needed is not None:
        tiles = (needed[:, ::-1] - (area.tile_y, area.tile_x)) // (TILE_ROWS, TILE_COLUMNS)
        computed[...] = False
        computed[tuple(tiles[((tiles >= 0) & (tiles < area.grid)).all(axis=1)].T)] = True

    def choose() -> TileChoice:
        layer_statistics = measure_radius_maps(optics, defocus, device, area, maps)
        return choose_methods(defocus, layer_statistics, computed, area.margin_patches)

    # The plan of the optics is kept with the scene, and with it what was measured on any device: they give the same bits.
    key = optics.projection, optics.moved_radii, optics.sensor_px, optics.window, computed.tobytes()
    chosen, zones, wide = defocus.remember(key, choose), None, None
    if defocus.eyes is not None:
        zones = Zones(defocus.eyes, area.tile_x, area.tile_y, area.grid)
        chosen = replace(chosen, zone=zones.first_corner)
    if len(places := np.argwhere(chosen.blocks.wide())):
        x, y = area.tile_x + BLOCK_COLUMNS * places[:, 1], area.tile_y + BLOCK_ROWS * places[:, 0]
        around = [(x // 2 + right, y // 2 + down) for down in (-1, BLOCK_ROWS // 2) for right in (-1, BLOCK_COLUMNS // 2)]
        wider = optics.on_wider_photosites()
        assert wider.defocus is not None  # it is that of `optics`
        wide = _plan_tiles(wider, wider.defocus, device, np.concatenate([np.stack(corner, axis=-1) for corner in around]))
    return TilePlan(optics, area, maps, chosen, zones, key, wide)
