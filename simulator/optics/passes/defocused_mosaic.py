"""The lens blur of a frame on the device, in bands of rows that stay in the cache."""

from collections.abc import Callable, Sequence

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.defocus import BLOCK_COLUMNS, BLOCK_ROWS, Method
from simulator.optics.passes.device_tables import DeviceTables
from simulator.optics.passes.row_band import Mosaics, RowBand
from simulator.optics.passes.scene_gather import gather_scene
from simulator.optics.passes.tile_grid import band_sizes
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.camera.cfa import Cfa


def defocused_mosaic(
    tiles: TilePlan, cfa: Cfa, device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    cfa: which colour each photosite sees. planes: for each layer a device buffer (channels, scene height, scene width) float32
    [e- s^-1 um^-2 sr^-1]; with the layer's coverage as one plane more where any layer of the scene has one.
    """
    return defocused_mosaics(tiles, [cfa], device, planes, progress)


def defocused_mosaics(
    tiles: TilePlan, cfas: Sequence[Cfa], device: Device, planes: list[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Mosaics of `defocused_mosaic` for several colour filters, which share all that does not depend on the colour.

    Device buffer (mosaics, height, width) float32.
    """
    window = tiles.optics.window
    light = device.zeros((len(cfas), window.height, window.width), np.float32)
    for number, cfa in enumerate(cfas):
        gather_scene(tiles, cfa, device, planes, light, number)
    if tiles.chosen.sample_grids():
        _blur_bands(tiles, cfas, device, planes, light, progress)
    progress(1.0)
    if tiles.wide is not None:
        for channel in sorted({channel for cfa in cfas for channel in cfa.colors}):
            cells = defocused_mosaic(tiles.wide, Cfa.uniform(channel), device, planes, lambda share: None)
            for number, cfa in enumerate(cfas):
                if channel in cfa.colors:
                    _write_wide(tiles, tiles.wide, cfa, channel, device, cells, light, number)
            device.finish()
            del cells  # its memory is for the next colour
    return light


def add_covariance(tiles: TilePlan, cfa: Cfa, device: Device, planes: list[Buffer], light: Buffer) -> None:
    """Add to a mosaic of layers that were gathered by distance the covariance of the layers over the aperture, in place.

    tiles: a plan of `only_covariance`. planes: as of `defocused_mosaic`.
    """
    _blur_bands(tiles, [cfa], device, planes, light, lambda share: None)


def _blur_bands(
    tiles: TilePlan,
    cfas: Sequence[Cfa],
    device: Device,
    planes: list[Buffer],
    light: Buffer,
    progress: Callable[[float], None],
) -> None:
    """Compute all tiles that are sampled, band by band, in buffers that are freed in the end."""
    window, area, chosen, optics = tiles.optics.window, tiles.area, tiles.chosen, tiles.optics
    composite = chosen.tiles_with(Method.COMPOSITE, Method.CORRECTED).any()
    shape = (len(cfas), window.height, window.width) if composite else (1,)
    mosaics = Mosaics(cfas, light, device.ones(shape, np.float32))
    tables = [DeviceTables(tiles, device, samples_per_axis) for samples_per_axis in chosen.sample_grids()]
    each, maps = optics.channels + optics.has_coverage, len(tiles.maps.scene_radius)
    sampled, sums, radii = map(max, zip(*(band_sizes(one.layout, len(planes), each, maps) for one in tables), strict=True))
    # Radii of layers without a map do not count, but must be numbers.
    buffers = device.empty((sampled,), np.float32), device.empty((sums,), np.float32), device.zeros((radii,), np.float32)
    row_bands = [RowBand(tiles, mosaics, device, one, planes, buffers) for one in tables]
    wait_for_last: Callable[[], object] = device.finish
    for band in range(area.bands):  # the host lists a band's tiles while the device computes the band before
        for row_band in row_bands:
            row_band.compute(band)
        wait_for_this = device.mark()
        if band > 0:
            wait_for_last()
            progress(band / area.bands)
        wait_for_last = wait_for_this
    wait_for_last()


def _write_wide(
    tiles: TilePlan, wide: TilePlan, cfa: Cfa, channel: int, device: Device, cells: Buffer, light: Buffer, number: int
) -> None:
    """Write the photosites of a colour in the blocks with the method WIDE.

    cells: mosaic of `wide` in this colour. light: (mosaics, height, width) float32. number: of the mosaic in it.
    """
    window, area, of_cells = tiles.optics.window, tiles.area, wide.optics.window
    rows, columns = np.nonzero(tiles.chosen.blocks.wide())
    x, y = area.tile_x - window.x + BLOCK_COLUMNS * columns, area.tile_y - window.y + BLOCK_ROWS * rows
    places = np.stack([x, y], axis=-1)
    device.run(
        device.kernel("wide_blur", {**cfa.macros(window.x, window.y)}),
        (BLOCK_COLUMNS, BLOCK_ROWS, len(places)),
        None,
        cells=cells,
        light=light,
        blocks=device.upload(places.astype(np.int32)),
        channel=channel,
        cell_columns=of_cells.width,
        cell_x=of_cells.x,
        cell_y=of_cells.y,
        frame_x=window.x,
        frame_y=window.y,
        width=window.width,
        height=window.height,
        light_row=number * window.height,
    )
