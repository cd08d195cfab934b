"""Executes a planned spread: light on the sensor in full colour, kernels over the field, each photosite its own colour.

Tiles lie along the whole sensor's grid and are computed whole, with real light around them, so that a crop has the bits of the
frame.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulator.blur import blurred_mosaic
from simulator.blur.relief import project_radius
from simulator.device import Device
from simulator.planner import Plan, projection_arguments, projection_defines
from simulator.psf_convolution import Spectra, Tile, gathered, source_of, tiles_of
from simulator.sensor.camera import Window

BLUR_SHARE = 0.7  # of the time, where the geometric blur comes first


@dataclass(frozen=True)
class Surface:
    """A layer of a scene on a tile and its margins, points of a photosite as phases (`Sampling.phases`).

    light: (channels, phases, rows, columns) float32, times coverage. coverage: (phases, rows, columns) float32; None: 1.
    radius_px: (phases, rows, columns) signed blur radius, or a float.
    """

    light: np.ndarray
    coverage: np.ndarray | None
    radius_px: np.ndarray | float


def spread_mosaic(planned: Plan, device: Device, planes: Sequence, progress: Callable[[float], None]):
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the lens.

    planes: for each layer a device buffer, as `blurred_mosaic` takes them.
    """
    frame, spread, block = planned.frame, planned.spread, planned.filter_block()
    width, height = spread.sensor_px
    every = list(tiles_of(spread.x_px, spread.y_px, (height, width)))
    tiles = [tile for tile in every if _meets(tile, frame)]
    spectra = Spectra(spread.kernel, spread.reach_px, every)
    surfaces, first = _projected, 0.0
    if planned.defocus is not None and not spread.by_distance:
        first = BLUR_SHARE
        surfaces = _Blurred(planned, device, planes, tiles, lambda share: progress(BLUR_SHARE * share))
    result = np.empty((frame.height, frame.width), np.float32)
    for count, tile in enumerate(tiles):
        layers = surfaces(planned, device, planes, _around(tile, spread.reach_px))
        for channel in sorted({channel for row in block for channel in row}):
            light = _seen(planned, layers, tile, spectra, channel)
            _take(result, light, tile, frame, [(y, x) for y in (0, 1) for x in (0, 1) if block[y][x] == channel])
        progress(first + (1.0 - first) * (count + 1) / len(tiles))
    return device.upload(result)


def _meets(tile: Tile, frame: Window) -> bool:
    down, across = tile.rows, tile.columns
    inside = down.start < frame.y + frame.height and down.stop > frame.y
    return inside and across.start < frame.x + frame.width and across.stop > frame.x


def _around(tile: Tile, reach_px: int) -> Window:
    rows, columns = tile.rows, tile.columns
    width, height = columns.stop - columns.start + 2 * reach_px, rows.stop - rows.start + 2 * reach_px
    return Window(columns.start - reach_px, rows.start - reach_px, width, height)


def _take(result: np.ndarray, light: np.ndarray, tile: Tile, frame: Window, places: list[tuple[int, int]]) -> None:
    """Put a tile's light of one colour into the photosites that see it: places in the 2 x 2 block of the frame's corner."""
    top, left = max(tile.rows.start, frame.y), max(tile.columns.start, frame.x)
    bottom, right = min(tile.rows.stop, frame.y + frame.height), min(tile.columns.stop, frame.x + frame.width)
    for y, x in places:
        row, column = top + (y - (top - frame.y)) % 2, left + (x - (left - frame.x)) % 2
        into = result[row - frame.y : bottom - frame.y : 2, column - frame.x : right - frame.x : 2]
        own = light[row - tile.rows.start : bottom - tile.rows.start : 2, column - tile.columns.start :][
            :, : right - column : 2
        ]
        np.maximum(own, 0.0, out=into, casting="same_kind")


class _Blurred:
    """The frame behind the geometric blur, in full colour, with its margins."""

    def __init__(self, planned: Plan, device: Device, planes: Sequence, tiles: list[Tile], progress: Callable[[float], None]):
        around = [_around(tile, planned.spread.reach_px) for tile in tiles]
        left, top = min(one.x for one in around), min(one.y for one in around)
        right, bottom = max(one.x + one.width for one in around), max(one.y + one.height for one in around)
        self.area = Window(left, top, right - left, bottom - top)
        shape = (self.area.height, self.area.width)
        self.light = {}
        channels = sorted({channel for row in planned.filter_block() for channel in row})
        for count, channel in enumerate(channels):
            one = replace(planned, only_colour=channel, area=self.area)
            buffer = blurred_mosaic(
                one, device, list(planes), lambda share, count=count: progress((count + share) / len(channels))
            )
            self.light[channel] = device.download(buffer, shape, np.float32)

    def __call__(self, planned: Plan, device: Device, planes: Sequence, part: Window) -> list[Surface]:
        """Return one surface with the light of all."""
        top, left = part.y - self.area.y, part.x - self.area.x
        light = {
            channel: plane[None, top : top + part.height, left : left + part.width] for channel, plane in self.light.items()
        }
        return [Surface(light, None, 0.0)]


def _projected(planned: Plan, device: Device, planes: Sequence, part: Window) -> list[Surface]:
    """Layers of the scene on a part of the sensor and beyond, without blur."""
    over, channels = planned.spread.over, planned.camera.channels
    radii = (0.0,) if planned.defocus is None else planned.defocus.radii_px
    defines = projection_defines(planned, over) | {"SPAN": 1}
    kernel = device.kernel("projection_planes", defines, file="projection.cl")
    columns, rows, ways = -(-part.width // 2), part.height * over, 2 * over
    covered = planned.defocus is not None and any(layer.coverage is not None for layer in planned.scene.layers)
    found, place = [], projection_arguments(planned, part.x, part.y)
    for buffer, radius in zip(planes, radii, strict=True):
        shape = (channels + covered, ways, rows, columns)
        sampled = device.empty(shape, np.float32)
        device.run(kernel, (columns, rows, shape[0] * ways), None, planes=buffer, sampled=sampled, first_plane=0, **place)
        light = _phases(device.download(sampled, shape, np.float32), over, part)
        here = radius
        if np.ndim(radius):
            mapped, scene_radius = device.empty(shape[1:], np.float32), device.upload(radius)
            edges = {"origin_x": part.x, "origin_y": part.y, "rows": rows, "way_columns": columns}
            project_radius(planned, device, scene_radius, mapped, 0, over=over, **edges)
            here = _phases(device.download(mapped, (1, *shape[1:]), np.float32), over, part)[0]
        found.append(Surface(light[:channels], light[channels] if covered else None, here))
    return found


def _phases(sampled: np.ndarray, over: int, part: Window) -> np.ndarray:
    """Planes in the order of ways.h -> (planes, over^2, rows, columns) of the part's photosites."""
    planes, _, rows, columns = sampled.shape
    split = sampled.reshape(planes, 2, over, rows // over, over, columns).transpose(0, 4, 2, 3, 5, 1)
    return np.ascontiguousarray(split.reshape(planes, over * over, rows // over, 2 * columns)[..., : part.width])


def _seen(planned: Plan, layers: list[Surface], tile: Tile, spectra: Spectra, channel: int) -> np.ndarray:
    """Light of a tile in one colour: layers over one another, front to back."""
    whole = len(layers) == 1 and layers[0].coverage is None
    if whole and np.ndim(layers[0].radius_px) == 0:
        slab = _slab_of(planned, layers[0].radius_px)
        return _light_seen(planned, layers[0].light[channel], 1.0, tile, spectra, (slab, channel))
    light, seen, through = 0.0, 0.0, 1.0
    for layer in layers:
        own_light, own_share = _layer_seen(planned, layer, tile, spectra, channel)
        light, seen = light + through * own_light, seen + through * own_share
        through = through * np.clip(1.0 - own_share, 0.0, 1.0)
    opaque = planned.defocus is not None and planned.defocus.opaque
    return light / seen if opaque else light


def _layer_seen(planned: Plan, layer: Surface, tile: Tile, spectra: Spectra, channel: int):
    """Light of a layer, and how much of the aperture it fills; neighbouring slabs are one surface, nearer ones hide.

    A slab is seen through what those before its neighbour leave open, and closes what it is seen of.
    """
    light, seen, before, open_ = 0.0, 0.0, 1.0, 1.0
    for slab, joined, share in _shares(planned, layer):
        if not joined:
            before = open_
        own_light = _light_seen(planned, layer.light[channel], share, tile, spectra, (slab, channel))
        covered = share if layer.coverage is None else layer.coverage * share
        own_share = gathered(source_of(covered, spectra), tile, spectra, slab, channel, False) / planned.spread.light
        light, seen = light + before * own_light, seen + before * own_share
        before, open_ = open_, np.maximum(open_ - before * own_share, 0.0)
    return light, seen


def _light_seen(planned: Plan, light: np.ndarray, share, tile: Tile, spectra: Spectra, name: tuple[int, int]) -> np.ndarray:
    """Light of a slab on a tile; what is bright goes through a kernel that does not ring. name: slab and channel."""
    spread, rest = planned.spread, None
    if spread.rings(*name) and light.max() > spread.bright[name[1]]:
        limit = np.float32(spread.bright[name[1]])
        light, rest = np.minimum(light, limit), np.maximum(light - limit, np.float32(0.0))
    found = gathered(source_of(light * share, spectra), tile, spectra, *name, False)
    return found if rest is None else found + gathered(source_of(rest * share, spectra), tile, spectra, *name, True)


def _shares(planned: Plan, layer: Surface) -> Iterator[tuple[int, bool, np.ndarray]]:
    """Slabs in which a layer has light, nearest first: number, whether it may be one surface with the last, share of light."""
    spread = planned.spread
    if np.ndim(layer.radius_px) == 0:
        yield _slab_of(planned, layer.radius_px), False, np.ones(layer.light.shape[1:])
        return
    place, last = np.interp(layer.radius_px, spread.radii_px, np.arange(len(spread.radii_px))), None
    for slab in range(int(place.min()), int(np.ceil(place.max())) + 1):
        share = np.maximum(0.0, 1.0 - np.abs(place - slab))
        if share.any():
            yield slab, last == slab - 1 and spread.joined(slab), share
            last = slab


def _slab_of(planned: Plan, radius_px: float) -> int:
    """Slab of a layer at one distance; the only one where blur comes first."""
    return int(np.argmin(np.abs(np.asarray(planned.spread.radii_px) - radius_px)))
