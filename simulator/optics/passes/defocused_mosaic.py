"""The lens blur of a frame on the device, in bands of rows that stay in the cache."""

from collections.abc import Callable

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import Method
from simulator.optics.passes.device_tables import DeviceTables
from simulator.optics.passes.row_band import RowBand
from simulator.optics.passes.scene_gather import gather_scene
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.camera.cfa import Cfa


def defocused_mosaic(
    tiles: TilePlan, cfa: Cfa, device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    cfa: which colour each photosite sees. planes: for each layer a device buffer (channels, scene height, scene width) float32
    [e- s^-1 um^-2 sr^-1]; with the layer's coverage as one plane more where any layer of the scene has one.
    """
    window, area, chosen = tiles.optics.window, tiles.area, tiles.chosen
    light = device.zeros((window.height, window.width), np.float32)
    composite = chosen.tiles_with(Method.COMPOSITE, Method.CORRECTED).any()
    open_ = device.ones((window.height, window.width) if composite else (1,), np.float32)
    gather_scene(tiles, cfa, device, planes, light)
    tables = [DeviceTables(tiles, device, samples_per_axis) for samples_per_axis in chosen.sample_grids()]
    row_bands = [RowBand(tiles, cfa, device, one, planes, open_) for one in tables]
    for band in range(area.bands):
        for row_band in row_bands:
            row_band.compute(band, light)
        device.finish()
        progress((band + 1) / area.bands)
    return light
