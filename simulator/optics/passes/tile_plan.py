"""The measured part of a plan: which method each tile of a blurred frame gets, by what the tile sees of the scene's depths."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from simulator.device import Device
from simulator.optics.defocus.defocus import Method
from simulator.optics.defocus.field_zones import Zones
from simulator.optics.defocus.highlights import bright_limit
from simulator.optics.defocus.tile_methods import TileChoice, choose
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.radius_statistics import Maps, measured_maps
from simulator.optics.passes.tile_grid import BlurFrame


@dataclass(frozen=True)
class TilePlan:
    """Methods of a blurred frame's tiles, and the maps they follow from.

    optics: of the photosites that are blurred, which are more than the plan's where a point spread function follows.
    area: geometry of tiles and bands. maps: blur radii on the device. chosen: method of each tile and block.
    zones: of the field, where rims cut the pupil; None: it is the same everywhere.
    """

    optics: OpticsPlan
    area: BlurFrame
    maps: Maps
    chosen: TileChoice
    zones: Zones | None

    def shares(self) -> dict[Method, float]:
        """Share of the frame's tiles that each method computes; blocks of points count as parts of their tile."""
        blocks = self.chosen.blocks
        pointed, wanted = blocks.wanted & (blocks.methods == Method.OCCLUSION), max(int(blocks.wanted.sum()), 1)
        tile_of_block = self.chosen.methods.repeat(blocks.wanted.shape[0] // self.chosen.methods.shape[0], axis=0)
        tile_of_block = tile_of_block.repeat(blocks.wanted.shape[1] // self.chosen.methods.shape[1], axis=1)
        methods = np.where(pointed, Method.OCCLUSION, tile_of_block)
        return {method: float((blocks.wanted & (methods == method)).sum() / wanted) for method in Method}

    @cached_property
    def highlight_limit(self) -> np.ndarray | None:
        """Electron radiance above which a sample is a highlight, (channels,); None: no sample of the scene is."""
        return bright_limit(self.optics.scene, self.optics.weights)


def plan_tiles(optics: OpticsPlan, device: Device) -> TilePlan | None:
    """Measure the blur radii of a frame on a device and choose the methods; None where no method is chosen by tile."""
    psf = optics.psf
    if optics.defocus is None or optics.accuracy.tolerance == 0.0 or (psf is not None and psf.by_distance):
        return None
    optics = replace(optics, window=optics.blur_window())
    area = BlurFrame(optics.window, optics.defocus.reach_px)
    maps = measured_maps(optics, device, area)
    chosen, zones = choose(optics.defocus, maps.layer_statistics, area.inside()), None
    if optics.defocus.eyes is not None:
        zones = Zones(optics.defocus.eyes, area.x, area.y, area.grid)
        chosen = replace(chosen, zone=zones.first_corner)
    return TilePlan(optics, area, maps, chosen, zones)
