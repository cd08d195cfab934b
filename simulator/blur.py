"""Executes the planned lens blur on the device: layers front to back, each only where it can be seen."""

from collections.abc import Callable

import numpy as np

from simulator import tiles
from simulator.defocus import disk_chords
from simulator.device import Device
from simulator.planner import Plan, projection_arguments, projection_defines

SEGMENT = 128  # photosites per running sum; also the width of a tile of this pass
BLOCK_HEIGHT = 32  # rows of a tile: low enough to leave out what a layer does not reach


class BlurFrame:
    """Geometry of the frame with its margin, aligned to segments and tiles of the whole sensor."""

    def __init__(self, planned: Plan):
        frame, reach = planned.frame, planned.layers.reach_px
        self.x = (frame.x - reach) // SEGMENT * SEGMENT
        self.y = (frame.y - reach) // BLOCK_HEIGHT * BLOCK_HEIGHT
        self.columns = -(-(frame.x + frame.width + reach - self.x) // SEGMENT) * SEGMENT
        self.rows = -(-(frame.y + frame.height + reach - self.y) // BLOCK_HEIGHT) * BLOCK_HEIGHT
        self.margin_x, self.margin_y = frame.x - self.x, frame.y - self.y
        self.reach = reach

    @property
    def grid(self) -> tuple[int, int]:
        """Tile rows and segments."""
        return self.rows // BLOCK_HEIGHT, self.columns // SEGMENT

    def inside(self, planned: Plan) -> np.ndarray:
        """Tiles that hold photosites of the frame: (tile rows, segments) bool."""
        first_rows = np.arange(self.grid[0]) * BLOCK_HEIGHT - self.margin_y
        first_columns = np.arange(self.grid[1]) * SEGMENT - self.margin_x
        rows = (first_rows + BLOCK_HEIGHT > 0) & (first_rows < planned.frame.height)
        columns = (first_columns + SEGMENT > 0) & (first_columns < planned.frame.width)
        return rows[:, None] & columns[None, :]


def blurred_mosaic(planned: Plan, device: Device, planes, progress: Callable[[float], None]):
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the defocused lens.

    planes: device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1].
    """
    frame, area = planned.frame, BlurFrame(planned)
    channels, radii = planned.camera.channels, planned.layers.radii_px
    sampled = _sampled_planes(planned, device, planes, area)
    layers, present = _layer_map(planned, device, area)
    coverage = int(planned.layers.scene_layers is not None)
    light = device.empty((frame.height, frame.width), np.float32)
    seen = device.empty((frame.height, frame.width) if coverage else (1,), np.float32)
    sums = device.empty((channels + coverage, area.rows, area.grid[1], SEGMENT + 2 * area.reach + 2), np.float32)
    cfa = {key: value for key, value in projection_defines(planned).items() if key.startswith("CFA")}
    defines = {"SEGMENT": SEGMENT, "CHANNELS": channels, "COVERAGE": coverage, **cfa}
    sum_kernel = device.kernel("defocus_sums", defines, file="defocus.cl")
    gather_kernel = device.kernel("defocus_gather", defines, file="defocus.cl")
    if coverage:
        clear = device.kernel("defocus_clear", defines, file="defocus.cl")
        device.run(clear, (frame.width * frame.height,), None, light=light, seen=seen)
    size = {"rows": area.rows, "columns": area.columns, "reach": area.reach}
    for layer, radius in enumerate(radii):
        held = (present >> np.uint64(layer)) & np.uint64(1) > 0
        tile_rows = -(-(int(radius) + 1) // BLOCK_HEIGHT)
        gathered = tiles.grown(held, tile_rows, 1) & area.inside(planned)
        if not gathered.any():
            continue
        summed = _tile_list(tiles.grown(gathered, tile_rows, 0))
        device.run(
            sum_kernel,
            (BLOCK_HEIGHT, channels + coverage, len(summed)),
            (BLOCK_HEIGHT, 1, 1),
            sampled=sampled,
            layers=layers,
            sums=sums,
            tiles=device.upload(summed),
            layer=layer,
            **size,
        )
        chords, disk_area = disk_chords(radius)
        wanted = _tile_list(gathered)
        device.run(
            gather_kernel,
            (SEGMENT // 2, 2 * BLOCK_HEIGHT, len(wanted)),
            (SEGMENT // 2, 2, 1),
            sums=sums,
            sampled=sampled,
            light=light,
            seen=seen,
            tiles=device.upload(wanted),
            chords=device.upload(chords),
            disk_rows=len(chords),
            disk_area=disk_area,
            margin_x=area.margin_x,
            margin_y=area.margin_y,
            width=frame.width,
            height=frame.height,
            **size,
        )
        device.finish()
        progress((layer + 1) / len(radii))
    if coverage:
        normalise = device.kernel("defocus_normalise", defines, file="defocus.cl")
        place = {"margin_x": area.margin_x, "margin_y": area.margin_y, "rows": area.rows, "columns": area.columns}
        device.run(normalise, (frame.width, frame.height), None, sampled=sampled, light=light, seen=seen, **place)
    return light


def _tile_list(wanted: np.ndarray) -> np.ndarray:
    """(tiles, 2) uint32: segment and first row of the wanted tiles."""
    tile_rows, segments = np.nonzero(wanted)
    return np.stack([segments, tile_rows * BLOCK_HEIGHT], axis=-1).astype(np.uint32)


def _sampled_planes(planned: Plan, device: Device, planes, area: BlurFrame):
    channels = planned.camera.channels
    sampled = device.empty((channels, area.rows, area.columns), np.float32)
    kernel = device.kernel("projection_planes", projection_defines(planned), file="projection.cl")
    arguments = projection_arguments(planned, area.x, area.y)
    device.run(kernel, (area.columns, area.rows, channels), None, planes=planes, sampled=sampled, **arguments)
    return sampled


def _layer_map(planned: Plan, device: Device, area: BlurFrame):
    """Layer of every photosite with its margin (device buffer), and which layers each tile holds."""
    if planned.layers.scene_layers is None:
        return device.zeros((area.rows, area.columns), np.uint8), np.ones(area.grid, np.uint64)
    layers = device.empty((area.rows, area.columns), np.uint8)
    kernel = device.kernel("projection_layers", projection_defines(planned), file="projection.cl")
    arguments = projection_arguments(planned, area.x, area.y)
    scene_layers = device.upload(planned.layers.scene_layers)
    device.run(kernel, (area.columns, area.rows), None, scene_layers=scene_layers, layers=layers, **arguments)
    found = device.download(layers, (area.rows, area.columns), np.uint8)
    return layers, tiles.presence(found, BLOCK_HEIGHT, SEGMENT)
